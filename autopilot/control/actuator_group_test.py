"""MAV_CMD_ACTUATOR_GROUP_TEST: for half a second one torque or thrust is what the command asks for, on the ground.

PX4's ActuatorGroupPreflightCheck in its control allocator (src/modules/control_allocator, v1.18): a thrust needs an
armed vehicle, a torque a prearmed or armed one. It is answered IN_PROGRESS, and at its end ACCEPTED, or CANCELLED if
the vehicle was disarmed, took off or changed its mode meanwhile, or another test was asked for.
"""

import math
from typing import ClassVar, Final, NamedTuple

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import MAV_RESULT_IN_PROGRESS, CommandResult, answer_later, nearest
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink

ROLL: Final = 0
PITCH: Final = 1
YAW: Final = 2
COLLECTIVE_TILT: Final = 3
X_THRUST: Final = 4
Y_THRUST: Final = 5
Z_THRUST: Final = 6
"""ACTUATOR_TEST_GROUP; the tilt of all rotors is a tiltrotor's alone."""
TORQUES, THRUSTS = (ROLL, PITCH, YAW), (X_THRUST, Y_THRUST, Z_THRUST)
LASTS_US: Final = 500_000
PREARMED_ALWAYS: Final = 2
PREARMED_FROM_US: Final = 5_000_000
"""COM_PREARM_MODE, and how long after the start; 1 waits for a safety button, which the simulation has none of."""
CANCELLED = CommandResult(mavlink.MAV_RESULT_CANCELLED)


class Test(NamedTuple):
    """The one that runs; `value` is -1..1."""

    group: int
    value: float
    until_us: int
    nav_state: NavState
    command: VehicleCommand


class ActuatorGroupTest:
    """Owner of the command."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.ACTUATOR_GROUP_TEST)

    def __init__(self, topics: Topics, parameters: Parameters, texts: Texts) -> None:
        """`texts`: what goes into the log."""
        self._topics, self._parameters, self._texts = topics, parameters, texts
        self.test: Test | None = None

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """param1: the group, param2: how much."""
        group = nearest(command.param1) & 0xFF
        if group not in TORQUES and group not in THRUSTS:
            reason = "not a tiltrotor" if group == COLLECTIVE_TILT else "unknown actuator group"
            return self._rejected(reason, mavlink.MAV_RESULT_UNSUPPORTED)
        if not self._is_ready(now_us, group):
            reason = "thrust test requires armed" if group in THRUSTS else "not (pre)armed"
            return self._rejected(reason, mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        if not self._topics.vehicle_land_detected.landed:
            return self._rejected("not landed", mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
        before = self.test
        value = max(-1.0, min(1.0, command.param2)) if math.isfinite(command.param2) else 0.0
        self.test = Test(group, value, now_us + LASTS_US, self._topics.vehicle_status.nav_state, command)
        begins = CommandResult(MAV_RESULT_IN_PROGRESS)
        if before is None:
            return begins
        answer_later(self._topics, before.command, CANCELLED)
        answer_later(self._topics, command, begins)
        return None

    def _rejected(self, reason: str, result: int) -> CommandResult:
        """Its reason is for the log alone (handleCommand)."""
        line = f"[control_allocator] Actuator group preflight check rejected ({reason})"
        self._texts.note(Severity.WARNING, line)
        return CommandResult(result)

    def update(self, now_us: int) -> None:
        """End the test, by time or because it may not go on."""
        test = self.test
        if test is None:
            return
        topics = self._topics
        goes_on = self._is_ready(now_us, test.group) and topics.vehicle_land_detected.landed
        if not goes_on or topics.vehicle_status.nav_state != test.nav_state:
            result = CANCELLED
        elif now_us >= test.until_us:
            result = CommandResult(mavlink.MAV_RESULT_ACCEPTED)
        else:
            return
        self.test = None
        answer_later(self._topics, test.command, result)

    def applied(self, roll: float, pitch: float, yaw: float, thrust: float) -> tuple[float, float, float, float]:
        """What the allocator gets instead of these torques and this thrust along z (down), while a test runs."""
        if self.test is None:
            return roll, pitch, yaw, thrust
        group, value = self.test.group, self.test.value
        if group == ROLL:
            return value, pitch, yaw, thrust
        if group == PITCH:
            return roll, value, yaw, thrust
        if group == YAW:
            return roll, pitch, value, thrust
        return roll, pitch, yaw, value if group == Z_THRUST else thrust

    def _is_ready(self, now_us: int, group: int) -> bool:
        """Armed, or prearmed where that does."""
        if self._topics.actuator_armed.armed or group in THRUSTS:
            return self._topics.actuator_armed.armed
        return int(self._parameters["COM_PREARM_MODE"]) == PREARMED_ALWAYS and now_us > PREARMED_FROM_US
