"""BATTERY_STATUS: the batteries in detail, each in a message (PX4: streams/BATTERY_STATUS.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import BatteryStatus, batteries
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_BATTERY_STATUS
UNKNOWN_TEMPERATURE: Final = 32767
UNKNOWN_CELL: Final = 65535
UNSUPPORTED: Final = 0
CELLS: Final = 10
CHARGE_STATE = (1, 2, 3, 4)
"""MAV_BATTERY_CHARGE_STATE of battery_status.warning: ok, low, critical, emergency."""
LIPO: Final = 1
FUNCTION_ALL: Final = 1


def fields(now_us: int, context: Context) -> list[Fields]:
    """mV, cA, mAh, percent, 0.01 degC."""
    return [_message(battery) for battery in batteries(context.topics)]


def _message(battery: BatteryStatus) -> Fields:
    """The first cell carries the whole voltage, as PX4 does when cells are unknown."""
    current_ca = -1
    if battery.current_a >= 0.0 and math.isfinite(battery.current_a):
        current_ca = min(truncated(battery.current_a * 100.0), 32767)
    temperature = (
        truncated(battery.temperature_c * 100.0) if math.isfinite(battery.temperature_c) else UNKNOWN_TEMPERATURE
    )
    left_s = max(truncated(battery.time_remaining_s), 1) if math.isfinite(battery.time_remaining_s) else UNSUPPORTED
    cells_v = battery.cells_v if any(battery.cells_v) else (battery.voltage_v,)
    return (
        truncated(battery.discharged_mah),
        -1,
        temperature,
        *(min(truncated(volts * 1000.0 + 0.5), UNKNOWN_CELL - 1) for volts in cells_v),
        *(UNKNOWN_CELL,) * (CELLS - len(cells_v)),
        current_ca,
        0,
        FUNCTION_ALL,
        LIPO,
        truncated(battery.remaining * 100.0 + 0.5),
        left_s,
        CHARGE_STATE[battery.warning],
        0,
        0,
        0,
        0,
        0,
        0,
    )
