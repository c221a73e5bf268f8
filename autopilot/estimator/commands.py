"""Commands to the estimator, as PX4's EKF2 takes them (src/modules/ekf2/EKF2.cpp, v1.18).

EXTERNAL_POSITION_ESTIMATE moves the position, whatever aids it, and what aids it brings it back. DO_SET_GLOBAL_ORIGIN
moves the local frame under the vehicle. An external attitude is accepted and changes nothing here.
"""

import math

from autopilot.commands import CommandResult
from autopilot.estimator.estimator import FUSION_SOURCES, Estimator
from autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

EXTERNAL_ATTITUDE_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_ATTITUDE_ESTIMATE
EXTERNAL_POSITION_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_POSITION_ESTIMATE
DO_SET_GLOBAL_ORIGIN: int = mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN
ESTIMATOR_SENSOR_ENABLE: int = mavlink.MAV_CMD_ESTIMATOR_SENSOR_ENABLE
UNKNOWN_ACCURACY_M = 50.0
ACCEPTED = CommandResult(mavlink.MAV_RESULT_ACCEPTED)
FAILED = CommandResult(mavlink.MAV_RESULT_FAILED)
UNSUPPORTED = CommandResult(mavlink.MAV_RESULT_UNSUPPORTED)


class EstimatorCommands:
    """Owner of the four."""

    COMMANDS = frozenset(
        {EXTERNAL_ATTITUDE_ESTIMATE, EXTERNAL_POSITION_ESTIMATE, DO_SET_GLOBAL_ORIGIN, ESTIMATOR_SENSOR_ENABLE}
    )

    def __init__(self, estimator: Estimator) -> None:
        self._estimator = estimator

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """Decide and act."""
        if command.command == ESTIMATOR_SENSOR_ENABLE:
            return self._sensor_enable(command)
        if command.command == EXTERNAL_POSITION_ESTIMATE:
            self._position(now_us, command)
        elif command.command == DO_SET_GLOBAL_ORIGIN:
            if not _is_place(command):
                return FAILED
            self._estimator.move_origin(now_us, command.param5, command.param6, command.param7)
        return ACCEPTED

    def _sensor_enable(self, command: VehicleCommand) -> CommandResult:
        """param1 is the source, param3 whether it may be used; there is one of each (param2)."""
        source = int(command.param1) if math.isfinite(command.param1) else -1
        if source not in FUSION_SOURCES:
            return UNSUPPORTED
        others = self._estimator.disabled - {source}
        self._estimator.disabled = others if command.param3 > 0.5 else others | {source}
        return ACCEPTED

    def _position(self, now_us: int, command: VehicleCommand) -> None:
        """param3 is the accuracy (1 σ, m), param5 and param6 are latitude and longitude."""
        if _is_place(command):
            accuracy_m = command.param3 if 0.0 < command.param3 < math.inf else UNKNOWN_ACCURACY_M
            self._estimator.reset_position(now_us, command.param5, command.param6, accuracy_m)


def _is_place(command: VehicleCommand) -> bool:
    return abs(command.param5) <= 90.0 and abs(command.param6) <= 180.0
