"""HOME_POSITION: home, global and local (PX4: streams/HOME_POSITION.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.c_types import product, truncated

ID = mavlink.MAVLINK_MSG_ID_HOME_POSITION


def fields(now_us: int, context: Context) -> Fields | None:
    """1e-7 deg, mm AMSL, m NED; q is home's attitude; nothing until home is set."""
    home = context.topics.home_position
    if not home.valid:
        return None
    return (
        truncated(home.lat * 1e7),
        truncated(home.lon * 1e7),
        truncated(product(home.alt, 1000.0)),
        *((home.x, home.y, home.z) if home.valid_lpos else (0.0, 0.0, 0.0)),
        *quaternion(home.roll, home.pitch, home.yaw),
        0.0,
        0.0,
        0.0,
        home.timestamp,
    )
