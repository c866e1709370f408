"""The first minute of use: what a shell, a user's folders, half an environment may not change.

The Makefile runs on copies of the checkout whose tools are stubs, unless a test is about these.
"""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import textwrap
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SAYS = """\
#!/bin/sh
echo "$(basename "$0") $*"
env | sed "s/^/env: /"
"""
MAKES_VENV = """\
#!/bin/sh
case "$1" in -c) exit {old};; esac
for last; do :; done
echo "venv $*"
rm -rf "$last"; mkdir -p "$last/bin"
printf '#!/bin/sh\\necho "python $*"\\n' > "$last/bin/python"; chmod +x "$last/bin/python"
"""


def script(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


@pytest.fixture(params=["checkout", "my räume (1)"])
def checkout(tmp_path, request):
    """A copy with stubs for tools, ready to be used; also in a folder with an odd name."""
    if sys.platform == "win32" or shutil.which("make") is None:
        pytest.skip("needs make and a POSIX shell")
    folder = tmp_path / request.param
    folder.mkdir()
    shutil.copy(ROOT / "Makefile", folder)
    for name in ("pyproject.toml", "requirements.txt", "requirements-test.txt", "_toc.yml"):
        (folder / name).touch()
    for name in ("python", "pytest", "pip", "ruff", "mypy", "lint-imports", "jupyter-book"):
        script(folder / ".venv/bin" / name, SAYS)
    for name in (".venv/.book", ".venv/.test"):
        (folder / name).touch()
    return folder


def make(folder, *arguments, **environment):
    done = subprocess.run(
        ["make", "-C", str(folder), *arguments],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


HOSTILE = {
    "PYTHONPATH": "/opt/ros/jazzy/lib/python3.12/site-packages",
    "PYTHONHOME": "/opt/other",
    "PYTHONSTARTUP": "/opt/other/start.py",
    "PYTHONOPTIMIZE": "2",
    "PYTHONWARNINGS": "error",
    "PYTHONSAFEPATH": "1",
    "MPLBACKEND": "TkAgg",
    "MATPLOTLIBRC": "/opt/other/matplotlibrc",
    "MPLCONFIGDIR": "/opt/other/matplotlib",
    "IPYTHONDIR": "/opt/other/ipython",
    "JUPYTER_PATH": "/opt/other/jupyter",
    "JUPYTER_DATA_DIR": "/opt/other/jupyter",
    "JUPYTER_CONFIG_DIR": "/opt/other/jupyter",
    "JUPYTER_CONFIG_PATH": "/opt/other/jupyter",
    "PIP_TARGET": "/opt/other/target",
    "PIP_USER": "1",
}


@pytest.mark.parametrize("target", ["unit", "lint", "nbval", "notebooks", "coverage", "campaign"])
def test_the_shells_python_does_not_reach_the_tools(checkout, target):
    code, out, err = make(checkout, "-s", target, **HOSTILE)
    assert code == 0, err
    seen = [line.removeprefix("env: ") for line in out.splitlines() if line.startswith("env: ")]
    values = dict(line.split("=", 1) for line in seen if "=" in line)
    assert len(seen) > 10
    for name, value in HOSTILE.items():
        assert f"{name}={value}" not in seen
    for name in ("JUPYTER_PATH", "JUPYTER_DATA_DIR", "IPYTHONDIR", "MPLCONFIGDIR"):
        assert values[name].startswith(f"{checkout}/.venv/")


def remade(folder, old=0):
    """Run the set-up with a stub for Python; the folders that a venv was made in."""
    stub = script(folder.parent / "bin/python3", MAKES_VENV.format(old=old))
    (folder / "requirements.txt").touch()
    os.utime(folder / ".venv/.book", (1, 1)) if (folder / ".venv/.book").exists() else None
    code, out, err = make(folder, "-s", ".venv/.book", f"PYTHON={stub.name}",
                          PATH=f"{stub.parent}:{os.environ['PATH']}")  # fmt: skip
    return code, [line for line in out.splitlines() if line.startswith("venv ")], out, err


def test_an_environment_that_works_is_kept(checkout):
    code, made, out, _ = remade(checkout)
    assert code == 0
    assert made == []
    assert "python -m pip install" in out


@pytest.mark.parametrize("state", ["none", "no pip", "broken pip", "dangling", "not executable"])
def test_a_half_made_environment_is_made_anew(checkout, state):
    """As an interrupted set-up, a Debian without python3-venv or a new Python leave them."""
    python = checkout / ".venv/bin/python"
    if state == "none":
        shutil.rmtree(checkout / ".venv")
    elif state == "dangling":
        python.unlink()
        python.symlink_to("/opt/other/bin/python3.10")
    elif state == "not executable":
        python.chmod(0o644)
    else:
        script(python, '#!/bin/sh\ncase "$*" in *pip*) exit 1;; esac\n')
        if state == "no pip":
            (checkout / ".venv/bin/pip").unlink()
    code, made, _, err = remade(checkout)
    assert code == 0, err
    assert made == ["venv -m venv --clear .venv"]
    assert (checkout / ".venv/.book").exists()


@pytest.mark.slow
@pytest.mark.parametrize("state", ["whole", "no record", "a file is missing"])
@pytest.mark.parametrize("checkout", ["my räume (1)"], indirect=True)
def test_an_installation_that_was_stopped_is_made_anew(working, state):
    """Or pip would take a package that is there in part for one that is there."""
    pytest.importorskip("pip")
    packages = next((working / ".venv/lib").glob("python3*/site-packages"))
    about = packages / "half-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: half\nVersion: 1.0\n")
    if state != "no record":
        (about / "RECORD").write_text("half-1.0.dist-info/METADATA,,\nhalf.py,,\n")
    if state == "whole":
        (packages / "half.py").touch()
    _, made, _, _ = remade(working)
    assert bool(made) == (state != "whole")


@pytest.mark.parametrize("moved", [False, True])
def test_an_environment_of_another_folder_is_made_anew(checkout, moved):
    """Its library would be another checkout's, and so would be the tools that its scripts start."""
    library = Path("/home/other/book/lib") if moved else checkout / "lib"
    packages = checkout / ".venv/lib/python3.11/site-packages"
    packages.mkdir(parents=True)
    (packages / "_editable_impl_navfilters.pth").write_text(f"{library}\n")
    stub = script(checkout.parent / "bin/python3", MAKES_VENV.format(old=0))
    path = f"{stub.parent}:{os.environ['PATH']}"
    code, out, err = make(checkout, "-s", ".venv/.book", "PYTHON=python3", PATH=path)
    assert code == 0, err
    assert ("venv -m venv --clear .venv" in out) == moved


def test_an_old_python_is_told(checkout):
    shutil.rmtree(checkout / ".venv")
    code, made, _, err = remade(checkout, old=1)
    assert code != 0
    assert made == []
    assert "Python 3.11 or newer is needed, as in: make book PYTHON=python3.13" in err


@pytest.mark.slow
@pytest.mark.parametrize("checkout", ["my räume (1)"], indirect=True)
def test_a_real_environment_without_pip_gets_one(checkout):
    """Stops where the lists, which are empty here, are not enough: pip is there by then."""
    shutil.rmtree(checkout / ".venv")
    venv.create(checkout / ".venv", with_pip=False)
    python = getattr(sys, "_base_executable", sys.executable)
    make(checkout, ".venv/.book", f"PYTHON={python}")
    done = subprocess.run([checkout / ".venv/bin/python", "-m", "pip", "--version"], check=False)
    assert done.returncode == 0


# ---- kernels


NOTEBOOK = """\
import os, sys, matplotlib
from matplotlib import rcParams
print(sys.executable)
print(rcParams["lines.linewidth"], "spoiled" in globals(), sys.flags.optimize)
print([p for p in sys.path if "opt/other" in p], matplotlib.get_backend())
"""
PLAIN = "1.5 False 0\n[] module://matplotlib_inline.backend_inline"


@pytest.fixture
def hostile_home(tmp_path):
    """Kernels named python3 in every folder, start-up files and a style of the user's own."""
    home = tmp_path / "home"
    argv = ["/opt/other/bin/python", "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    spec = {"argv": argv, "display_name": "other", "language": "python"}
    kernels = (".local/share/jupyter", "Library/Jupyter", "extra", "data")
    for folder in kernels:
        place = home / folder / "kernels/python3"
        place.mkdir(parents=True)
        (place / "kernel.json").write_text(json.dumps(spec))
    for start in (".ipython", "ipython"):
        place = home / start / "profile_default/startup"
        place.mkdir(parents=True)
        (place / "00.py").write_text("spoiled = True")
    for style in (".config/matplotlib", "mpl"):
        (home / style).mkdir(parents=True)
        (home / style / "matplotlibrc").write_text("lines.linewidth: 7\n")
    (home / "start.py").write_text("spoiled = True")
    return HOSTILE | {
        "HOME": str(home),
        "XDG_DATA_HOME": str(home / ".local/share"),
        "XDG_CONFIG_HOME": str(home / ".config"),
        "JUPYTER_PATH": str(home / "extra"),
        "JUPYTER_DATA_DIR": str(home / "data"),
        "IPYTHONDIR": str(home / "ipython"),
        "MPLCONFIGDIR": str(home / "mpl"),
        "MATPLOTLIBRC": str(home / "mpl/matplotlibrc"),
        "PYTHONSTARTUP": str(home / "start.py"),
        "MPLBACKEND": "agg",
    }


@pytest.fixture
def working(checkout):
    """A checkout with one notebook, and an environment that has this one's packages."""
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("nbclient")
    shutil.rmtree(checkout / ".venv")
    venv.create(checkout / ".venv", with_pip=False, symlinks=True)
    packages = next((checkout / ".venv/lib").glob("python3*/site-packages"))
    (packages / "here.pth").write_text(sysconfig.get_path("purelib") + "\n")
    for name in ("pytest", "ruff", "jupyter-book"):
        module = {"jupyter-book": "jupyter_book"}.get(name, name)
        text = f'#!/bin/sh\nexec "$(dirname "$0")/python" -m {module} "$@"\n'
        script(checkout / ".venv/bin" / name, text)
    script(checkout / ".venv/bin/ruff", "#!/bin/sh\n")
    for name in (".book", ".test"):
        (checkout / ".venv" / name).touch()
    shutil.copytree(ROOT / "tools", checkout / "tools")
    cell = nbformat.v4.new_code_cell(NOTEBOOK)
    notebook = nbformat.v4.new_notebook(cells=[cell])
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
    (checkout / "book").mkdir()
    nbformat.write(notebook, checkout / "book/one.ipynb")
    return checkout


def said(path):
    nbformat = pytest.importorskip("nbformat")
    return nbformat.read(path, as_version=4).cells[0].outputs[0].text


@pytest.mark.slow
@pytest.mark.parametrize("checkout", ["my räume (1)"], indirect=True)
def test_notebooks_run_in_the_environment_of_the_book(working, hostile_home):
    """In place, as nbval runs them, and for the build."""
    code, out, err = make(working, "notebooks", **hostile_home)
    assert code == 0, out + err
    expected = f"{working}/.venv/bin/python"
    first, rest = said(working / "book/one.ipynb").strip().split("\n", 1)
    assert Path(first).parent == Path(expected).parent
    assert rest == PLAIN

    code, out, err = make(working, "nbval", **hostile_home)  # compares with what was stored
    assert code == 0, out + err

    pytest.importorskip("jupyter_cache")
    probe = textwrap.dedent("""\
        build:
        \t$(BIN)/python tools/execute_notebooks.py
        """)
    (working / "probe.mk").write_text(f"include Makefile\n{probe}")
    code, out, err = make(working, "-f", "probe.mk", "build", **hostile_home)
    assert code == 0, out + err
    (cached,) = (working / "_build/.jupyter_cache/executed").rglob("*.ipynb")
    assert said(cached).strip().split("\n", 1) == [first, rest]


# ---- the library without its extras

EXTRAS = (
    "matplotlib", "mpl_toolkits", "mpmath", "IPython", "jax", "pymap3d", "cv2", "rasterio",
    "joblib", "tqdm", "dask", "distributed",
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
        "navfilters.book.plotting | plotting needs matplotlib: pip install navfilters[book]",
        "navfilters.oracles.later_filters | this oracle needs mpmath: pip install navfilters[book]",
        "navfilters.oracles.perea2007 | this oracle needs mpmath: pip install navfilters[book]",
        "navfilters.oracles.sar_second_order | this oracle needs mpmath: pip install "
        "navfilters[book]",
        "navfilters.oracles.sar_trn | this oracle needs mpmath: pip install navfilters[book]",
        "navfilters.oracles.two_by_two | this oracle needs mpmath: pip install navfilters[book]",
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
