"""Xiong, Zhang and Liu (2009): adaptive robust filters through orbit manoeuvres."""

from navfilters.papers.xiong2009.attenuation import (
    attenuation_ratio,
    gamma_limits,
    real_covariance,
    smallest_lambda,
)
from navfilters.papers.xiong2009.cramer_rao import cramer_rao_bound
from navfilters.papers.xiong2009.current_noise import CurrentNoise
from navfilters.papers.xiong2009.error_bounds import (
    Assumptions,
    assumptions,
    contraction,
    lemma_bound,
    theorem_bound,
    theorem_constants,
)
from navfilters.papers.xiong2009.experiment import (
    ARCSECOND,
    ESTIMATORS,
    VARIANTS,
    Estimator,
    Setup,
    together,
)
from navfilters.papers.xiong2009.horizon import one_direction
from navfilters.papers.xiong2009.mismatched import (
    MILD,
    TURN,
    WILD,
    Mismatched,
    Simulation,
    simulate,
)
from navfilters.papers.xiong2009.monte_carlo import (
    errors,
    errors_each_second,
    fly,
    measurements,
    noise,
    position_errors,
    rms_error,
    root_mean_square,
)
from navfilters.papers.xiong2009.other_units import OtherUnits
from navfilters.papers.xiong2009.rivals import (
    AFTER,
    END,
    IN_BURNS,
    RIVALS,
    Course,
    Flight,
    Rival,
    course,
    fly_rival,
    fly_rivals,
    imm,
)
from navfilters.papers.xiong2009.side_by_side import Flown, SideBySide
from navfilters.papers.xiong2009.true_flight import Truth, truth

__all__ = [
    "AFTER",
    "ARCSECOND",
    "END",
    "ESTIMATORS",
    "IN_BURNS",
    "MILD",
    "RIVALS",
    "TURN",
    "VARIANTS",
    "WILD",
    "Assumptions",
    "Course",
    "CurrentNoise",
    "Estimator",
    "Flight",
    "Flown",
    "Mismatched",
    "OtherUnits",
    "Rival",
    "Setup",
    "SideBySide",
    "Simulation",
    "Truth",
    "assumptions",
    "attenuation_ratio",
    "contraction",
    "course",
    "cramer_rao_bound",
    "errors",
    "errors_each_second",
    "fly",
    "fly_rival",
    "fly_rivals",
    "gamma_limits",
    "imm",
    "lemma_bound",
    "measurements",
    "noise",
    "one_direction",
    "position_errors",
    "real_covariance",
    "rms_error",
    "root_mean_square",
    "simulate",
    "smallest_lambda",
    "theorem_bound",
    "theorem_constants",
    "together",
    "truth",
]
