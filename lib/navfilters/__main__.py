"""The command ``navfilters``: what there is, and what each part does."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from navfilters.numerics.extras import command
from navfilters.version import __version__

COMMANDS = {
    "crash-test": ("navfilters.crash.command", "what this book knows, asked of your filter"),
    "diagnose": ("navfilters.diagnosis.report", "test a filter's log of innovations"),
    "cures": ("navfilters.problems.__main__", "every cure on every patient"),
    "perea2007": (
        "navfilters.papers.perea2007.__main__",
        "divergence maps; ten filters with noise",
    ),
    "xiong2009": ("navfilters.papers.xiong2009.__main__", "the flight through two burns"),
    "pogorelsky2020": ("navfilters.papers.pogorelsky2020.__main__", "navigation by radar images"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one of the commands with the rest of the line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.

    Returns
    -------
    int
        The exit status.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters",
        description="Kalman-type filters, and the experiments that they are put through.",
        epilog="\n".join(f"  {name:16}{what}" for name, (_, what) in COMMANDS.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=__version__)
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND", help="one of those below")
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="its own; COMMAND --help says which")
    chosen = parser.parse_args(arguments)
    module = importlib.import_module(COMMANDS[chosen.command][0])
    return module.main(chosen.rest) or 0


def run() -> None:
    """As a command of the shell: what is not installed ends it with one line."""
    command(lambda: sys.exit(main()))


if __name__ == "__main__":
    run()
