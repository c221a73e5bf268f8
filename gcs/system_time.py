"""SYSTEM_TIME: the date, for a vehicle that has none.

Source: https://mavlink.io/en/messages/common.html#SYSTEM_TIME. PX4 takes it while its own clock stands before 2001;
once GPS or another has told the date, it does not listen any more.
"""

from sitl_emu.core import dialect as mavlink


def system_time(unix_us: int, boot_us: int) -> mavlink.MAVLink_message:
    """`unix_us`: µs since 1970; `boot_us`: since we started."""
    return mavlink.MAVLink_system_time_message(unix_us, boot_us // 1000)
