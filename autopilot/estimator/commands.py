"""Commands to the estimator, as PX4's EKF2 takes them (src/modules/ekf2/EKF2.cpp, v1.18).

EXTERNAL_POSITION_ESTIMATE moves the position, whatever aids it, and what aids it brings it back.
EXTERNAL_ATTITUDE_ESTIMATE turns the heading. DO_SET_GLOBAL_ORIGIN moves the local frame under the vehicle.
EXTERNAL_WIND_ESTIMATE sets the wind on the ground alone, and PX4 answers it twice: the filter accepts it, the commander
does not know it. ESTIMATOR_SENSOR_ENABLE switches a sensor's fusion; EKF2_SENS_EN keeps that, at once while disarmed,
else after disarming.
"""

import math
from typing import ClassVar, Final

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later
from sitl_emu.autopilot.estimator import external_estimates
from sitl_emu.autopilot.estimator.aid_sources import aux_global_position
from sitl_emu.autopilot.estimator.estimator import Estimator
from sitl_emu.autopilot.estimator.resets import move_origin
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import integer

EXTERNAL_ATTITUDE_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_ATTITUDE_ESTIMATE
EXTERNAL_POSITION_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_POSITION_ESTIMATE
EXTERNAL_WIND_ESTIMATE: int = mavlink.MAV_CMD_EXTERNAL_WIND_ESTIMATE
ESTIMATOR_SENSOR_ENABLE: int = mavlink.MAV_CMD_ESTIMATOR_SENSOR_ENABLE
AUX_GLOBAL_POSITION: Final = 3
SENS_EN: Final = {0: 1 << 0, 1: 1 << 2, 2: 1 << 3, 4: 1 << 8, 5: 1 << 9, 6: 1 << 10, 7: 1 << 11, 8: 1 << 12}
"""Bits of EKF2_SENS_EN by FUSION_SOURCE (VehicleCommand.msg)."""
UNKNOWN_ACCURACY_M: Final = 50.0
UNKNOWN_HEADING_ACCURACY_DEG: Final = 20.0
LONGEST_DELAY_S: Final = 15.0
ACCEPTED = CommandResult(mavlink.MAV_RESULT_ACCEPTED)
FAILED = CommandResult(mavlink.MAV_RESULT_FAILED)
UNSUPPORTED = CommandResult(mavlink.MAV_RESULT_UNSUPPORTED)
TEMPORARILY_REJECTED = CommandResult(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)


class EstimatorCommands:
    """Owner of the five."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.ESTIMATOR)

    def __init__(self, estimator: Estimator, topics: Topics, parameters: Parameters) -> None:
        self._estimator, self._ekf, self._fusion = estimator, estimator.ekf, estimator.fusion
        self._topics, self._parameters = topics, parameters

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """Decide and act."""
        if command.command == ESTIMATOR_SENSOR_ENABLE:
            return self._sensor_enable(command)
        if command.command == EXTERNAL_POSITION_ESTIMATE:
            return self._position(now_us, command)
        if command.command == EXTERNAL_WIND_ESTIMATE:
            return self._wind(command)
        if command.command == EXTERNAL_ATTITUDE_ESTIMATE:
            return self._attitude(command)
        if not _is_place(command):
            return FAILED
        move_origin(self._ekf, command.param5, command.param6, command.param7)
        return ACCEPTED

    def _sensor_enable(self, command: VehicleCommand) -> CommandResult:
        """param1 is the source, param2 which of the auxiliary positions, param3 whether it may be used (1)."""
        source = integer("B", command.param1)
        slot = integer("B", command.param2) if math.isfinite(command.param2) else 0
        bit = SENS_EN.get(source, 0)
        if source == AUX_GLOBAL_POSITION:
            bit = aux_global_position.SENS_EN << slot if slot < aux_global_position.SLOTS else 0
        if not bit:
            return UNSUPPORTED
        ekf, enable = self._ekf, integer("i", command.param3) == 1
        ekf.sens_en = ekf.sens_en | bit if enable else ekf.sens_en & ~bit
        if not self._topics.vehicle_status.armed:
            self._estimator.keep_enabled()
        return ACCEPTED if not enable or self._available(source, slot) else TEMPORARILY_REJECTED

    def _available(self, source: int, slot: int) -> bool:
        """A parameter has switched the sensor on."""
        value, positions = self._parameters, self._fusion.auxiliary.sources
        wanted = (
            value["EKF2_GPS_CTRL"],
            value["EKF2_OF_CTRL"],
            value["EKF2_EV_CTRL"],
            slot in positions and positions[slot].available,
            value["EKF2_BARO_CTRL"],
            value["EKF2_RNG_CTRL"],
            value["EKF2_MAG_TYPE"] != MAG_TYPE_NONE,
            value["EKF2_ARSP_THR"] > 0.0,
            value["EKF2_RNGBC_CTRL"],
        )
        return bool(wanted[source])

    def _position(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """param2 is the delay (s), param3 the accuracy (1 σ, m), param5 to 7 latitude, longitude and altitude."""
        if not all(map(math.isfinite, (command.param2, command.param5, command.param6))):
            return TEMPORARILY_REJECTED
        if not _is_place(command):
            return FAILED
        accuracy_m = command.param3 if 0.0 < command.param3 < math.inf else UNKNOWN_ACCURACY_M
        measured_us = now_us - int(min(max(command.param2, 0.0), LONGEST_DELAY_S) * 1e6)
        place = (command.param5, command.param6, command.param7)
        external_estimates.take_position(self._ekf, place, accuracy_m, measured_us)
        return ACCEPTED

    def _attitude(self, command: VehicleCommand) -> CommandResult:
        """param3 is the heading, param7 its accuracy (1 σ; degrees)."""
        if not math.isfinite(command.param3):
            return UNSUPPORTED
        accuracy_deg = command.param7 if math.isfinite(command.param7) else UNKNOWN_HEADING_ACCURACY_DEG
        external_estimates.take_heading(self._ekf, math.radians(command.param3), math.radians(accuracy_deg))
        return ACCEPTED

    def _wind(self, command: VehicleCommand) -> CommandResult:
        """param1 is the speed (m/s), param3 where the wind comes from; param2 and param4 their accuracies (degrees).

        PX4's filter is lost with a direction that is none; here nothing changes.
        """
        told = (command.param1, math.radians(command.param3), command.param2, math.radians(command.param4))
        if not self._ekf.flags.in_air and math.isfinite(told[1]):
            external_estimates.take_wind(self._ekf, *told)
            self._fusion.drag.wind_told = True
        answer_later(self._topics, command, UNSUPPORTED)
        return ACCEPTED


MAG_TYPE_NONE: Final = 5


def _is_place(command: VehicleCommand) -> bool:
    return abs(command.param5) <= 90.0 and abs(command.param6) <= 180.0
