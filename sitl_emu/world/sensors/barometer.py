"""Barometer: standard atmosphere, white noise and a slow drift (weather, self-heating). Rotor wash is left out."""

import math
from collections.abc import Callable, Iterator

from sitl_emu.vehicles.description import Barometer as BarometerData
from sitl_emu.world.atmosphere import pressure_altitude_m, pressure_hpa
from sitl_emu.world.noise import GaussMarkov, normals


class Barometer:
    """Reads pressure and pressure altitude; to be read at the data's rate, which paces the drift."""

    def __init__(self, data: BarometerData, seed: int, name: str) -> None:
        draw = normals(seed, name, "barometer")
        self._draw = polar_of_normals(draw) if data.polar_of_normals else draw
        self._noise = 0.01 * data.noise_pa
        drift = normals(seed, name, "barometer drift")
        self._drift = GaussMarkov(0.01 * data.drift_pa, data.drift_time_s, 1.0 / data.rate_hz, drift)
        self._temperature_c = data.temperature_c
        self.offset_pa = 0.0
        """PX4's SIM_BARO_OFF_P."""
        self.temperature_offset_c = 0.0
        """PX4's SIM_BARO_OFF_T."""

    @property
    def temperature_c(self) -> float:
        """What its thermometer says."""
        return self._temperature_c + self.temperature_offset_c

    def read(self, alt_amsl_m: float) -> tuple[float, float]:
        """(pressure in hPa, pressure altitude in m)."""
        pressure = pressure_hpa(alt_amsl_m) + self._drift.step() + self._noise * self._draw() + 0.01 * self.offset_pa
        return pressure, pressure_altitude_m(pressure)


def polar_of_normals(draw: Callable[[], float]) -> Callable[[], float]:
    """SIH's noise: the polar method for normal numbers, fed with normal numbers where it expects even ones.

    SensorBaroSim.cpp draws `2 * generate_wgn() - 1` for both coordinates of a point in the unit circle: what comes of
    it is not centred (mean -0.085, standard deviation 1.009).
    """
    return _polar(draw).__next__


def _polar(draw: Callable[[], float]) -> Iterator[float]:
    while True:
        x, y = 2.0 * draw() - 1.0, 2.0 * draw() - 1.0
        square = x * x + y * y
        if 0.0 < square < 1.0:
            stretch = math.sqrt(-2.0 * math.log(square) / square)
            yield x * stretch
            yield y * stretch
