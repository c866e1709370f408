"""The problems of the book."""

from navfilters.problems.orbit_manoeuvre import orbit
from navfilters.problems.problem import Problem
from navfilters.problems.real_satellite import satellite
from navfilters.problems.sar_images import images
from navfilters.problems.shaken_pendulum import pendulum
from navfilters.problems.static_fix import static_fix


def problems(*, full: bool = False) -> dict[str, Problem]:
    """Every patient by name.

    Parameters
    ----------
    full : bool
        The paper's 1000 updates of the fix, otherwise 200; and the real satellite, which needs
        astropy.

    Returns
    -------
    dict
    """
    fix = 1000 if full else 200
    every = (
        static_fix(False, fix),
        static_fix(True, fix),
        pendulum(),
        orbit("orbit, quiet", burns=False),
        orbit("burns, A", "A"),
        orbit("burns, B", "B"),
        images("images, TC-1", "TC-1"),
        images("images, TC-2", "TC-2"),
        images("three images", "TC-1", 3),
    )
    real = (satellite(),) if full else ()
    return {problem.name: problem for problem in (*every, *real)}
