"""ESTIMATOR_SENSOR_FUSION_STATUS: which sensors the filter is to use, and does (PX4's stream of that name).

In the order of ESTIMATOR_SENSOR_FUSION_SOURCE: GPS, optical flow, external vision, auxiliary global position,
barometer, range finder, magnetometer, airspeed, ranging beacon. Each number is a mask of instances.
"""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESTIMATOR_SENSOR_FUSION_STATUS
SOURCES: Final = 9


def stamp(now_us: int, context: Context) -> int:
    """With every step of the filter (EKF2::Run), as its position; here what is told is looked at less often."""
    return context.topics.vehicle_local_position.timestamp


def fields(now_us: int, context: Context) -> Fields:
    """Intended is what parameters enable and no command has switched off. PX4 tells no test ratios here (NaN)."""
    told = context.topics.estimator_fusion_control
    intended = (
        _mask(told.gps_intended), told.of_intended, told.ev_intended, _mask(told.agp_intended), told.baro_intended,
        told.rng_intended, told.mag_intended, told.aspd_intended, told.rngbcn_intended,
    )  # fmt: skip
    active = (
        _mask(told.gps_active), told.of_active, told.ev_active, _mask(told.agp_active), told.baro_active,
        told.rng_active, told.mag_active, told.aspd_active, told.rngbcn_active,
    )  # fmt: skip
    return (*(math.nan,) * SOURCES, *map(int, intended), *map(int, active))


def _mask(instances: tuple[bool, ...]) -> int:
    return sum(1 << number for number, is_set in enumerate(instances) if is_set)
