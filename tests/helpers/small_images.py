"""Images of the closed loop that take a second instead of half a minute."""

from navfilters.papers.pogorelsky2020.imaging import Imaging
from navfilters.sar.raw.radar import Radar

# a quarter of PALSAR's wavelength has a quarter of its sensitivity to velocity
SMALL = Imaging(
    radar=Radar(wavelength=0.059, pulse_length=4e-6),
    lines=768,
    samples=256,
    half_width=1600.0,
    steps=(16.0, 4.0),
    near=4.0,
    reach=40.0,
)
