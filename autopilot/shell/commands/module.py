"""PX4's modules that do their work without further ado: `NAME status` says whether they run."""

from collections.abc import Callable, Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Command, Output, Vehicle, error, info, usage, warning

Runs = Callable[[Vehicle], bool]
BASE = "px4"
HELP = ("", "-h", "help", "info", "usage")
SAY_ERRORS = frozenset({"land_detector", "load_mon", "rover_ackermann"})
"""Others warn of a command that they do not know."""
COMMANDS = (("start", ""), ("stop", ""), ("status", "whether it runs"))


def always(vehicle: Vehicle) -> bool:
    """Every vehicle has it."""
    return True


def never(vehicle: Vehicle) -> bool:
    """PX4 has it, and no vehicle of ours."""
    return False


def of_kind(name: str) -> Runs:
    """Kinds of vehicle have it whose start-up script starts a module of this name."""
    return lambda vehicle: name in vehicle.topics.vehicle_status.vehicle_kind.traits.modules


def was_started(kind: type) -> Runs:
    """Vehicles have it whose parameters start such a module."""
    return lambda vehicle: any(isinstance(module, kind) for module in vehicle.started)


def command(name: str, runs: Runs) -> Command:
    """The command of a module."""

    def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
        return (yield from default_command(name, runs(vehicle), arguments))

    return main


def default_command(name: str, runs: bool, arguments: Sequence[str]) -> Output:
    """What every module answers (PX4: platforms/common/module_base.cpp); modules stay as they were started.

    Its texts bear the name of the program, as on SITL; a module's own print_usage says first what it did not
    understand, and succeeds.
    """
    what = arguments[0] if arguments else ""
    if what == "status":
        yield "running\n" if runs else info(BASE, "not running")
        return SUCCESS if runs else -1
    if what == "start" and runs:
        yield error(BASE, "Task already running")
        return -1
    if what in ("start", "stop"):
        yield usage(name, COMMANDS)
        return FAILURE
    if what not in HELP:
        yield (error if name in SAY_ERRORS else warning)(name, "unknown command\n")
    yield usage(name, COMMANDS)
    return SUCCESS
