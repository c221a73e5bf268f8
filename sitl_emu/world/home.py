"""Where a world lies on Earth; a file of its own, which a launcher imports without the physics."""

from typing import NamedTuple


class Home(NamedTuple):
    """The world's origin: latitude, longitude (deg), altitude AMSL (m); and the heading (deg) vehicles start with."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    heading_deg: float
