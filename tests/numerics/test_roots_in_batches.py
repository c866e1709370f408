"""Both branches of the square root that compile, on batches of more than one axis."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from navfilters.numerics.matrix_roots import _compiled_root, _plain_root


@pytest.mark.parametrize("root", [_plain_root, _compiled_root])
def test_where_none_is_singular_the_triangle_is_the_identity_of_every_member(root):
    A = np.broadcast_to(np.diag([4.0, 9.0, 16.0]), (5, 2, 3, 3))
    L, T = root(A, np.sqrt(A))
    assert_array_equal(L, np.sqrt(A))
    assert_array_equal(T, np.broadcast_to(np.eye(3), A.shape))
