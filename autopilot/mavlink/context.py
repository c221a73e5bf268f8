"""What a stream sees when it makes its message: the topics, the parameters it needs, and the date of boot."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import ActuatorOutputs, Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind

if TYPE_CHECKING:
    from sitl_emu.autopilot.mavlink.link import Link

BOOT_UNIX_US: Final = 1_767_225_600_000_000
"""2026-01-01T00:00:00Z: the date of boot where nobody sets another."""


class Context:
    """Shared by all streams of one vehicle; `refresh` copies parameters after a change."""

    def __init__(self, topics: Topics, parameters: Parameters, dataman: Dataman, root: Path | None) -> None:
        """Keeps references; nothing is copied but parameters. `root`: the instance's folder, None for no storage."""
        self.root = root
        self.topics = topics
        self.parameters = parameters
        self.dataman = dataman
        self.boot_unix_us = BOOT_UNIX_US
        self.send_command: Callable[[int, VehicleCommand, Link], None] | None = None
        """Sends a command on one link, and again until it is answered there; None: there is nobody who does."""
        self.system_id = int(parameters["MAV_SYS_ID"])
        """As it was at boot: a change takes effect with the next one."""
        self._version = -1
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters that streams show."""
        if self._version == self.parameters.version:
            return
        self._version = self.parameters.version
        self.mav_type = int(self.parameters["MAV_TYPE"])
        self.forward_heartbeats = bool(self.parameters["MAV_HB_FORW_EN"])
        self.traits = VehicleKind.of_mav_type(self.mav_type).traits

    def actuator_outputs(self) -> ActuatorOutputs | None:
        """None before the first: a rover has none until it drives (PWMSim::updateOutputs)."""
        outputs = self.topics.actuator_outputs
        return outputs if outputs.timestamp else None
