"""Quantiles of chi-square variables."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.stats import chi2

from navfilters.numerics.chi_square import quantile


@pytest.mark.parametrize("p", [1e-4, 0.025, 0.5, 0.99, 0.99999])
def test_they_are_scipys(p):
    dof = np.array([1, 2, 6, 9, 900, 7.5])
    assert_array_equal(quantile(p, dof), chi2.ppf(p, dof))
    assert quantile(p, 2) == chi2.ppf(p, 2)
