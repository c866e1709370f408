"""Filters: moments, variants, rules, and the update that they share."""

from navfilters.estimators.adaptive import AdaptiveNoise
from navfilters.estimators.any_filter import as_filter
from navfilters.estimators.catalogue import FILTERS, LATER_FILTERS
from navfilters.estimators.consider import considering
from navfilters.estimators.converted import expecting_noise
from navfilters.estimators.correction import iterated, once, recalibrated, recursive
from navfilters.estimators.filter import Filter
from navfilters.estimators.gated_inflation import GatedInflation
from navfilters.estimators.interacting import InteractingModels, Modes
from navfilters.estimators.moments import (
    cubature,
    gaussian_second_order,
    linearized,
    second_order,
    second_order_bias,
    unscented,
)
from navfilters.estimators.robust import AdaptiveRobust, Robust, trace_ratio
from navfilters.estimators.rule import Rule
from navfilters.estimators.sigma_points import SigmaPoints, sigma_points
from navfilters.estimators.state import FilterState
from navfilters.estimators.strong_tracking import StrongTracking
from navfilters.estimators.update import kalman_update
from navfilters.estimators.variants import (
    Underweighting,
    bump_circular,
    bump_equivalent,
    bump_linear,
    bump_predicted,
    bump_state,
    expect_at_mean,
    unchanged,
)
from navfilters.estimators.variational_noise import VariationalNoise

__all__ = [
    "FILTERS",
    "LATER_FILTERS",
    "AdaptiveNoise",
    "AdaptiveRobust",
    "Filter",
    "FilterState",
    "GatedInflation",
    "InteractingModels",
    "Modes",
    "Robust",
    "Rule",
    "SigmaPoints",
    "StrongTracking",
    "Underweighting",
    "VariationalNoise",
    "as_filter",
    "bump_circular",
    "bump_equivalent",
    "bump_linear",
    "bump_predicted",
    "bump_state",
    "considering",
    "cubature",
    "expect_at_mean",
    "expecting_noise",
    "gaussian_second_order",
    "iterated",
    "kalman_update",
    "linearized",
    "once",
    "recalibrated",
    "recursive",
    "second_order",
    "second_order_bias",
    "sigma_points",
    "trace_ratio",
    "unchanged",
    "unscented",
]
