"""GNSS receiver: position and velocity with Gauss-Markov drift and white noise, as far as the data has either.

Every vehicle's drift is its own (another name, another generator): two vehicles side by side disagree, as receivers
without common corrections do. `eph` and `epv` are what the receiver says of itself, in metres.
"""

import math
from typing import Final

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.simulator_api import HilGps
from sitl_emu.vehicles.description import Gps as GpsData
from sitl_emu.world.noise import GaussMarkov, normals

MIN_SATELLITES: Final = 4
NO_FIX_DOP: Final = 10_000
FIX_3D: Final = 3


class Gps:
    """Makes HIL_GPS; `satellites` may be changed at any time, fewer than four give no fix."""

    def __init__(self, data: GpsData, projection: MapProjection, alt0_amsl_m: float, seed: int, name: str) -> None:
        self._data, self._projection, self._alt0 = data, projection, alt0_amsl_m
        self._draw = normals(seed, name, "gps")
        drift, dt_s, time_s = normals(seed, name, "gps drift"), 1.0 / data.rate_hz, data.drift_time_s
        self._north = GaussMarkov(data.drift_horizontal_m, time_s, dt_s, drift)
        self._east = GaussMarkov(data.drift_horizontal_m, time_s, dt_s, drift)
        self._down = GaussMarkov(data.drift_vertical_m, time_s, dt_s, drift)
        time_s = data.drift_velocity_time_s
        self._vn = GaussMarkov(data.drift_velocity_horizontal_m_s, time_s, dt_s, drift)
        self._ve = GaussMarkov(data.drift_velocity_horizontal_m_s, time_s, dt_s, drift)
        self._vd = GaussMarkov(data.drift_velocity_vertical_m_s, time_s, dt_s, drift)
        self.satellites = data.satellites
        self.offset_m = (0.0, 0.0, 0.0)
        """North, east and down of where the vehicle is: a receiver that is deceived."""

    def read(
        self, time_us: int, north_m: float, east_m: float, down_m: float, vn_m_s: float, ve_m_s: float, vd_m_s: float
    ) -> HilGps:
        """One solution; to be read at the data's rate, which paces the drift."""
        data, draw = self._data, self._draw
        if any(self.offset_m):
            off_north_m, off_east_m, off_down_m = self.offset_m
            north_m, east_m, down_m = north_m + off_north_m, east_m + off_east_m, down_m + off_down_m
        north = north_m + self._north.step() + data.noise_horizontal_m * draw()
        east = east_m + self._east.step() + data.noise_horizontal_m * draw()
        down = down_m + self._down.step() + data.noise_vertical_m * draw()
        lat, lon = self._projection.reproject(north, east)
        vn = vn_m_s + self._vn.step() + data.noise_velocity_m_s * draw()
        ve = ve_m_s + self._ve.step() + data.noise_velocity_m_s * draw()
        vd = vd_m_s + self._vd.step() + data.noise_velocity_m_s * draw()
        fixed = self.satellites >= MIN_SATELLITES
        return HilGps(
            time_us,
            round(lat * 1e7),
            round(lon * 1e7),
            round((self._alt0 - down) * 1e3),
            round(data.eph_m * 100) if fixed else NO_FIX_DOP,
            round(data.epv_m * 100) if fixed else NO_FIX_DOP,
            _within(math.hypot(vn, ve) * 100, 65534),
            _within(vn * 100, 32767),
            _within(ve * 100, 32767),
            _within(vd * 100, 32767),
            round(math.degrees(math.atan2(ve, vn)) % 360.0 * 100) % 36000,
            FIX_3D if fixed else 0,
            self.satellites,
            0,
            0,
        )


def _within(value: float, limit: int) -> int:
    return max(-limit, min(limit, round(value)))
