"""Monte Carlo: ``python -m navfilters.papers.pogorelsky2020 --case TC-1``; ``--help`` for more."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from navfilters.numerics.extras import command
from navfilters.papers.pogorelsky2020.antenna_tables import antenna_table
from navfilters.papers.pogorelsky2020.campaign import campaign_report, run_campaign
from navfilters.papers.pogorelsky2020.closed_loop import closed_table
from navfilters.papers.pogorelsky2020.experiment import CASES
from navfilters.papers.pogorelsky2020.open_loop import open_table
from navfilters.papers.pogorelsky2020.own_images import own_report, own_tables
from navfilters.papers.pogorelsky2020.own_store import write_own
from navfilters.papers.pogorelsky2020.real_loop import report
from navfilters.runs.progress import progress as progress_bar


def _parser(description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="navfilters pogorelsky2020", description=description)
    parser.add_argument("--case", choices=sorted(CASES), default="TC-1", help="test case")
    parser.add_argument("--runs", type=int, help="number of runs; 100 by default")
    parser.add_argument("--seed", type=int, default=0, help="seed of all runs")
    return parser


def _add_campaign(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("all images of the closed loop, in both cases")
    group.add_argument("--campaign", metavar="FOLDER", help="where finished parts are kept")
    group.add_argument("--direct", type=int, help="runs made without tables as well; 10 by default")


def _add_product(parser: argparse.ArgumentParser) -> None:
    """What says where the product is and how to read it; None where it is not given."""
    group = parser.add_argument_group("the closed loop on an ALOS PALSAR level-1.0 product")
    group.add_argument(
        "--palsar",
        metavar="FOLDER",
        nargs="+",
        help="with IMG-... and LED-...: consecutive frames of one pass, there or in several "
        "folders, are joined; 1 run by default",
    )
    group.add_argument("--dem", metavar="FILE", help="GeoTIFF of heights, m")
    group.add_argument(
        "--reference", metavar="FILE", help="GeoTIFF of a geocoded, terrain-corrected SAR image"
    )
    group.add_argument(
        "--reference-unit",
        choices=["dB", "linear"],
        help="of that image, where neither its band nor its pixels tell",
    )
    group.add_argument(
        "--geoid",
        metavar="METRES",
        type=float,
        help="added to the heights (0 by default). Positions are reckoned above the WGS-84 "
        "ellipsoid; most elevation models count from sea level, which lies up to 107 m below and "
        "86 m above it: an error of that size in height is one of the same order in position",
    )
    group.add_argument("--polarisation", choices=["HH", "HV", "VH", "VV"], help="which of several")
    group.add_argument(
        "--records",
        metavar=("FIRST", "LAST"),
        type=int,
        nargs=2,
        help="only these signal records, from 0, half-open: where the pulse rate changes",
    )
    group.add_argument(
        "--clock-offset", metavar="SECONDS", type=float, help="added to the times of the lines"
    )


def _counted(
    parser: argparse.ArgumentParser, chosen: argparse.Namespace, least: int, runs: int
) -> None:
    """End the program unless runs, by default so many, and seed are large enough."""
    chosen.runs = runs if chosen.runs is None else chosen.runs
    if chosen.runs < least or chosen.seed < 0:
        parser.error(
            f"--runs must be at least {least} and --seed at least 0; found {chosen.runs}, "
            f"{chosen.seed}"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """The open loop; the closed loop, also with own images or all of it; or that on a product.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line by default.
    """
    parser = _parser("Monte Carlo of Pogorelsky et al.: open-loop, closed-loop, or on real data.")
    parser.add_argument(
        "--closed-loop", action="store_true", help="form and match images instead of drawing errors"
    )
    parser.add_argument(
        "--without-antenna",
        action="store_true",
        help="open-loop, with the plane of zero Doppler, with other errors, and with cures",
    )
    parser.add_argument(
        "--own-images",
        action="store_true",
        help="both cases in closed loop, each run with images that it shares with no other",
    )
    parser.add_argument(
        "--out", metavar="FILE", help="with --own-images: where what the images gave is stored"
    )
    _add_campaign(parser)
    _add_product(parser)
    chosen = parser.parse_args(arguments)
    options = (
        "dem",
        "reference",
        "reference_unit",
        "geoid",
        "polarisation",
        "records",
        "clock_offset",
    )
    given = [name for name in options if getattr(chosen, name) is not None]
    if chosen.palsar is None and given:
        parser.error(f"--{given[0].replace('_', '-')} must come with --palsar")
    if chosen.direct is not None and chosen.campaign is None:
        parser.error("--direct must come with --campaign")
    if chosen.out is not None and not chosen.own_images:
        parser.error("--out must come with --own-images")
    if chosen.out is not None and not Path(chosen.out).parent.is_dir():
        parser.error(f"--out must be in a folder that exists; found {chosen.out}")
    if chosen.palsar is not None:
        needed = ("closed_loop", "dem", "reference")
        if absent := [name.replace("_", "-") for name in needed if not getattr(chosen, name)]:
            parser.error(f"--palsar must come with --{', --'.join(absent)}")
        _counted(parser, chosen, least=1, runs=1)
        sys.stdout.write(f"{_on_product(chosen)}\n")
        return
    _counted(parser, chosen, least=2, runs=100)
    if chosen.own_images:
        found = own_tables(chosen.runs)
        if chosen.out is not None:
            write_own(chosen.out, found)
        sys.stdout.write(f"{own_report(found, chosen.runs, chosen.seed)}\n")
        return
    if chosen.campaign is not None:
        sys.stdout.write(_campaign(parser, chosen))
        return
    table, seconds = (closed_table, 25) if chosen.closed_loop else (open_table, 600)
    if chosen.without_antenna:
        if chosen.closed_loop:
            parser.error("--without-antenna is open-loop; found --closed-loop too")
        table = antenna_table
    text = table(chosen.case, chosen.runs, chosen.seed, progress=progress_bar)
    about = f"{chosen.case}, {chosen.runs} runs, 1-sigma position at {seconds} s"
    sys.stdout.write(f"{about}\n{text}\n")


def _campaign(parser: argparse.ArgumentParser, chosen: argparse.Namespace) -> str:
    """The report of a campaign, which goes on where it was stopped."""
    direct = 10 if chosen.direct is None else chosen.direct
    try:
        found = run_campaign(chosen.campaign, chosen.runs, direct, chosen.seed)
    except (ValueError, OSError) as error:
        parser.error(str(error))
    except KeyboardInterrupt:
        sys.exit("stopped; the same command goes on where it was")
    return campaign_report(found)


def _on_product(chosen: argparse.Namespace) -> str:
    """The table of a product; what is wrong with its files ends the program with a message."""
    try:
        return report(
            chosen.palsar,
            chosen.dem,
            chosen.reference,
            chosen.case,
            chosen.runs,
            chosen.seed,
            geoid=chosen.geoid or 0.0,
            unit=chosen.reference_unit,
            polarisation=chosen.polarisation,
            records=chosen.records,
            clock_offset=chosen.clock_offset or 0.0,
            progress=progress_bar,
        )
    except (ValueError, OSError, ImportError) as error:
        sys.exit(f"{error}")


if __name__ == "__main__":
    command(main)
