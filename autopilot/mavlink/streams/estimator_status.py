"""ESTIMATOR_STATUS: test ratios and accuracies of the filter (PX4: streams/ESTIMATOR_STATUS.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS


def stamp(now_us: int, context: Context) -> int:
    """With every step of the filter (EKF2::Run), as its position; here what is told is looked at less often."""
    return context.topics.vehicle_local_position.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """Ratios (1 is the gate, NaN: nothing of the kind aids), metres, ESTIMATOR_STATUS_FLAGS."""
    status = context.topics.estimator_status
    if status.timestamp == 0:
        return None
    return (
        status.timestamp,
        status.vel_test_ratio,
        status.pos_test_ratio,
        status.hgt_test_ratio,
        status.hdg_test_ratio,
        status.hagl_test_ratio,
        status.tas_test_ratio,
        status.pos_horiz_accuracy,
        status.pos_vert_accuracy,
        status.solution_status_flags,
    )
