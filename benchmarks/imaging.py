"""An image against the FFTs that it cannot do without, and its memory.

Raw data are noise of the size of the closed loop's first image, 2048 lines of 1024 samples; no
cost depends on what is in them. On one core, all in turns. Results are medians over the turns, of
processor time, all threads added up, and of wall time; the ratios are of processor time.

*An image* is ``Focuser.image``. Its FFTs are the two inverse ones, with the sizes, precision and
workers of the image, in place: over range, of the processed Doppler lines; over azimuth, of the
image's samples.

*From raw data* is a ``Focuser`` and an image; its FFTs are these two, and those over range of all
pulses and over azimuth of all ranges.

*Sharpness of a patch* is one step of a climb: an image of 256 ranges with all its lines, of a
``Focuser.patch`` that was cut before, and its sharpness. Its FFTs are again the two inverse ones.

Memory is that of a fresh process which simulates that first image, its raw data and its reference,
and focuses it fifty times: the most that was resident until the third image, and what was resident
after fifty more than after five. The reference's features need OpenCV, which the environment of
the book has and that of the peers has not.
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from statistics import median

if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # before any library counts the cores

import numpy as np
from scipy import fft

from navfilters.papers.pogorelsky2020.acquisition import acquire
from navfilters.papers.pogorelsky2020.experiment import CASES
from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.sar.images.autofocusing import sharpness
from navfilters.sar.images.focuser import Focuser
from navfilters.sar.raw.radar import PALSAR, Raw

REPEATS = 15
PULSES, RANGES = 9342, 1908
PATCH = 256
VELOCITY, SLOPE = 7182.0, -1.86  # m/s, m/s^2
RESULTS = Path(__file__).with_name("imaging.json")


def noise() -> Raw:
    """Raw data of PALSAR's header."""
    rng = np.random.default_rng(0)
    z = rng.standard_normal((PULSES, RANGES, 2), dtype=np.float32).view(np.complex64)[..., 0]
    return Raw(
        z,
        PALSAR.wavelength,
        PALSAR.sampling,
        PALSAR.prf,
        PALSAR.pulse_length,
        PALSAR.chirp_rate,
        860e3,
        0.0,
    )


def focuser_of(raw: Raw) -> Focuser:
    """With the sizes and the bandwidth of the closed loop."""
    imaging = Imaging()
    return Focuser(raw, lines=imaging.lines, samples=imaging.samples, bandwidth=imaging.bandwidth)


def transforms(shape: tuple[int, int], axis: int, inverse: bool = True) -> Callable[[], object]:
    """An FFT of this size, over and over in the same place."""
    data = np.ones(shape, np.complex64)
    transform = fft.ifft if inverse else fft.fft
    return lambda: transform(data, axis=axis, workers=2, overwrite_x=True, norm="ortho")


def of_an_image(focuser: Focuser) -> list[Callable[[], object]]:
    """The inverse FFTs of its images, over range and over azimuth."""
    lines, ranges = focuser._spectrum.shape
    return [
        transforms((lines, ranges), axis=1),
        transforms((focuser._n, focuser._samples), axis=0),
    ]


def in_turns(jobs: dict[str, list[Callable[[], object]]]) -> dict[str, dict[str, float]]:
    """Milliseconds of each job, of the processor and by the clock."""
    spent = {name: ([], []) for name in jobs}
    for repeat in range(REPEATS + 1):  # the first fills caches
        for name, job in jobs.items():
            start = time.process_time(), time.perf_counter()
            for part in job:
                part()
            if repeat:
                spent[name][0].append(1e3 * (time.process_time() - start[0]))
                spent[name][1].append(1e3 * (time.perf_counter() - start[1]))
    return {
        name: {"cpu_ms": round(median(cpu), 1), "wall_ms": round(median(wall), 1)}
        for name, (cpu, wall) in spent.items()
    }


def costs() -> dict[str, dict[str, float]]:
    """Each task, its FFTs and their ratio."""
    raw = noise()
    focuser = focuser_of(raw)
    patch = focuser.patch(PATCH, VELOCITY)
    ranges = focuser._spectrum.shape[1]
    forward = [
        transforms((PULSES, ranges), axis=1, inverse=False),
        transforms((focuser._n, ranges), axis=0, inverse=False),
    ]

    def step() -> float:
        pixels = patch.image(VELOCITY + 3.0, SLOPE).pixels
        return sharpness(pixels.real**2 + pixels.imag**2)

    inverse = of_an_image(focuser)
    tasks = {
        "image": ([lambda: focuser.image(VELOCITY, SLOPE)], inverse),
        "from raw data": ([lambda: focuser_of(raw).image(VELOCITY, SLOPE)], forward + inverse),
        f"sharpness of {PATCH} ranges": ([step], of_an_image(patch)),
    }
    jobs = {}
    for name, (task, ffts) in tasks.items():
        jobs |= {name: task, f"{name}: FFTs": ffts}
    spent = in_turns(jobs)
    return {
        name: {
            **spent[name],
            "ffts_cpu_ms": spent[f"{name}: FFTs"]["cpu_ms"],
            "ffts_wall_ms": spent[f"{name}: FFTs"]["wall_ms"],
            "ratio": round(spent[name]["cpu_ms"] / spent[f"{name}: FFTs"]["cpu_ms"], 2),
        }
        for name in tasks
    }


def campaign() -> dict[str, float]:
    """Megabytes: the most until the third image, and the growth from the fifth to the fiftieth."""
    acquired = acquire(CASES["TC-1"], 1)
    resident, most = [], 0.0
    for i in range(50):
        acquired.focuser.image(acquired.effective(acquired.speed + i % 10 - 5), acquired.slope)
        if i == 2:
            most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        resident.append(pages * resource.getpagesize())
    return {
        "peak_mb": round(most / 1e6),
        "after_5_images_mb": round(resident[4] / 1e6),
        "after_50_images_mb": round(resident[49] / 1e6),
        "growth_mb": round((resident[49] - resident[4]) / 1e6, 1),
    }


def main() -> None:
    """Measure, print and write ``imaging.json``."""
    if sys.argv[1:] == ["campaign"]:
        sys.stdout.write(json.dumps(campaign()))
        return
    result = {"date": date.today().isoformat(), "repeats": REPEATS, "results": costs()}
    for name, found in result["results"].items():
        sys.stdout.write(
            f"{name:24} {found['cpu_ms']:7.1f} ms, its FFTs {found['ffts_cpu_ms']:6.1f} ms: "
            f"{found['ratio']:.2f} times\n"
        )
    command = [sys.executable, __file__, "campaign"]
    fresh = subprocess.run(command, check=True, capture_output=True, text=True)
    found = result["memory"] = json.loads(fresh.stdout)
    sys.stdout.write(
        f"memory: at most {found['peak_mb']} MB for raw data and three images; "
        f"{found['growth_mb']} MB more after 50 images than after 5\n"
    )
    RESULTS.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
