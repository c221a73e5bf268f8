"""HIL_STATE_QUATERNION: the vehicle's state; PX4's simulation sends its truth, ours what the autopilot estimates."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded, truncated

ID = mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION


def fields(now_us: int, context: Context) -> Fields | None:
    """Truth stays with the simulator, so this is the estimate; cm/s, 1e-7 deg, mm.

    The acceleration is in whole m/s² along north, east and down, as PX4 sends it, though the message means mG.
    """
    topics = context.topics
    position, local = topics.vehicle_global_position, topics.vehicle_local_position
    if not position.valid:
        return None
    return (
        now_us,
        *topics.vehicle_attitude.q,
        *topics.vehicle_angular_velocity.xyz,
        rounded(position.lat * 1e7),
        rounded(position.lon * 1e7),
        rounded(position.alt * 1000.0),
        clamped(local.vx * 100.0),
        clamped(local.vy * 100.0),
        clamped(local.vz * 100.0),
        0,
        0,
        clamped(local.ax),
        clamped(local.ay),
        clamped(local.az),
    )


def clamped(value: float) -> int:
    """Within int16, cut to the whole number as a cast in C++ is."""
    return max(-32768, min(32767, truncated(value)))
