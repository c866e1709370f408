"""Numbers as the pages print them."""

import pytest

from navfilters.book.printing import three_digits


@pytest.mark.parametrize(
    ("x", "text"), [(2006.4, "2,010"), (28834567.0, "28,800,000"), (54.6, "55")]
)
def test_three_significant_digits(x, text):
    assert three_digits(x) == text
