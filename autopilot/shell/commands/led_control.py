"""led_control: what lights show (PX4: systemcmds/led_control). There are none here: it is understood, no more."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, usage
from sitl_emu.autopilot.shell.options import NOT_UNDERSTOOD, options

NAME = "led_control"
COMMANDS = (
    ("test", "one pattern after the other"),
    ("on", ""),
    ("off", ""),
    ("reset", "give way to lower priorities"),
    ("blink", "-n times, -s fast, normal or slow"),
    ("breathe", ""),
    ("flash", "twice a second"),
)
COLORS = frozenset({"red", "blue", "green", "yellow", "purple", "amber", "cyan", "white"})
SPEEDS = frozenset({"fast", "normal", "slow"})


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`led_control COMMAND [-c COLOR] [-l LED] [-p PRIORITY]`."""
    told, words = options(arguments, "clnsp")
    if told is None:
        yield usage(NAME, COMMANDS)
        return NOT_UNDERSTOOD
    known = told.get("c", "white") in COLORS and told.get("s", "normal") in SPEEDS
    if not known or not words or words[0] not in dict(COMMANDS):
        yield usage(NAME, COMMANDS)
        return FAILURE
    return SUCCESS
