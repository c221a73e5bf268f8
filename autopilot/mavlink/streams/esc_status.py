"""ESC_STATUS: speed, voltage and current of the motors, four in a message (PX4: streams/ESC_STATUS.hpp)."""

from autopilot.mavlink.context import Context
from autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_ESC_STATUS
FULL_RPM = 6000.0
"""Speed that PX4's simulated ESC reports at full output."""


def fields(now_us: int, context: Context) -> list[Fields]:
    """Rpm follows the output; current is shared out evenly."""
    topics = context.topics
    outputs = topics.actuator_outputs
    if context.is_rover or outputs.timestamp == 0:
        return []
    count = context.motor_count
    battery = topics.battery_status
    voltage_v = battery.voltage_v if battery.connected else 0.0
    current_a = battery.current_a / max(count, 1) if battery.connected and battery.current_a > 0.0 else 0.0
    controls = outputs.controls[:count]
    return [part(now_us, first, controls, voltage_v, current_a) for first in range(0, count, 4)]


def part(now_us: int, first: int, controls: tuple[float, ...], voltage_v: float, current_a: float) -> Fields:
    """The message about motor `first` and the three after it."""
    there = len(controls[first : first + 4])
    rpm = tuple(truncated(FULL_RPM * control) for control in controls[first : first + 4]) + (0,) * (4 - there)
    absent = (0.0,) * (4 - there)
    return (now_us, *rpm, *(voltage_v,) * there, *absent, *(current_a,) * there, *absent, first)
