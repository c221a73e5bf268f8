"""HIL_STATE_QUATERNION: what the simulator says is true (PX4: streams/HIL_STATE_QUATERNION.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded, truncated

ID = mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION


def stamp(now_us: int, context: Context) -> int:
    """PX4's own simulation tells the truth with every sample of the gyro; ours with every third."""
    return context.topics.groundtruth.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """cm/s, 1e-7 deg, mm; no time. None of a simulator that tells no truth.

    The acceleration is in whole m/s² along north, east and down, as PX4 sends it, though the message means mG.
    """
    truth = context.topics.groundtruth
    if not truth.timestamp:
        return None
    return (
        0,
        *truth.q,
        *truth.xyz,
        rounded(truth.lat * 1e7),
        rounded(truth.lon * 1e7),
        rounded(truth.alt * 1e3),
        *(clamped(rounded(speed * 100.0)) for speed in (truth.vx, truth.vy, truth.vz)),
        0,
        0,
        *(clamped(truncated(acceleration)) for acceleration in (truth.ax, truth.ay, truth.az)),
    )


def clamped(value: int) -> int:
    """Within int16."""
    return max(-32768, min(32767, value))
