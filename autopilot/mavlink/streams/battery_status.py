"""BATTERY_STATUS: the battery in detail (PX4: streams/BATTERY_STATUS.hpp)."""

import math
from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import BatteryStatus
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import product, truncated

ID = mavlink.MAVLINK_MSG_ID_BATTERY_STATUS
UNKNOWN_TEMPERATURE: Final = 32767
UNKNOWN_CELL: Final = 65535
FULLEST_CELL: Final = UNKNOWN_CELL - 1
LEAST_CELL_V: Final = 0.0001
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


def stamp(now_us: int, context: Context) -> int:
    """Whenever somebody told of it."""
    return context.topics.battery_status.timestamp


def fields(now_us: int, context: Context) -> Fields | None:
    """mV, cA, mAh, percent, 0.01 degC; fractions are cut off, but for the charge."""
    battery = context.topics.battery_status
    return _message(battery) if battery.timestamp else None


def current_ca(current_a: float) -> int:
    """Within int16; -1 is not known. One that is charged has a negative current."""
    if current_a == UNKNOWN or not math.isfinite(current_a):
        return -1
    return max(-32768, min(32767, truncated(product(current_a, 100.0))))


def _message(battery: BatteryStatus) -> Fields:
    which = (battery.id - 1 & UNKNOWN_ID, FUNCTION_ALL, LIPO)
    tail = (CHARGE_STATE[battery.warning], *(0,) * 6)
    if not battery.connected:
        return (-1, -1, UNKNOWN_TEMPERATURE, *(UNKNOWN_CELL,) * CELLS, -1, *which, -1, UNSUPPORTED, *tail)
    temperature_c, left = battery.temperature_c, battery.time_remaining_s
    temperature = truncated(product(temperature_c, 100.0)) if math.isfinite(temperature_c) else UNKNOWN_TEMPERATURE
    return (
        truncated(battery.discharged_mah),
        -1,
        temperature,
        *_cells(battery),
        current_ca(battery.current_a),
        *which,
        truncated(product(battery.remaining, 100.0) + 0.5) if battery.remaining != UNKNOWN else -1,
        max(truncated(left), 1) if math.isfinite(left) else UNSUPPORTED,
        *tail,
    )


def _cells(battery: BatteryStatus) -> tuple[int, ...]:
    """The whole voltage stands in as many cells as hold it where the first cell's own is not known."""
    cells_v = battery.cells_v
    if cells_v and cells_v[0] >= LEAST_CELL_V:
        cells = [truncated(product(volts, 1000.0)) for volts in cells_v]
    else:
        whole_mv = truncated(product(battery.voltage_v, 1000.0))
        full, rest = divmod(max(whole_mv, 0), FULLEST_CELL)
        cells = [*(FULLEST_CELL,) * full, rest] if full < CELLS else []
    return (*cells, *(UNKNOWN_CELL,) * (CELLS - len(cells)))
