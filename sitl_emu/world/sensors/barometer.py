"""Barometer: standard atmosphere, white noise and a slow drift (weather, self-heating). Rotor wash is left out."""

import math
from collections.abc import Callable, Iterator
from typing import Final

from sitl_emu.vehicles.description import Barometer as BarometerData
from sitl_emu.world.atmosphere import LAPSE_K_M, SEA_LEVEL_HPA, pressure_altitude_m, pressure_hpa
from sitl_emu.world.noise import GaussMarkov, normals

SIH_SEA_LEVEL_K: Final = 288.0
SIH_EXPONENT: Final = 5.256
SIH_ICE_K: Final = 273.0
"""The air of PX4's SensorBaroSim (Run): who takes it for the standard's, reads 0.3 m too much in 490 m."""


class Barometer:
    """Reads pressure and pressure altitude; to be read at the data's rate, which paces the drift."""

    def __init__(self, data: BarometerData, seed: int, name: str) -> None:
        draw = normals(seed, name, "barometer")
        self._draw = polar_of_normals(draw) if data.is_px4s else draw
        self._noise = 0.01 * data.noise_pa
        drift = normals(seed, name, "barometer drift")
        self._drift = GaussMarkov(0.01 * data.drift_pa, data.drift_time_s, 1.0 / data.rate_hz, drift)
        self._is_px4s = data.is_px4s
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
        if self._is_px4s:
            true_hpa, self._temperature_c = sih_air(alt_amsl_m)
        else:
            true_hpa = pressure_hpa(alt_amsl_m)
        pressure = true_hpa + self._drift.step() + self._noise * self._draw() + 0.01 * self.offset_pa
        return pressure, pressure_altitude_m(pressure)


def sih_air(alt_amsl_m: float) -> tuple[float, float]:
    """Pressure (hPa) and temperature (°C) of SIH's air at an altitude."""
    kelvin = SIH_SEA_LEVEL_K - LAPSE_K_M * alt_amsl_m
    return SEA_LEVEL_HPA * (kelvin / SIH_SEA_LEVEL_K) ** SIH_EXPONENT, kelvin - SIH_ICE_K


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
