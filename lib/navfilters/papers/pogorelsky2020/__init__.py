"""Pogorelsky et al. (2020): navigation by SAR images of known terrain."""

from navfilters.papers.pogorelsky2020.acquisition import acquire, measure_directly
from navfilters.papers.pogorelsky2020.antenna_tables import antenna_table
from navfilters.papers.pogorelsky2020.campaign import (
    ACQUIRING,
    CLIMBING,
    Agreement,
    Campaign,
    campaign_report,
    run_campaign,
)
from navfilters.papers.pogorelsky2020.campaign_store import Folder, Formed
from navfilters.papers.pogorelsky2020.closed_loop import (
    UPDATES,
    Attempt,
    Images,
    closed_table,
    monte_carlo_closed,
    summary,
)
from navfilters.papers.pogorelsky2020.different_images import DifferentImages
from navfilters.papers.pogorelsky2020.experiment import (
    CASES,
    NOMINAL,
    PAPER,
    Setup,
    of_case,
)
from navfilters.papers.pogorelsky2020.final_nees import final_nees, nees_line, nees_summary
from navfilters.papers.pogorelsky2020.image_blocks import (
    BlockCurves,
    BlockMatches,
    BlockPlace,
    block_curves,
    block_tables,
    cut_blocks,
    match_blocks,
)
from navfilters.papers.pogorelsky2020.image_tables import (
    ImageTable,
    assumed_speeds,
    image_table,
    tabulate,
)
from navfilters.papers.pogorelsky2020.imaging import (
    FULL,
    OF_THE_FILTER,
    Acquisition,
    Imaging,
    same_images,
)
from navfilters.papers.pogorelsky2020.linearised import (
    Altered,
    Leg,
    Seen,
    linearised_flight,
)
from navfilters.papers.pogorelsky2020.noise_draws import Noise, misalignment, noise
from navfilters.papers.pogorelsky2020.open_loop import (
    MonteCarlo,
    SimulatedImages,
    monte_carlo,
    open_table,
    simulate_images,
)
from navfilters.papers.pogorelsky2020.own_images import (
    OFFSETS,
    SHORT_PULSE,
    WHOLE,
    OwnImages,
    Sighting,
    fly_own_images,
    look_at,
    measured_sigma,
    own_report,
    own_tables,
)
from navfilters.papers.pogorelsky2020.own_store import read_own, write_own
from navfilters.papers.pogorelsky2020.pixel_errors import (
    image_axes,
    pixel_covariance,
    terrain_normal,
)
from navfilters.papers.pogorelsky2020.real_flight import (
    MISSING,
    first_lines,
    fitted,
    flight_through,
    lines_between,
)
from navfilters.papers.pogorelsky2020.real_images import RealAttempt, RealImages
from navfilters.papers.pogorelsky2020.real_loop import (
    Outcome,
    real_table,
    report,
    run_filter,
    true_flight,
)
from navfilters.papers.pogorelsky2020.real_patches import MARGIN, Patch, cut_patches
from navfilters.papers.pogorelsky2020.timed_images import (
    TimedImages,
    sweep_speed,
    white_errors,
    with_pointing_noise,
)
from navfilters.papers.pogorelsky2020.true_flight import Truth, initial_state, truth
from navfilters.papers.pogorelsky2020.without_antenna import (
    ARCSECOND,
    Trial,
    fly,
    fly_with_offsets,
)

__all__ = [
    "ACQUIRING",
    "ARCSECOND",
    "CASES",
    "CLIMBING",
    "FULL",
    "MARGIN",
    "MISSING",
    "NOMINAL",
    "OFFSETS",
    "OF_THE_FILTER",
    "PAPER",
    "SHORT_PULSE",
    "UPDATES",
    "WHOLE",
    "Acquisition",
    "Agreement",
    "Altered",
    "Attempt",
    "BlockCurves",
    "BlockMatches",
    "BlockPlace",
    "Campaign",
    "DifferentImages",
    "Folder",
    "Formed",
    "ImageTable",
    "Images",
    "Imaging",
    "Leg",
    "MonteCarlo",
    "Noise",
    "Outcome",
    "OwnImages",
    "Patch",
    "RealAttempt",
    "RealImages",
    "Seen",
    "Setup",
    "Sighting",
    "SimulatedImages",
    "TimedImages",
    "Trial",
    "Truth",
    "acquire",
    "antenna_table",
    "assumed_speeds",
    "block_curves",
    "block_tables",
    "campaign_report",
    "closed_table",
    "cut_blocks",
    "cut_patches",
    "final_nees",
    "first_lines",
    "fitted",
    "flight_through",
    "fly",
    "fly_own_images",
    "fly_with_offsets",
    "image_axes",
    "image_table",
    "initial_state",
    "linearised_flight",
    "lines_between",
    "look_at",
    "match_blocks",
    "measure_directly",
    "measured_sigma",
    "misalignment",
    "monte_carlo",
    "monte_carlo_closed",
    "nees_line",
    "nees_summary",
    "noise",
    "of_case",
    "open_table",
    "own_report",
    "own_tables",
    "pixel_covariance",
    "read_own",
    "real_table",
    "report",
    "run_campaign",
    "run_filter",
    "same_images",
    "simulate_images",
    "summary",
    "sweep_speed",
    "tabulate",
    "terrain_normal",
    "true_flight",
    "truth",
    "white_errors",
    "with_pointing_noise",
    "write_own",
]
