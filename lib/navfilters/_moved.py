"""Where the modules of version 0.1 went: importing an old name says the new one."""

import sys
from importlib.machinery import ModuleSpec

MOVED = {
    "attitude": "space",
    "bounds": "papers.xiong2009",
    "claims": "book.claims",
    "consistency": "runs.consistency",
    "continuous": "estimators.continuous_system, estimators.continuous, estimators.integration",
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
    "multiplicative": "space.pose, estimators.variants",
    "plotting": "book.plotting",
    "probing": "numerics.probing",
    "robust": "estimators.extended, estimators.robust, estimators.adaptive",
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


class Moved:
    """A finder that finds nothing, and says where it went."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """None; ImportError, naming the new place, for a module of version 0.1."""
        package, _, module = name.partition(".")
        if package == "navfilters" and module in MOVED:
            new = " or ".join(f"navfilters.{place}" for place in MOVED[module].split(", "))
            raise ImportError(f"{name} has moved: since version 0.2 it is {new}")
        return None


def announce() -> None:
    """From now on, importing an old module says where it went."""
    if Moved not in sys.meta_path:
        sys.meta_path.append(Moved)
