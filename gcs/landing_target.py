"""Where a precision landing is to end, as a companion with a camera sees it.

Sources: https://mavlink.io/en/services/landing_target.html and
https://docs.px4.io/v1.18/en/advanced_features/precland.html. PX4 takes a place in its local frame, or the angles of a
beacon under a camera that looks down (its SITL leaves those aside); it forgets a target that is not seen for PLD_BTOUT.
"""

from sitl_emu.core import dialect as mavlink

FRAME_LOCAL_NED = 1
FRAME_BODY_FRD = 12
UNTURNED = (1.0, 0.0, 0.0, 0.0)
VISION_FIDUCIAL, LIGHT_BEACON = 2, 0
"""LANDING_TARGET_TYPE."""


def at_place(time_us: int, north_m: float, east_m: float, down_m: float) -> mavlink.MAVLink_message:
    """A target in the vehicle's local frame."""
    place = (north_m, east_m, down_m)
    return mavlink.MAVLink_landing_target_message(
        time_us, 0, FRAME_LOCAL_NED, 0.0, 0.0, 0.0, 0.0, 0.0, *place, UNTURNED, VISION_FIDUCIAL, 1
    )


def at_angles(time_us: int, angle_x_rad: float, angle_y_rad: float) -> mavlink.MAVLink_message:
    """A beacon: angles ahead and to the right of the axis of a camera that looks down.

    For the landing_target_estimator of a PX4 on hardware: SITL's, which has none, leaves them aside, and so do we.
    """
    return mavlink.MAVLink_landing_target_message(
        time_us, 0, FRAME_BODY_FRD, angle_x_rad, angle_y_rad, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, UNTURNED, LIGHT_BEACON, 0
    )
