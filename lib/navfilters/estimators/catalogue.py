"""The filters by name."""

from navfilters.estimators import variants
from navfilters.estimators.correction import iterated, recalibrated, recursive
from navfilters.estimators.filter import Filter
from navfilters.estimators.moments import (
    cubature,
    gaussian_second_order,
    linearized,
    second_order,
    unscented,
)

FILTERS: dict[str, Filter] = {
    "EKF": Filter(linearized),
    "B-EKF 1": Filter(linearized, variants.bump_linear),
    "B-EKF 2": Filter(linearized, variants.bump_circular),
    "B-EKF 3": Filter(linearized, variants.bump_equivalent),
    "B-EKF 4": Filter(linearized, variants.bump_state),
    "mtSOF": Filter(second_order),
    "B-mtSOF": Filter(second_order, variants.bump_linear),
    "UKF": Filter(unscented),
    "B-UKF": Filter(unscented, variants.bump_predicted),
    "UKFz": Filter(unscented, variants.expect_at_mean),
}
"""The ten filters of perea2007, in its order and by its names, with Joseph's update."""

LATER_FILTERS: dict[str, Filter] = {
    "IEKF": Filter(linearized, correction=iterated),
    "RUF": Filter(linearized, correction=recursive),
    "IPLF": Filter(cubature, correction=iterated),
    "GSOF": Filter(gaussian_second_order),
    "CKF": Filter(cubature),
    "RC-EKF": Filter(linearized, correction=recalibrated),
    "RC-UKF": Filter(unscented, correction=recalibrated),
    "SR-EKF": Filter(linearized, form="sqrt"),
}
"""What other works change in the moments and in the correction: iterated, recursive, posterior
linearisation, Gaussian second order, cubature, recalibrated (two), square root."""
