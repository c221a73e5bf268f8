"""GLOBAL_POSITION_SENSOR: where something other than a GNSS receiver sees the vehicle, as a camera over a map does.

Source: https://mavlink.io/en/messages/common.html#GLOBAL_POSITION_SENSOR and PX4's EKF2_AGPn_*: a source that the
parameters do not name is told and not flown by.
"""

from sitl_emu.core import dialect as mavlink

VISION: int = mavlink.GLOBAL_POSITION_SRC_VISION


def global_position_sensor(
    system: int, number: int, lat_deg: float, lon_deg: float, alt_amsl_m: float, eph_m: float, epv_m: float
) -> mavlink.MAVLink_message:
    """`number` is the source's id; accuracies are standard deviations."""
    place = (round(lat_deg * 1e7), round(lon_deg * 1e7), alt_amsl_m, alt_amsl_m)
    return mavlink.MAVLink_global_position_sensor_message(system, 0, number, 0, 0, VISION, 0, *place, eph_m, epv_m)
