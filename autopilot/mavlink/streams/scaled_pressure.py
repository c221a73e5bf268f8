"""SCALED_PRESSURE: barometer (PX4: streams/SCALED_PRESSURE.hpp)."""

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import rounded

ID = mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE


def stamp(now_us: int, context: Context) -> int:
    """Once per sample."""
    return context.topics.sensor_baro.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """HPa and cdegC; there is no differential pressure."""
    baro = context.topics.sensor_baro
    if baro.timestamp == 0:
        return None
    return (baro.timestamp // 1000, baro.pressure_pa * 0.01, 0.0, rounded(baro.temperature_c * 100.0), 0)
