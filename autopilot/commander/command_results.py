"""Results of the commands that PX4 v1.18 answers and that change nothing here, or nothing but the answer.

They come from the commander and from modules that PX4's SITL runs beside it (payload, actuator test, camera feedback,
gimbal). None: PX4 sends no ack at all, because somebody else on the network is expected to answer. A command
that is in no table is UNSUPPORTED.
"""

from sitl_emu.core import dialect as mavlink

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
DENIED: int = mavlink.MAV_RESULT_DENIED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED
FAILED: int = mavlink.MAV_RESULT_FAILED
CANCELLED: int = mavlink.MAV_RESULT_CANCELLED

FIXED: dict[int, int | None] = {
    mavlink.MAV_CMD_DO_GO_AROUND: ACCEPTED,  # the navigator's answer; a fixed wing alone goes around
    **dict.fromkeys(
        (
            0,  # VEHICLE_CMD_CUSTOM_0 to CUSTOM_2
            1,
            2,
            mavlink.MAV_CMD_NAV_DELAY,
            203,  # DO_DIGICAM_CONTROL and what follows: for a camera or a gimbal
            204,
            205,
            206,
            214,
            220,
            242,
            243,
            260,
            309,  # ACTUATOR_GROUP_TEST: the control allocator's, where that does not run
            311,
            500,
            521,
            530,
            531,
            532,
            1000,
            1001,
            2003,
            3000,
            30001,
            30002,
            42600,
        ),
        None,
    ),
}
