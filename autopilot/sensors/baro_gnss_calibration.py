"""Makes the barometer's height that of the GNSS receiver on the ground, once after each start.

PX4's VehicleAirData (BaroGNSSAltitudeOffset, with SENS_BAR_AUTOCAL, v1.18): as soon as the estimator takes heights from
the receiver, and the two have differed by about as much at the end of one window as of the next. Each of the receiver's
samples meets the barometer's next mean. A barometer that PX4 simulates itself (SENS_EN_BAROSIM) tells no more often
than VehicleAirData looks by its own 50 ms: where it looks in vain its filter is left without a number, and the
calibration never comes (facts/sihsim_hex/volatile/params: in three starts of four). Here it never does with such a one.
"""

import math

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS, INTERNAL_PRIORITY
from sitl_emu.autopilot.sensors.sensors import altitude_m
from sitl_emu.autopilot.topics import SensorGps, Topics

WINDOW_US, TIME_CONSTANT_S = 2_000_000, 2.0
MOST_EPV_M = 8.0
MOST_CHANGE_M = 4.0
MOST_OFFSET_PA, NEAR_ENOUGH_M, MOST_HALVINGS = 10_000.0, 0.1, 100
LEAST_CHANGE_PA = 0.01
"""Barometer::set_offset."""
HPA_PER_PA = 0.01


class BaroGnssCalibration:
    """Reads vehicle_air_data, sensor_gps and estimator_status_flags, writes CAL_BARO0_*."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._done = bool(parameters["SENS_EN_BAROSIM"])
        self._baro_us = self._gps_us = 0
        self._first_gps_us = self._since_us = 0
        self._alpha = self._difference_m = self._difference_before_m = math.nan

    def update(self) -> None:
        """At 50 Hz."""
        topics, flags = self._topics, self._topics.estimator_status_flags
        if self._done or topics.vehicle_air_data.timestamp == self._baro_us:
            return
        self._baro_us = topics.vehicle_air_data.timestamp
        if flags.cs_in_air or not flags.cs_gps_hgt or not self._parameters["SENS_BAR_AUTOCAL"]:
            return
        gps = topics.sensor_gps
        if gps.timestamp != self._gps_us:
            self._gps_us = gps.timestamp
            self._done = self._is_steady(gps)
            if self._done:
                sea_level_hpa = float(self._parameters["SENS_BARO_QNH"])
                more_pa = offset_pa(topics.vehicle_air_data.baro_pressure_pa, gps.altitude_msl_m, sea_level_hpa)
                if more_pa is not None:
                    save_offset(self._parameters, more_pa)

    def _is_steady(self, gps: SensorGps) -> bool:
        """Whether the two differ by as much as a window before."""
        if not gps.epv <= MOST_EPV_M or self._first_gps_us == 0:
            self._since_us, self._first_gps_us = 0, gps.timestamp
            return False
        difference_m = self._topics.vehicle_air_data.baro_alt_meter - gps.altitude_msl_m
        if self._since_us == 0:
            self._since_us = gps.timestamp
            interval_s = (gps.timestamp - self._first_gps_us) * 1e-6
            self._alpha = interval_s / (TIME_CONSTANT_S + interval_s)
            self._difference_m = difference_m
        else:
            self._difference_m += self._alpha * (difference_m - self._difference_m)
        since_us = gps.timestamp - self._since_us
        if since_us > WINDOW_US and not math.isfinite(self._difference_before_m):
            self._difference_before_m = self._difference_m
        elif since_us > 2 * WINDOW_US:
            if abs(self._difference_m - self._difference_before_m) <= MOST_CHANGE_M:
                return True
            self._difference_before_m = math.nan
            self._since_us = self._first_gps_us = 0
        return False


def save_offset(parameters: Parameters, more_pa: float) -> None:
    """Add to CAL_BARO0_OFF what the barometer measures too much, and make the calibration its own; telling once."""
    values = {"CAL_BARO0_ID": DEVICE_IDS["BARO"], "CAL_BARO0_OFF": float(parameters["CAL_BARO0_OFF"])}
    if parameters["CAL_BARO0_PRIO"] < 0:
        values["CAL_BARO0_PRIO"] = INTERNAL_PRIORITY
    if abs(more_pa) > LEAST_CHANGE_PA:
        values["CAL_BARO0_OFF"] += more_pa
    parameters.set_quietly(values)


def offset_pa(pressure_pa: float, true_alt_m: float, sea_level_hpa: float) -> float | None:
    """How much too high a pressure is for an altitude, by halving, no closer than to 0.1 m; None where too much."""
    low, high = -MOST_OFFSET_PA, MOST_OFFSET_PA
    for _ in range(MOST_HALVINGS):
        middle = low + (high - low) / 2.0
        error_m = altitude_m(HPA_PER_PA * max(pressure_pa - middle, 0.0), sea_level_hpa) - true_alt_m
        if error_m > NEAR_ENOUGH_M:
            high = middle
        elif error_m < -NEAR_ENOUGH_M:
            low = middle
        else:
            return middle
    return None
