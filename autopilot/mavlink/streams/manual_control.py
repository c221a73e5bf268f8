"""MANUAL_CONTROL: the sticks in use, and the switches of the RC (PX4: streams/MANUAL_CONTROL.hpp)."""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32, product, truncated

ID = mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL
ALL_AUX: Final = 0b1111_1100
"""enabled_extensions: every auxiliary stick, there or not."""


def stamp(now_us: int, context: Context) -> int:
    """Once, until the sticks speak again or fall silent."""
    return context.topics.manual_control_setpoint.timestamp


def fields(now_us: int, context: Context) -> Fields:
    """X pitch, y roll, r yaw and aux in thousandths; z throttle 0..1000; two bits of `buttons` for each switch.

    Fractions are cut off, so that what float32 does not hold comes out one below what a joystick said.
    """
    topics = context.topics
    sticks, switches = topics.manual_control_setpoint, topics.manual_control_switches
    pitch, roll, yaw = (truncated(product(value, 1000.0)) for value in (sticks.pitch, sticks.roll, sticks.yaw))
    throttle = truncated(product(float32(sticks.throttle) + 1.0, 500.0))
    buttons = switches.return_to_launch << 2 | switches.loiter << 6 | switches.offboard << 10 | switches.kill << 12
    aux = (truncated(product(value, 1000.0)) for value in sticks.aux)
    return (pitch, roll, throttle, yaw, buttons, context.system_id, 0, ALL_AUX, 0, 0, *aux)
