"""MAV_CMD_INJECT_FAILURE: which unit fails how, told to whom it concerns by the topic failure_injection.

PX4's failure_injection_manager (src/modules/failure_injection_manager, v1.18): SYS_FAILURE_EN lets it; a unit and a
type that PX4 has no failure for are UNSUPPORTED; an instance (1 is the first, 0 means all) fails in one way at a time;
"ok" mends it. The sensors' failures are applied in sensors/, a motor's in the control of its vehicle.

The answer names nobody (publishAck in FailureInjectionManager.cpp), so that it goes out on every link on which somebody
was heard; without SYS_FAILURE_EN it is the link that answers, and whom.
"""

import math
from typing import ClassVar

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import FailureInjection, Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
UNSUPPORTED: int = mavlink.MAV_RESULT_UNSUPPORTED

OK: int = mavlink.FAILURE_TYPE_OK
OFF: int = mavlink.FAILURE_TYPE_OFF
STUCK: int = mavlink.FAILURE_TYPE_STUCK
WRONG: int = mavlink.FAILURE_TYPE_WRONG

GYRO: int = mavlink.FAILURE_UNIT_SENSOR_GYRO
ACCEL: int = mavlink.FAILURE_UNIT_SENSOR_ACCEL
MAG: int = mavlink.FAILURE_UNIT_SENSOR_MAG
BARO: int = mavlink.FAILURE_UNIT_SENSOR_BARO
GPS: int = mavlink.FAILURE_UNIT_SENSOR_GPS
BATTERY: int = mavlink.FAILURE_UNIT_SYSTEM_BATTERY
MOTOR: int = mavlink.FAILURE_UNIT_SYSTEM_MOTOR

SUPPORTED: dict[int, frozenset[int]] = {
    **dict.fromkeys((GYRO, ACCEL, MAG, BARO), frozenset((OK, OFF, STUCK))),
    **dict.fromkeys((GPS, mavlink.FAILURE_UNIT_SENSOR_AIRSPEED, MOTOR), frozenset((OK, OFF, STUCK, WRONG))),
    **dict.fromkeys((mavlink.FAILURE_UNIT_SENSOR_VIO, BATTERY), frozenset((OK, OFF))),
}
"""What of MAVLink's FAILURE_UNIT and FAILURE_TYPE PX4 knows."""
INSTANCES = 16
ALL_INSTANCES = (1 << INSTANCES) - 1
MOST_FAILURES = 16
"""Failures (a unit and a type) at the same time; one more is rejected."""


class FailureInjectionManager:
    """Owner of INJECT_FAILURE; writes failure_injection."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.FAILURE_INJECTION)

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """param1 unit, param2 type, param3 instance."""
        if not self._parameters["SYS_FAILURE_EN"]:
            return CommandResult(mavlink.MAV_RESULT_DENIED)
        unit, kind, instance = (_byte(value) for value in (command.param1, command.param2, command.param3))
        to_nobody = command._replace(source_system=0, source_component=0)
        answer_later(self._topics, to_nobody, CommandResult(self._inject(unit, kind, instance)))
        return None

    def _inject(self, unit: int, kind: int, instance: int) -> int:
        if kind not in SUPPORTED.get(unit, ()):
            return UNSUPPORTED
        failures = inject(self._topics.failure_injection, unit, kind, instance)
        if failures is None:
            return TEMPORARILY_REJECTED
        self._topics.failure_injection = failures
        return ACCEPTED


def inject(failures: FailureInjection, unit: int, kind: int, instance: int) -> FailureInjection | None:
    """The failures after one more, or one less (`kind` OK); None when there are too many.

    Instances over 16 change nothing.
    """
    if not 0 <= instance <= INSTANCES:
        return failures
    mask = 1 << (instance - 1) if instance else ALL_INSTANCES
    entries: dict[tuple[int, int], int] = {}
    for other, of_kind, instances in failures.entries:
        left = instances & ~mask if other == unit and of_kind != kind else instances
        if left:
            entries[other, of_kind] = left
    if kind != OK:
        entries[unit, kind] = entries.get((unit, kind), 0) | mask
    if len(entries) > MOST_FAILURES:
        return None
    return FailureInjection(tuple((unit, kind, instances) for (unit, kind), instances in entries.items()))


def _byte(value: float) -> int:
    """The nearest integer in eight bits, as PX4 keeps it; what is no number is 0."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value)) & 0xFF if math.isfinite(value) else 0
