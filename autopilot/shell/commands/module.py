"""PX4's modules that do their work without further ado: `NAME status` says whether they run."""

from collections.abc import Callable, Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Command, Output, Vehicle, error, info, usage

Runs = Callable[[Vehicle], bool]
COMMANDS = (("start", ""), ("stop", ""), ("status", "whether it runs"))


def always(vehicle: Vehicle) -> bool:
    """Every vehicle has it."""
    return True


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
    """What every module answers (PX4: ModuleBase); modules stay as they were started."""
    what = arguments[0] if arguments else ""
    if what == "status":
        yield info(name, "running" if runs else "not running")
        return SUCCESS if runs else -1
    if what == "start" and runs:
        yield error(name, "Task already running")
        return -1
    yield usage(name, COMMANDS)
    return FAILURE
