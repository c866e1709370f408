"""The library without its extras: every module is imported, or says in one line what it needs."""

import os
import subprocess
import sys
import textwrap

import pytest

EXTRAS = (
    "matplotlib", "mpl_toolkits", "mpmath", "IPython", "jax", "pymap3d", "cv2", "rasterio",
    "astropy", "joblib", "tqdm", "dask", "distributed",
)  # fmt: skip
BARE = f"""
import sys
class Bare:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {EXTRAS}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Bare())
"""
START = """
import numpy as np
from navfilters import FILTERS, Gaussian, sweep
from navfilters.models import RangeBearing
model = RangeBearing(np.diag([2.5e-5, 6e-3]))
z = model.h(np.array([100.0, 100.0]))
priors = Gaussian(np.random.default_rng(0).uniform(0, 200, (50, 2)), 1e4 * np.eye(2))
def swept(**options):
    return sweep(FILTERS["EKF"], priors, z, model, steps=3, **options)
"""


def bare(code, *arguments):
    """In an interpreter that has NumPy and SciPy, and nothing else that counts."""
    return subprocess.run(
        [sys.executable, "-c", BARE + textwrap.dedent(code), *arguments],
        capture_output=True,
        text=True,
        env={k: v for k, v in os.environ.items() if not k.startswith("COV")},
        check=False,
    )


MPMATH = "this oracle needs mpmath: pip install navfilters[book]"


def test_every_module_is_imported_or_says_what_it_needs():
    done = bare("""
        import importlib, pkgutil, navfilters
        for module in pkgutil.walk_packages(navfilters.__path__, "navfilters."):
            try:
                importlib.import_module(module.name)
            except ImportError as error:
                print(module.name, "|", error)
        """)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "navfilters.book.figures | plotting needs matplotlib: pip install navfilters[book]",
        "navfilters.book.plotting | plotting needs matplotlib: pip install navfilters[book]",
        f"navfilters.oracles.later_filters | {MPMATH}",
        f"navfilters.oracles.perea2007 | {MPMATH}",
        f"navfilters.oracles.two_by_two | {MPMATH}",
        'navfilters.runs.compiled | engine="jax" needs JAX: pip install navfilters[jax]',
    ]


@pytest.mark.parametrize(
    "options", ["", "progress=True", "workers=1", "record=lambda state: state.estimate"]
)
def test_a_sweep_needs_no_extra(options):
    done = bare(START + f"swept({options}); print('done')")
    assert (done.stdout, done.returncode) == ("done\n", 0), done.stderr
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("call", "line"),
    [
        ("swept(engine='jax')", 'engine="jax" needs JAX: pip install navfilters[jax]'),
        ("swept(workers=2)", "a sweep with workers needs joblib: pip install navfilters[sweep]"),
        (
            "swept(client=object())",
            "a sweep on a cluster needs dask: pip install navfilters[cluster]",
        ),
        (
            "from navfilters.sar.ground.terrain import sample_terrain; sample_terrain(0, 0)",
            "the sample terrain needs matplotlib: pip install navfilters[sar]",
        ),
        (
            "from navfilters.space.frames import ecef_to_geodetic; ecef_to_geodetic([7e6, 0, 0])",
            "geodetic arithmetic needs pymap3d: pip install navfilters[sar]",
        ),
        (
            "from navfilters.sar.matching.matcher import MATCHER; MATCHER.features(np.eye(9))",
            "geolocation needs OpenCV: pip install navfilters[sar]",
        ),
        (
            "from navfilters.sar.ground import LocalMap\n"
            "from navfilters.sar.palsar import read_terrain\n"
            "read_terrain('a.tif', LocalMap(0, 0), 9.0)",
            "a GeoTIFF file needs rasterio: pip install navfilters[palsar]",
        ),
    ],
)
def test_what_needs_an_extra_says_which(call, line):
    done = bare(START + call)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"ImportError: {line}"


COMMANDS = {
    "papers.perea2007": "a picture of the maps needs matplotlib: pip install navfilters[book]",
    "papers.pogorelsky2020": "geodetic arithmetic needs pymap3d: pip install navfilters[sar]",
    "papers.pogorelsky2020 --closed-loop": "geodetic arithmetic needs pymap3d: pip install "
    "navfilters[sar]",
    "papers.pogorelsky2020 --campaign there": "geodetic arithmetic needs pymap3d: pip install "
    "navfilters[sar]",
}
RUN = """
import runpy
name, *sys.argv[1:] = sys.argv[1:]
runpy.run_module(name, run_name="__main__", alter_sys=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_without_its_extra_ends_with_one_line(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = bare(RUN, *f"navfilters.{command}".split())
    assert done.returncode == 1
    assert done.stderr == f"{COMMANDS[command]}\n"
    assert done.stdout == ""


@pytest.mark.slow
def test_commands_that_need_no_extra(tmp_path):
    done = bare(RUN, "navfilters.papers.xiong2009", "--seeds", "1")
    assert done.returncode == 0, done.stderr
    assert "paper" in done.stdout
    done = bare(RUN, "navfilters.sar.palsar", str(tmp_path / "none"))
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"[Errno 2] No such file or directory: '{tmp_path / 'none'}'\n"


def test_an_extra_that_is_broken_is_not_called_missing(tmp_path):
    """A library of the system may lack, as OpenCV's libGL does on a server."""
    (tmp_path / "cv2.py").write_text("raise ImportError('libGL.so.1: cannot open shared object')")
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
         "import numpy as np\nfrom navfilters.sar.matching.matcher import MATCHER\n"
         "MATCHER.features(np.eye(9))"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stderr.splitlines()[-1] == (
        "ImportError: geolocation needs OpenCV, which is installed but not importable: "
        "libGL.so.1: cannot open shared object"
    )
