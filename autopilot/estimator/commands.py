"""Commands to the estimator, as PX4's EKF2 takes them (src/modules/ekf2/EKF2.cpp, v1.18).

EXTERNAL_POSITION_ESTIMATE moves the position, whatever aids it, and what aids it brings it back. DO_SET_GLOBAL_ORIGIN
moves the local frame under the vehicle. EXTERNAL_WIND_ESTIMATE sets the wind on the ground alone, and PX4 answers it
twice: the filter accepts it, the commander does not know it. An external heading is accepted and changes nothing here.
"""

import math

from autopilot.commands import CommandResult, answer_later
from autopilot.estimator.estimator import Estimator
from autopilot.topics import Topics, VehicleCommand, WindEstimate
from sitl_emu.core import dialect as mavlink

EXTERNAL_ATTITUDE_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_ATTITUDE_ESTIMATE
EXTERNAL_POSITION_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_POSITION_ESTIMATE
EXTERNAL_WIND_ESTIMATE = 43004
"""MAV_CMD_EXTERNAL_WIND_ESTIMATE, of MAVLink's development dialect."""
DO_SET_GLOBAL_ORIGIN: int = mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN
ESTIMATOR_SENSOR_ENABLE: int = mavlink.MAV_CMD_ESTIMATOR_SENSOR_ENABLE
FUSION_SOURCES = range(9)
"""MAV_CMD_ESTIMATOR_SENSOR_ENABLE, param1: GPS, optical flow, vision, auxiliary position, barometer, range finder,
magnetometer, airspeed, beacon."""
UNKNOWN_ACCURACY_M = 50.0
ACCEPTED = CommandResult(mavlink.MAV_RESULT_ACCEPTED)
FAILED = CommandResult(mavlink.MAV_RESULT_FAILED)
UNSUPPORTED = CommandResult(mavlink.MAV_RESULT_UNSUPPORTED)
TEMPORARILY_REJECTED = CommandResult(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)


class EstimatorCommands:
    """Owner of the five; writes wind when it is told."""

    COMMANDS = frozenset(
        {
            EXTERNAL_ATTITUDE_ESTIMATE,
            EXTERNAL_POSITION_ESTIMATE,
            EXTERNAL_WIND_ESTIMATE,
            DO_SET_GLOBAL_ORIGIN,
            ESTIMATOR_SENSOR_ENABLE,
        }
    )

    def __init__(self, estimator: Estimator, topics: Topics) -> None:
        self._filter = estimator.filter
        self._topics = topics

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """Decide and act."""
        if command.command == ESTIMATOR_SENSOR_ENABLE:
            return self._sensor_enable(command)
        if command.command == EXTERNAL_POSITION_ESTIMATE:
            return self._position(now_us, command)
        if command.command == EXTERNAL_WIND_ESTIMATE:
            return self._wind(now_us, command)
        if command.command == EXTERNAL_ATTITUDE_ESTIMATE:
            return ACCEPTED if math.isfinite(command.param3) else UNSUPPORTED
        if not _is_place(command):
            return FAILED
        self._filter.move_origin(now_us, command.param5, command.param6, command.param7)
        return ACCEPTED

    def _sensor_enable(self, command: VehicleCommand) -> CommandResult:
        """param1 is the source, param3 whether it may be used; there is one of each (param2)."""
        source = int(command.param1) if math.isfinite(command.param1) else -1
        if source not in FUSION_SOURCES:
            return UNSUPPORTED
        others = self._filter.disabled - {source}
        self._filter.disabled = others if command.param3 > 0.5 else others | {source}
        return ACCEPTED

    def _position(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """param2 is the delay (s), param3 the accuracy (1 σ, m), param5 and param6 are latitude and longitude."""
        if not all(map(math.isfinite, (command.param2, command.param5, command.param6))):
            return TEMPORARILY_REJECTED
        if not _is_place(command):
            return FAILED
        accuracy_m = command.param3 if 0.0 < command.param3 < math.inf else UNKNOWN_ACCURACY_M
        self._filter.take_position(now_us, command.param5, command.param6, accuracy_m)
        return ACCEPTED

    def _wind(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """param1 is the speed (m/s), param3 where the wind comes from (degrees)."""
        speed_m_s, direction_rad = command.param1, math.radians(command.param3)
        if self._topics.vehicle_land_detected.landed and math.isfinite(speed_m_s) and math.isfinite(direction_rad):
            speed_m_s = max(speed_m_s, 0.0)
            north, east = -speed_m_s * math.cos(direction_rad), -speed_m_s * math.sin(direction_rad)
            self._topics.wind = WindEstimate(now_us, north, east)
        answer_later(self._topics, command, UNSUPPORTED)
        return ACCEPTED


def _is_place(command: VehicleCommand) -> bool:
    return abs(command.param5) <= 90.0 and abs(command.param6) <= 180.0
