"""What a shell command is, and how it prints.

A command is a generator: it yields what it prints, yields WAIT where it must let time pass, and returns its exit
status (0 is success). PX4's commands print in two ways: plainly, or as a log line that names level and module.
"""

import math
import re
from collections.abc import Callable, Generator, Sequence
from typing import Protocol

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import VehicleCommands
from sitl_emu.autopilot.control.control import StartedModule
from sitl_emu.autopilot.estimator.estimator import Estimator
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.mavlink.mavlink import Mavlink
from sitl_emu.autopilot.navigator.navigator import Navigator
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.parameters.storage import ParameterStorage
from sitl_emu.autopilot.payload.camera_trigger import CameraTrigger
from sitl_emu.autopilot.payload.payload_deliverer import PayloadDeliverer
from sitl_emu.autopilot.sensors.gyro_calibration import GyroCalibration
from sitl_emu.autopilot.sensors.sensors import Sensors
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import Topics
from sitl_emu.autopilot.vision_target_estimator.vision_target_estimator import VisionTargetEstimator

WAIT = ""
"""Yielded by a command that waits for the next tick."""
DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
LARGEST_FLOAT = 3.4028234663852886e38
"""Of a float32; what is more stays there."""
INTEGER = re.compile(r"[+-]?\d{1,100}", re.ASCII)
SUCCESS = 0
FAILURE = 1


class Vehicle(Protocol):
    """The modules of one vehicle, as far as commands look at them and act on them."""

    now_us: int
    topics: Topics
    parameters: Parameters
    parameter_storage: ParameterStorage
    dataman: Dataman
    commands: VehicleCommands
    outgoing: OutgoingCommands
    sensors: Sensors
    gyro_calibration: GyroCalibration
    vision_target_estimator: VisionTargetEstimator | None
    estimator: Estimator
    navigator: Navigator
    payload_deliverer: PayloadDeliverer
    camera_trigger: CameraTrigger | None
    started: tuple[StartedModule, ...]
    mavlink: Mavlink
    logger: Logger


Output = Generator[str, None, int]
Command = Callable[[Vehicle, Sequence[str]], Output]
"""`arguments` are the words after the command's own name."""


def info(module: str, text: str) -> str:
    """A log line as PX4_INFO prints it where nobody wants colours."""
    return f"INFO  [{module}] {text}\n"


def warning(module: str, text: str) -> str:
    """A log line as PX4_WARN prints it."""
    return f"WARN  [{module}] {text}\n"


def error(module: str, text: str) -> str:
    """A log line as PX4_ERR prints it."""
    return f"ERROR [{module}] {text}\n"


def usage(name: str, commands: Sequence[tuple[str, str]]) -> str:
    """Names a command's own commands, each with what it does, in the shape of PX4's usage texts."""
    lines = "".join(f"\n   {command:<13} {what}\n" for command, what in commands)
    return f"Usage: {name} <command> [arguments...]\n Commands:\n{lines}"


def integer(text: str) -> int:
    """What C's strtol makes of a word in base 10: the digits it begins with, or 0."""
    found = INTEGER.match(text)
    return int(found[0]) if found else 0


def number(text: str) -> float:
    """What C's strtod makes of a word: the decimal number it begins with, or 0 (and for "nan" and "inf")."""
    found = DECIMAL.match(text)
    value = float(found[0]) if found else 0.0
    return value if abs(value) <= LARGEST_FLOAT else math.copysign(LARGEST_FLOAT, value)
