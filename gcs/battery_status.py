"""A battery that tells of itself, as a smart battery on board does.

Source: https://mavlink.io/en/messages/common.html#BATTERY_STATUS. PX4 takes it from components of its own system alone,
in the place of the battery that it measures itself, until that is published again (not with BAT1_SOURCE other than 0).
"""

from collections.abc import Sequence

from sitl_emu.core import dialect as mavlink

NO_CELL = 65535
CELLS = 10
UNKNOWN_TEMPERATURE = 32767
LIPO, FUNCTION_ALL = 1, 1


def battery_status(cells_v: Sequence[float], remaining: float, current_a: float = -0.01) -> mavlink.MAVLink_message:
    """Voltages of up to ten cells, charge 0..1; a negative current is unknown."""
    voltages = [round(volts * 1e3) for volts in cells_v] + [NO_CELL] * (CELLS - len(cells_v))
    return mavlink.MAVLink_battery_status_message(
        0, FUNCTION_ALL, LIPO, UNKNOWN_TEMPERATURE, voltages, round(current_a * 100.0), -1, -1, round(remaining * 100.0)
    )
