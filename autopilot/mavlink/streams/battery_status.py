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
UNKNOWN_ID: Final = 255
"""Of a battery whose id is 0: PX4 takes 1 off in a byte."""
CHARGE_STATE = (1, 2, 3, 4)
"""MAV_BATTERY_CHARGE_STATE of battery_status.warning: ok, low, critical, emergency."""
LIPO: Final = 1
UNKNOWN: Final = -1.0
"""Charge and current of a battery that does not know them."""
FUNCTION_ALL: Final = 1


def fields(now_us: int, context: Context) -> list[Fields]:
    """mV, cA, mAh, percent, 0.01 degC."""
    return [_message(battery) for battery in batteries(context.topics)]


def current_ca(current_a: float) -> int:
    """Within int16; -1 is not known. One that is charged has a negative current."""
    if current_a == UNKNOWN or not math.isfinite(current_a):
        return -1
    return max(-32768, min(32767, truncated(current_a * 100.0)))


def _message(battery: BatteryStatus) -> Fields:
    """The first cell carries the whole voltage, as PX4 does when cells are unknown."""
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
        current_ca(battery.current_a),
        battery.id - 1 & UNKNOWN_ID,
        FUNCTION_ALL,
        LIPO,
        truncated(battery.remaining * 100.0 + 0.5) if battery.remaining != UNKNOWN else -1,
        left_s,
        CHARGE_STATE[battery.warning],
        0,
        0,
        0,
        0,
        0,
        0,
    )
