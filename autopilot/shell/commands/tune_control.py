"""tune_control: plays a tune (PX4: systemcmds/tune_control). Nothing sounds here: it is understood, and that is all."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, info, integer, usage, warning
from sitl_emu.autopilot.shell.options import NOT_UNDERSTOOD, options

NAME = "tune_control"
COMMANDS = (
    ("play", "'error', -t NUMBER, -m MELODY, or a note: -f HZ -d US"),
    ("libtest", "lists the notes of a tune"),
    ("stop", ""),
)
TUNES = 20
"""In PX4's lib/tunes/tune_definition.desc; the first can't be asked for."""
HIGHEST_HZ = 22_000
MELODY = "M"
"""How one begins."""


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`tune_control play|libtest|stop`."""
    told, words = options(arguments, "fdtms")
    if told is None:
        yield usage(NAME, COMMANDS)
        return NOT_UNDERSTOOD
    possible = (
        0 < integer(told.get("t", "1")) < TUNES
        and 0 < integer(told.get("f", "1")) < HIGHEST_HZ
        and told.get("m", MELODY).startswith(MELODY)
    )
    if not possible or not words or words[0] not in dict(COMMANDS):
        yield usage(NAME, COMMANDS)
        return FAILURE
    if words[0] == "stop":
        yield info(NAME, "Stopping playback...")
    elif words[0] == "play" and len(arguments) == 1:
        yield warning(NAME, "Missing argument")
        yield usage(NAME, COMMANDS)
        return FAILURE
    elif words[0] == "play" and "m" in told and words[1:2] != ["error"]:
        yield info(NAME, "Start playback...")
        yield info(NAME, "Playback finished.")
    return SUCCESS
