"""The first minute of use: what a shell, a user's folders, half an environment may not change.

The Makefile runs on copies of the checkout whose tools are stubs, unless a test is about these.
"""

import json
import os
import re
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
        ["make", "-C", str(folder), "UV=", *arguments],  # pip, unless a test says otherwise
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


def test_uv_installs_where_there_is_one(checkout):
    stub = script(checkout.parent / "bin/uv", '#!/bin/sh\necho "uv $*"\n')
    os.utime(checkout / "requirements.txt")
    os.utime(checkout / ".venv/.book", (1, 1))
    code, out, err = make(checkout, "-s", ".venv/.test", "UV=uv",
                          PATH=f"{stub.parent}:{os.environ['PATH']}")  # fmt: skip
    assert code == 0, err
    assert re.findall("^uv pip install --python .venv/bin/python .*(-r .*|-e .)$", out, re.M) == [
        "-r requirements.txt",
        "-e .",
        "-r requirements-test.txt",
    ]
    assert "pip install --disable" not in out


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
