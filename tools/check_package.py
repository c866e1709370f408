"""Build wheel and sdist, and use them as someone would who has nothing else: ``make dist``.

Each wheel is installed into environments of its own, without the book's lock: with the oldest NumPy
and SciPy that pyproject.toml allows and this Python has wheels of, and with the newest. There the
README's code runs in an empty folder, and so do the commands.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "_build" / "dist"
RESOLUTIONS = {"oldest": "lowest", "newest": "highest"}
COMMANDS = (
    ("--version",),
    ("--help",),
    ("claims",),
    ("claims", "own-map-bits"),
    ("crash-test", "mine:my_filter", "--suite", "correct"),
)
MINE = "from navfilters import FILTERS\nmy_filter = FILTERS['EKF']\n"
TYPED = """
import navfilters
from pathlib import Path
assert Path(navfilters.__file__).with_name("py.typed").is_file()
"""


def readme_code(text: str) -> str:
    """The Python of a README, block after block: one program."""
    return "\n".join(re.findall(r"^```python\n(.*?)^```$", text, re.DOTALL | re.MULTILINE))


def call(*command: object, cwd: Path = ROOT) -> str:
    """What a command prints; its error ends all, with its output."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=clean,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def use(uv: Path, wheel: Path, resolution: str, folder: Path) -> str:
    """Install a wheel into an empty environment and use it; the versions that it got."""
    env, away = folder / "env", folder / "away"
    away.mkdir()
    call(uv, "venv", "--quiet", "--python", sys.executable, env)
    python = env / "bin" / "python"
    call(
        uv, "pip", "install", "--quiet", "--python", python, "--resolution", resolution,
        "--only-binary", "numpy", "--only-binary", "scipy", wheel,
    )  # fmt: skip
    code = readme_code((ROOT / "README.md").read_text(encoding="utf-8"))
    call(python, "-c", code + TYPED, cwd=away)
    (away / "mine.py").write_text(MINE)
    for arguments in COMMANDS:
        call(env / "bin" / "navfilters", *arguments, cwd=away)
    call(python, "-m", "navfilters", "--help", cwd=away)
    return call(uv, "pip", "list", "--python", python, "--format", "freeze").replace("\n", " ")


def main(tools: Path) -> None:
    """Build, check with twine, install and use.

    Parameters
    ----------
    tools : path
        The folder of uv and twine.
    """
    uv = tools / "uv"
    for old in OUT.glob("navfilters-*"):
        old.unlink()
    # The wheel is built from the sdist, with the locked hatchling.
    call(uv, "build", "--out-dir", OUT, "--build-constraints", ROOT / "requirements.txt")
    (wheel,), (sdist,) = OUT.glob("*.whl"), OUT.glob("*.tar.gz")
    call(tools / "twine", "check", "--strict", wheel, sdist)
    for name, resolution in RESOLUTIONS.items():
        with tempfile.TemporaryDirectory() as folder:
            found = use(uv, wheel, resolution, Path(folder))
            sys.stdout.write(f"{name}: {found}\n")
    sys.stdout.write(f"{wheel}\n{sdist}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
