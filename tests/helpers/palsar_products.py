"""Products that are written and opened, and what is said of those that are refused."""

import pytest
from palsar_files import (
    IMAGE,
    LEADER,
    LENGTH,
    NAME,
    product,
)

from navfilters.sar.palsar.opening import open_product

C = 299792458.0


def opened(folder, image=IMAGE, leader=LEADER, **options):
    return open_product(product(folder, image, leader), **options)


def refused(folder, byte, *words, image=IMAGE, leader=LEADER, file="IMG-HH", **options):
    """The message has the file, the byte, what is needed and what was found."""
    product(folder, image, leader)
    with pytest.raises(ValueError) as caught:  # noqa: PT011, its text is looked at here
        open_product(folder, **options)
    message = str(caught.value)
    assert message.startswith(f"{folder / f'{file}-{NAME}'}, byte {byte}: "), message
    assert " must be " in message
    assert "; found " in message
    for word in words:
        assert word in message, message


def of_line(number, offset):
    return 720 + (number - 1) * LENGTH + offset
