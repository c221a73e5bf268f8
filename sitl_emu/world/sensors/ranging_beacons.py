"""Radio beacons around home that tell how far away they are, one after the other, as PX4's SIH has them.

PX4: Sih::send_ranging_beacon (src/modules/simulation/simulator_sih/sih.cpp, v1.18): four beacons, a range every half
second, white noise of SIH_RNGBC_NOISE. Here the distance is that in the local plane and in height, as everything is.
"""

import math
from typing import Final

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.simulator_api import RangingBeacon
from sitl_emu.world.noise import normals

RANGING_EVERY_US: Final = 500_000
OFFSETS_M = ((5_000.0, 0.0, 30.0), (0.0, 10_000.0, 0.0), (-20_000.0, -15_000.0, 110.0), (35_000.0, 45_000.0, 310.0))
"""North, east and up of home (sih.hpp)."""
PLACE_ACCURACY_MM: Final = 1_000
"""What SIH's beacons say of their place."""


class RangingBeacons:
    """Makes RANGING_BEACON; `sih_rngbc_noise` (m) is PX4's parameter of this name."""

    def __init__(self, projection: MapProjection, home_alt_m: float, seed: int, name: str) -> None:
        self.sih_rngbc_noise = 30.0
        self._draw = normals(seed, name, "ranging beacons")
        self._beacons = [
            (north, east, up, *projection.reproject(north, east), home_alt_m + up) for north, east, up in OFFSETS_M
        ]
        self._next = 0

    def read(self, time_us: int, north_m: float, east_m: float, down_m: float) -> RangingBeacon:
        """The distance to the beacon whose turn it is; `down_m` from home."""
        beacon_id = self._next
        self._next = (beacon_id + 1) % len(self._beacons)
        north, east, up, lat_deg, lon_deg, alt_m = self._beacons[beacon_id]
        true_m = math.sqrt((north - north_m) ** 2 + (east - east_m) ** 2 + (up + down_m) ** 2)
        noise_m = self.sih_rngbc_noise
        range_m = max(0.0, true_m + noise_m * self._draw()) if noise_m > 0.0 else true_m
        return RangingBeacon(
            time_us,
            round(range_m * 1e3),
            round(lat_deg * 1e7),
            round(lon_deg * 1e7),
            alt_m,
            PLACE_ACCURACY_MM,
            PLACE_ACCURACY_MM,
            round(max(noise_m, 0.0) * 1e3),
            beacon_id,
        )
