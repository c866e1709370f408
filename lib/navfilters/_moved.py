"""Where the modules of version 0.1 went: importing an old name says the new one."""

import sys
from importlib.machinery import ModuleSpec

MOVED = {
    "attitude": "space",
    "bounds": "papers.xiong2009",
    "claims": "book.claims",
    "consistency": "runs.consistency",
    "continuous": "estimators.continuous",
    "derivatives": "numerics.complex_step, numerics.jacobians",
    "discrete": "estimators.discrete",
    "engine": "runs.loop",
    "experiments": "papers",
    "experiments.divergence_maps": "papers.perea2007",
    "experiments.lecture16": "papers.lecture16",
    "experiments.palsar_loop": "papers.pogorelsky2020",
    "experiments.palsar_patches": "papers.pogorelsky2020",
    "experiments.perea2007": "papers.perea2007",
    "experiments.sar_campaign": "papers.pogorelsky2020",
    "experiments.sar_closed_loop": "papers.pogorelsky2020",
    "experiments.sar_images": "papers.pogorelsky2020",
    "experiments.sar_trn": "papers.pogorelsky2020",
    "experiments.xiong2009": "papers.xiong2009",
    "filters": "estimators.update, estimators.variants, estimators.filter",
    "frames": "space",
    "linalg": "numerics.small_matrices, numerics.matrix_roots",
    "model_checks": "runs.model_checks",
    "models.earth_fixed": "numerics.runge_kutta, space",
    "models.gravity": "space",
    "models.orbit": "space",
    "models.sar_geometry": "space",
    "models.star_earth_sensor": "space",
    "moments": "estimators.moments, estimators.sigma_points",
    "multiplicative": "estimators.variants, space",
    "plotting": "book.plotting",
    "probing": "numerics.probing",
    "robust": "estimators.filter, estimators.robust, estimators.adaptive",
    "sar.autofocus": "sar.images",
    "sar.echo": "sar.raw",
    "sar.focus": "sar.images",
    "sar.geolocate": "sar.matching",
    "sar.geotiff": "sar.palsar",
    "sar.scene": "sar.ground",
    "sweeping": "runs.sweeping",
    "validation": "numerics.validation",
}
"""Old module to new ones, under ``navfilters``."""

GONE = {
    "multiplicative": (
        "mekf_update(state, z, model, underweighting=b) is an update of "
        "Filter(variant=Underweighting(b)) on a SarGeometry"
    ),
    "robust": (
        "RobustEKF(gamma) is Filter(rule=Robust(gamma)), AdaptiveRobustEKF() is "
        'Filter(rule=AdaptiveRobust()), ExtendedKalman() is FILTERS["EKF"]'
    ),
    "discrete": (
        'extended_kalman_filter(system, prior, y, u) is run(FILTERS["EKF"], prior, y, '
        "system.sensor, dynamics=system.dynamics(u), z_per_step=True)"
    ),
}
"""What does the work of an old module's functions that have no successor of their own."""


KEYWORDS = {
    "z_varies": "z_per_step",
    "keep": "record: records.estimate, records.definite or records.Distance(truth)",
    "truth": "record=records.Distance(truth)",
}
"""Old keywords of ``run`` and ``sweep``, and what does their work."""


def refuse_old_keywords(function: str, given: dict[str, object]) -> None:
    """TypeError, saying the new name, for a keyword of version 0.1; or for one that never was."""
    for name in given:
        now = f"; since version 0.2 that is {KEYWORDS[name]}" if name in KEYWORDS else ""
        raise TypeError(f"{function}() got an unexpected keyword argument {name!r}{now}")


class Moved:
    """A finder that finds nothing, and says where it went."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """None; ImportError, naming the new place, for a module of version 0.1."""
        package, _, module = name.partition(".")
        if package == "navfilters" and module in MOVED:
            new = " or ".join(f"navfilters.{place}" for place in MOVED[module].split(", "))
            instead = f"; {GONE[module]}" if module in GONE else ""
            raise ImportError(f"{name} has moved: since version 0.2 it is {new}{instead}")
        return None


def announce() -> None:
    """From now on, importing an old module says where it went."""
    if Moved not in sys.meta_path:
        sys.meta_path.append(Moved)
