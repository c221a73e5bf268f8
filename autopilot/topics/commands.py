"""Commands, those that were accepted, and answers that come later."""

from typing import NamedTuple

from sitl_emu.autopilot.topics.values import NAN


class VehicleCommand(NamedTuple):
    """COMMAND_LONG or COMMAND_INT as its owner sees it; a place's lat/lon in degrees in param5/param6 for both."""

    command: int
    param1: float = NAN
    param2: float = NAN
    param3: float = NAN
    param4: float = NAN
    param5: float = NAN
    param6: float = NAN
    param7: float = NAN
    frame: int = 0
    """MAV_FRAME of a COMMAND_INT; MAV_FRAME_GLOBAL for a COMMAND_LONG."""
    source_system: int = 0
    source_component: int = 0
    target_system: int = 0
    target_component: int = 0
    from_external: bool = True
    confirmation: int = 0


class CommandRecord(NamedTuple):
    """A command that its owner has accepted and that another module acts on; `number` counts up from 1."""

    number: int
    timestamp: int
    command: VehicleCommand


class CommandTold(NamedTuple):
    """A command, or where there is a result the answer to one, as it was told; `number` counts up. For the log."""

    number: int
    timestamp: int
    command: VehicleCommand
    result: tuple[int, int, int] | None = None
    """MAV_RESULT, progress, result_param2."""
    from_outside: bool = False
    """It is another component that answers; `command` then has whom it answers as its source."""


class VehicleCommandAck(NamedTuple):
    """An answer to a command that comes after the first one, for whoever sent the command."""

    command: VehicleCommand
    result: int
    progress: int = 0
    result_param2: int = 0
