"""ESTIMATOR_SENSOR_FUSION_STATUS: which sensors the filter uses, and their test ratios (PX4's stream of that name).

Order of the nine sources: GNSS position, optical flow, vision position, magnetometer, airspeed, barometer,
range finder, drag, auxiliary velocity.
"""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESTIMATOR_SENSOR_FUSION_STATUS
ABSENT = math.nan


def fields(now_us: int, context: Context) -> Fields:
    """A source that is not there has ratio NaN and is neither intended nor active."""
    status = context.topics.estimator_status
    gps, baro, mag = int(status.gps_fused), int(status.baro_fused), int(status.mag_fused)
    gps_ratio = max(status.pos_test_ratio, status.vel_test_ratio)
    ratios = (gps_ratio, ABSENT, ABSENT, status.mag_test_ratio, ABSENT, status.hgt_test_ratio, ABSENT, ABSENT, ABSENT)
    return (*ratios, 1, 0, 0, 1, 0, 1, 0, 0, 0, gps, 0, 0, mag, 0, baro, 0, 0, 0)
