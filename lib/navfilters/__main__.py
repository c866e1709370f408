"""The command ``navfilters``: what there is, and what each part does."""

import argparse
import importlib
import sys
from collections.abc import Sequence

from navfilters.numerics.extras import command
from navfilters.version import __version__

GROUPS = {
    "a filter of yours": {
        "crash-test": ("navfilters.crash.command", "what this book knows, asked of your filter"),
        "diagnose": ("navfilters.diagnosis.report", "test a filter's log of innovations"),
    },
    "the papers": {
        "perea2007": (
            "navfilters.papers.perea2007.__main__",
            "divergence maps; ten filters with noise",
        ),
        "lecture16": ("navfilters.papers.lecture16.__main__", "three filters on a pendulum"),
        "xiong2009": ("navfilters.papers.xiong2009.__main__", "the flight through two burns"),
        "pogorelsky2020": (
            "navfilters.papers.pogorelsky2020.__main__",
            "navigation by radar images",
        ),
        "claims": ("navfilters.book.claims.command", "what they claim, and whether it held"),
    },
    "the book's experiments": {
        "cures": ("navfilters.problems.__main__", "every cure on every patient"),
        "w3b": ("navfilters.tracking.__main__", "all filters on a satellite that leaked"),
        "palsar": ("navfilters.sar.palsar.__main__", "what a file of radar data holds"),
    },
}
COMMANDS = {name: entry for group in GROUPS.values() for name, entry in group.items()}


def _listed() -> str:
    """The commands as the help shows them."""
    lines = []
    for title, group in GROUPS.items():
        lines += [f"{title}:", *(f"  {name:16}{what}" for name, (_, what) in group.items()), ""]
    lines.append(
        "COMMAND --help says what one takes. Exit status: 0; 1 where a filter or a log fails"
    )
    return "\n".join(
        [*lines, "its tests, or something is not installed; 2 for what is no command."]
    )


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
        epilog=_listed(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=__version__)
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND", help="one of those below")
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="what that command takes")
    chosen = parser.parse_args(arguments)
    module = importlib.import_module(COMMANDS[chosen.command][0])
    return module.main(chosen.rest) or 0


def run() -> None:
    """As a command of the shell: what is not installed ends it with one line."""
    command(lambda: sys.exit(main()))


if __name__ == "__main__":
    run()
