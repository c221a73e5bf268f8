"""Numbers that somebody wants to see in a plot or a log: named values and vectors.

Source: https://mavlink.io/en/messages/common.html#NAMED_VALUE_FLOAT. PX4 logs the last of each kind and tells it on.
"""

from sitl_emu.core import dialect as mavlink

NAME_BYTES = 9
"""PX4 keeps so many of the ten."""


def named_value(boot_us: int, name: str, value: float) -> mavlink.MAVLink_message:
    """One number; `name` of at most NAME_BYTES characters."""
    return mavlink.MAVLink_named_value_float_message(boot_us // 1000, _name(name), value)


def vector(time_us: int, name: str, x: float, y: float, z: float) -> mavlink.MAVLink_message:
    """Three numbers."""
    return mavlink.MAVLink_debug_vect_message(_name(name), time_us, x, y, z)


def _name(name: str) -> bytes:
    return name.encode("ascii", "replace")[:NAME_BYTES]
