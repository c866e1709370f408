"""Divergence maps, or ten filters with noise: ``python -m navfilters.papers.perea2007``."""

import argparse
import io
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from navfilters.numerics.extras import at_least, command, needed
from navfilters.papers.perea2007.divergence_maps import (
    AXES,
    noises,
    over_noises,
    over_starts,
    relative_change,
    starts,
)
from navfilters.papers.perea2007.experiment import FILTERS, Setup
from navfilters.papers.perea2007.noise_table import simulate, table
from navfilters.papers.perea2007.noisy_fix import UPDATES
from navfilters.runs import stored_arrays
from navfilters.runs.progress import bar
from navfilters.types import Array


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute and draw every map, or print how the filters do with noise.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters perea2007", description="Ten filters: divergence maps, or noise."
    )
    parser.add_argument("--size", type=int, default=256, help="points in each direction")
    parser.add_argument("--engine", choices=("numpy", "jax"), default="numpy")
    parser.add_argument("--steps", type=int, default=Setup.steps, help="number of updates")
    parser.add_argument("--out", default="divergence-maps", help="beginning of the files' names")
    parser.add_argument("--noise", type=int, metavar="RUNS", help="so many noisy runs, no maps")
    chosen = parser.parse_args(arguments)
    if chosen.noise is not None:
        at_least(parser, "--noise", chosen.noise, 1)
        _noise(chosen.noise)
        return
    if chosen.size < 2 or chosen.steps < 1:
        parser.error(
            f"--size must be at least 2 and --steps at least 1; found {chosen.size}, {chosen.steps}"
        )
    needed("matplotlib", "navfilters[book]", "a picture of the maps")  # not only after all the work
    options = {"steps": chosen.steps, "engine": chosen.engine, "workers": None, "progress": True}
    found = {}
    for name, estimator in FILTERS.items():
        for label, compute in (("starts", over_starts), ("noises", over_noises)):
            for changed in (False, True):
                key = f"{label}{' changed' * changed}/{name}"
                found[key] = compute(estimator, chosen.size, changed=changed, **options)
        sys.stdout.write(f"{name}: {np.mean(~(found[f'starts/{name}'] <= 0.1)):.1%} above 0.1\n")
    Path(chosen.out).parent.mkdir(parents=True, exist_ok=True)
    content = io.BytesIO()
    np.savez_compressed(content, **{k.replace("/", " "): v for k, v in found.items()})
    stored_arrays.write(Path(f"{chosen.out}.npz"), content.getvalue())
    for path in _draw(found, chosen.size, chosen.out):
        sys.stdout.write(f"{path}\n")


def _noise(runs: int) -> None:
    setup = Setup()
    with bar(runs * len(FILTERS)) as done:
        scores = simulate(runs, setup, done=done)
    for n in UPDATES:
        sys.stdout.write(f"{table(scores, setup, n)}\n\n")


def _draw(found: dict[str, Array], size: int, out: str) -> list[str]:
    """Four pictures: I and its change by the last bit, over the starts and over the noises."""
    import matplotlib.pyplot as plt

    from navfilters.book import plotting

    plotting.use_style()
    setup, points = Setup(), starts(size)
    ratio = (setup.range_variance / setup.bearing_variance) ** 0.5
    planes = {
        "starts": (points[0, :, 0], points[:, 0, 1], setup.x0),
        "noises": (
            *noises(size),
            (setup.sigma, ratio),
        ),
    }
    paths = []
    for label, (x, y, start) in planes.items():
        I = {name: found[f"{label}/{name}"] for name in FILTERS}
        change = {n: relative_change(I[n], found[f"{label} changed/{n}"]) for n in FILTERS}
        for kind, maps, limits, text in (
            ("", I, (1e-6, 1.0), "improvement I"),
            ("-last-bit", change, (1e-15, 1.0), "relative change of I"),
        ):
            figure, axes = plotting.map_panels(
                x, y, maps, text, limits, labels=AXES[label], log=label == "noises"
            )
            for ax in axes:
                ax.plot(*start, "+", color="black")
            paths.append(f"{out}-{label}{kind}.png")
            figure.savefig(paths[-1], dpi=200)
            plt.close(figure)
    return paths


if __name__ == "__main__":
    command(main)
