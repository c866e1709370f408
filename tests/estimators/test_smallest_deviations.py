"""Where the tolerances of a continuous filter stop following its covariance."""

import numpy as np
from numpy.testing import assert_allclose

from navfilters import Gaussian
from navfilters.estimators.continuous.integration import _smallest_deviations


def test_below_what_deviation_the_tolerances_do_not_follow():
    """Two Euler steps of a 2000th of the time, by hand, for an integrator that noise drives; a
    billionth of a millionth of the prior, where there is one for all.
    """
    A, L = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    t, h, q = np.array([3.0, 5.0]), 2.0 / 2000, 7.0

    def found(variances):
        start = Gaussian(np.zeros(2), np.diag(variances))
        return _smallest_deviations(start, lambda s, x: (0, 0, A, L, 0, 0), np.array([[q]]), t)

    assert_allclose(found([0.0, 0.0]), np.sqrt([h**3 * q, 2 * h * q]), rtol=1e-12)
    assert_allclose(found([4.0, 9.0]), [2e-15, 3e-15], rtol=1e-12)
    known = np.sqrt(4 * h**2 * 9 + h**3 * q)  # the velocity's variance grows into the position
    assert_allclose(found([0.0, 9.0]), [known, 3e-15], rtol=1e-3)
