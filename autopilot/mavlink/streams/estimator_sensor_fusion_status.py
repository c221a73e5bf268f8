"""ESTIMATOR_SENSOR_FUSION_STATUS: which sensors the filter is to use, and does (PX4's stream of that name).

In the order of ESTIMATOR_SENSOR_FUSION_SOURCE: GPS, optical flow, external vision, auxiliary global position,
barometer, range finder, magnetometer, airspeed, ranging beacon. Each number is a mask of instances. The range finder
tells the height of the ground, not of the vehicle, so that it is never active.
"""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESTIMATOR_SENSOR_FUSION_STATUS
SOURCES = 9
AUXILIARY_POSITION = 3
AUXILIARY_POSITIONS = tuple(f"EKF2_AGP{number}_CTRL" for number in range(4))
ENABLE_BITS = (0, 2, 3, 4, 8, 9, 10, 11, 12)
"""First bit of each source in EKF2_SENS_EN: there may be two GPS and four auxiliary positions."""
MAG_TYPE_NONE = 5


def fields(now_us: int, context: Context) -> Fields:
    """Intended is what parameters enable and no command has switched off. PX4 tells no test ratios here (NaN)."""
    status = context.topics.estimator_status
    active = [0] * SOURCES
    active[0], active[1], active[2] = int(status.gps_fused), int(status.flow_fused), int(status.vision_fused)
    active[4], active[6] = int(status.baro_fused), int(status.mag_fused)
    intended = [0 if source in status.disabled else mask for source, mask in enumerate(_enabled(context))]
    return (*(math.nan,) * SOURCES, *intended, *active)


def _enabled(context: Context) -> list[int]:
    """Masks of instances by the parameters."""
    parameters = context.parameters
    auxiliary = sum(1 << number for number, name in enumerate(AUXILIARY_POSITIONS) if parameters[name])
    controlled = [
        int(bool(parameters["EKF2_GPS_CTRL"])),
        int(bool(parameters["EKF2_OF_CTRL"])),
        int(bool(parameters["EKF2_EV_CTRL"])),
        auxiliary,
        int(bool(parameters["EKF2_BARO_CTRL"])),
        int(bool(parameters["EKF2_RNG_CTRL"])),
        int(parameters["EKF2_MAG_TYPE"] != MAG_TYPE_NONE),
        int(parameters["EKF2_ARSP_THR"] > 0.0),
        int(bool(parameters["EKF2_RNGBC_CTRL"])),
    ]
    bits = int(parameters["EKF2_SENS_EN"])
    return [mask & bits >> first for mask, first in zip(controlled, ENABLE_BITS, strict=True)]
