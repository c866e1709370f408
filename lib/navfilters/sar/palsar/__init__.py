"""PALSAR level-1.0 products, and the GeoTIFF files that go with them."""

from navfilters.sar.palsar.frames import open_frames
from navfilters.sar.palsar.geotiff_reader import median_height, read_reference, read_terrain
from navfilters.sar.palsar.opening import MIDDLE, open_product
from navfilters.sar.palsar.product import Product

__all__ = [
    "MIDDLE",
    "Product",
    "median_height",
    "open_frames",
    "open_product",
    "read_reference",
    "read_terrain",
]
