"""What a file of a PALSAR product holds: ``python -m navfilters.sar.palsar FILE``."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from navfilters.numerics.extras import command
from navfilters.sar.palsar.contents import contents


def main(arguments: Sequence[str] | None = None) -> None:
    """Print what a file holds: ``python -m navfilters.sar.palsar FILE``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = argparse.ArgumentParser(
        prog="navfilters palsar", description="What an ALOS PALSAR level-1.0 file holds."
    )
    parser.add_argument("file", help="image or leader file")
    try:
        text = contents(Path(parser.parse_args(arguments).file))
    except (ValueError, OSError) as error:
        sys.exit(f"{error}")
    sys.stdout.write(f"{text}\n")


if __name__ == "__main__":
    command(main)
