"""ESTIMATOR_STATUS: test ratios and accuracies of the filter (PX4: streams/ESTIMATOR_STATUS.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS
ATTITUDE = 1
VELOCITY_HORIZ = 2
VELOCITY_VERT = 4
POS_HORIZ_REL = 8
POS_HORIZ_ABS = 16
POS_VERT_ABS = 32
POS_VERT_AGL = 64
CONST_POS_MODE = 128
PRED_POS_HORIZ_REL = 256
PRED_POS_HORIZ_ABS = 512
GPS_GLITCH = 1024
"""ESTIMATOR_STATUS_FLAGS."""


def fields(now_us: int, context: Context) -> Fields | None:
    """Ratios (1 is the gate), metres. A vehicle that stands is held in its place (CONST_POS_MODE), with GPS as well."""
    status = context.topics.estimator_status
    if status.timestamp == 0:
        return None
    local = context.topics.vehicle_local_position
    flags = ATTITUDE if status.tilt_aligned and status.yaw_aligned else 0
    flags |= VELOCITY_HORIZ if local.v_xy_valid else 0
    flags |= VELOCITY_VERT if local.v_z_valid else 0
    flags |= POS_HORIZ_REL if local.xy_valid else 0
    flags |= POS_HORIZ_ABS if context.topics.vehicle_global_position.valid else 0
    flags |= CONST_POS_MODE if context.topics.vehicle_land_detected.landed or not local.xy_valid else 0
    flags |= PRED_POS_HORIZ_REL if status.gps_fused or status.flow_fused or status.vision_fused else 0
    flags |= PRED_POS_HORIZ_ABS if status.gps_fused else 0
    flags |= GPS_GLITCH if max(status.vel_test_ratio, status.pos_test_ratio) > 1.0 else 0
    flags |= POS_VERT_ABS if local.z_valid else 0
    flags |= POS_VERT_AGL if local.dist_bottom_valid else 0
    return (
        status.timestamp,
        status.vel_test_ratio,
        status.pos_test_ratio,
        status.hgt_test_ratio,
        status.mag_test_ratio,
        0.0,
        0.0,
        local.eph,
        local.epv,
        flags,
    )
