"""From setpoint to actuators: what controls each kind of vehicle."""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, Protocol

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.control.multicopter import MulticopterControl
from sitl_emu.autopilot.control.rover_ackermann import RoverAckermannControl
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind


class StartedModule(Protocol):
    """A module that runs on some vehicles alone, and may own commands."""

    COMMANDS: ClassVar[frozenset[int]]

    def update(self, now_us: int) -> None:
        """At 50 Hz."""
        ...

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Decide on one of COMMANDS; None gives no ack."""
        ...


class Control(Protocol):
    """The controllers of one vehicle. Writer of actuator_outputs."""

    @property
    def started(self) -> Sequence[StartedModule]:
        """Modules that come with it."""
        ...

    def update_position(self, now_us: int) -> None:
        """From position and velocity to attitude, at 125 Hz."""
        ...

    def update_rate(self, now_us: int) -> None:
        """From attitude to actuators, in every tick."""
        ...


CONTROLS: Mapping[VehicleKind, Callable[[Topics, Parameters, Texts], Control]] = {
    VehicleKind.MULTICOPTER: MulticopterControl,
    VehicleKind.ROVER_ACKERMANN: lambda topics, parameters, texts: RoverAckermannControl(
        topics, parameters, texts.events.send
    ),
}
