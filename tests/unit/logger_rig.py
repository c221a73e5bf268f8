"""A logger between topics that a test writes and a folder that it reads."""

from pathlib import Path

from pyulog import ULog

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.mavlink.context import BOOT_UNIX_US
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    SensorCombined,
    Topics,
    VehicleAcceleration,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind

TICK_US = 4_000
FIRST = "2026-01-01/00_00_00.ulg"


class Rig:
    """A logger between topics that a test writes and a folder that it reads."""

    def __init__(self, root: Path | None, **parameters: float) -> None:
        if root is not None:
            storage.prepare(root)
        self.root, self.topics, self.texts = root, Topics(), Texts()
        self.parameters = Parameters(VehicleKind.MULTICOPTER, {"SDLOG_MODE": 0, **parameters})
        self.logger = Logger(self.topics, self.parameters, self.texts, root, lambda: BOOT_UNIX_US)
        self.now_us = 0

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            self.topics.sensor_combined = SensorCombined(self.now_us, (0.1, 0.2, 0.3), (1.0, 2.0, -9.8))
            self.topics.vehicle_acceleration = VehicleAcceleration(self.now_us, self.now_us, (1.0, 2.0, -9.8))
            self.logger.update(self.now_us)

    def arm(self, armed: bool = True) -> None:
        self.topics.actuator_armed = ActuatorArmed(armed)
        self.topics.vehicle_status = VehicleStatus(self.now_us, armed=armed, nav_state=NavState.AUTO_LOITER)

    def names(self) -> list[str]:
        assert self.root is not None
        folder = self.root / "log"
        return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.ulg"))

    def read(self, name: str) -> ULog:
        assert self.root is not None
        return ULog(str(self.root / "log" / name))

    def said(self) -> list[str]:
        return [text.text for text in self.texts.recent]


def duration_s(log: ULog) -> float:
    return float(log.last_timestamp - log.start_timestamp) * 1e-6
