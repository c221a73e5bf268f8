"""BATTERY_STATUS: the battery in detail (PX4: streams/BATTERY_STATUS.hpp)."""

import math

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink

ID = mavlink.MAVLINK_MSG_ID_BATTERY_STATUS
UNKNOWN_TEMPERATURE = 32767
UNKNOWN_CELL = 65535
CHARGE_STATE = (1, 2, 3, 4)
"""MAV_BATTERY_CHARGE_STATE of battery_status.warning: ok, low, critical, emergency."""
LIPO = 1
FUNCTION_ALL = 1


def fields(now_us: int, context: Context) -> Fields | None:
    """mV, cA, mAh, percent; the first cell carries the whole voltage, as PX4 does when cells are unknown."""
    battery = context.topics.battery_status
    if not battery.connected:
        return None
    current_ca = -1
    if battery.current_a >= 0.0 and math.isfinite(battery.current_a):
        current_ca = min(int(battery.current_a * 100.0), 32767)
    return (
        int(battery.discharged_mah),
        -1,
        UNKNOWN_TEMPERATURE,
        min(int(battery.voltage_v * 1000.0 + 0.5), UNKNOWN_CELL - 1),
        *(UNKNOWN_CELL,) * 9,
        current_ca,
        0,
        FUNCTION_ALL,
        LIPO,
        math.ceil(battery.remaining * 100.0),
        0,
        CHARGE_STATE[battery.warning],
        0,
        0,
        0,
        0,
        0,
        0,
    )
