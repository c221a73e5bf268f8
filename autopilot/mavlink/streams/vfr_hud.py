"""VFR_HUD: speeds, heading, throttle, altitude AMSL and climb (PX4: streams/VFR_HUD.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_VFR_HUD


def stamp(now_us: int, context: Context) -> int:
    """Each message has a new position in the local frame."""
    return context.topics.vehicle_local_position.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """m/s, degrees 0..359, percent; no sensor measures an airspeed (NaN).

    The altitude is the filter's where it knows the globe, else the barometer's.
    """
    topics = context.topics
    local = topics.vehicle_local_position
    if local.timestamp == 0:
        return None
    throttle_pct = 0
    if topics.actuator_armed.armed:
        x, y, z = topics.vehicle_thrust_setpoint.xyz
        thrust = math.sqrt(x * x + y * y + z * z)
        throttle_pct = truncated(100.0 * min(thrust, 1.0)) if thrust == thrust else 0
    altitude_m = local.ref_alt - local.z if local.z_valid else math.nan
    if not math.isfinite(altitude_m):
        altitude_m = topics.vehicle_air_data.baro_alt_meter if topics.vehicle_air_data.timestamp else 0.0
    return (
        math.nan,
        math.hypot(local.vx, local.vy),
        altitude_m if math.isfinite(altitude_m) else 0.0,
        -local.vz if local.v_z_valid else 0.0,
        truncated(math.degrees(local.heading) % 360.0) % 360,
        throttle_pct,
    )
