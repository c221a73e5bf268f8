"""POSITION_SLOW: Position with lower limits, by parameters, by SET_VELOCITY_LIMITS or by knobs of the remote control.

Behaves as PX4's FlightTaskManualAccelerationSlow (v1.18): MC_SLOW_DEF_*, or what MAVLink tells, no less than
MC_SLOW_MIN_*; between that minimum and what was told, or else Position's own limits, by the auxiliary channel that
MC_SLOW_MAP_* names. In the air it turns a gimbal itself, where there is one: the yaw stick and MC_SLOW_MAP_PTCH are its
rates then, and the vehicle's heading follows it once all its axes are locked.
"""

import math
from typing import NamedTuple

from sitl_emu.autopilot.constants import TakeoffState
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.modes.flight_task import Setpoint
from sitl_emu.autopilot.modes.gimbal_control import GimbalControl
from sitl_emu.autopilot.modes.manual_position import ManualPosition
from sitl_emu.autopilot.modes.sticks import centred
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics

AUXILIARIES = 6


class Knob(NamedTuple):
    """A limit: by channel (0: by none), at least, and where no channel sets it."""

    channel: int
    least: float
    default: float

    def limit(self, most: float, aux: tuple[float, ...], told: float) -> float:
        """Of a limit of the mode Position, or of the one that was told, if it is finite; a knob runs from -1 to 1."""
        if math.isfinite(told):
            most = max(told, self.least)
        if not self.channel:
            return most if math.isfinite(told) else self.default
        share = max(0.0, min(1.0, (_position(aux, self.channel) + 1.0) / 2.0))
        return self.least + share * (most - self.least)


class ManualPositionSlow(ManualPosition):
    """The flight task of POSITION_SLOW."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._gimbal = GimbalControl(topics, parameters)
        super().__init__(topics, parameters, say, send)

    def refresh(self) -> None:
        """Copy the parameters."""
        super().refresh()
        value = self._parameters
        self._speed, self._climb_rate, turn = (_knob(value, name) for name in ("HVEL", "VVEL", "YAWR"))
        self._turn_rate = Knob(turn.channel, math.radians(turn.least), math.radians(turn.default))
        self._fastest = float(value["MPC_VEL_MANUAL"])
        self._pitch_channel = int(value["MC_SLOW_MAP_PTCH"])

    def end(self, now_us: int) -> None:
        """Another mode is entered."""
        self._gimbal.release(now_us)

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        aux, limits = self._topics.manual_control_setpoint.aux, self._limits
        told = self._topics.velocity_limits
        self._speed_constraint = self._speed.limit(self._fastest, aux, told.horizontal_velocity)
        self._velocity_constraint_up = self._climb_rate.limit(limits.speed_up, aux, told.vertical_velocity)
        self._velocity_constraint_down = self._climb_rate.limit(limits.speed_down, aux, told.vertical_velocity)
        self._stick_yaw.yawspeed_constraint = self._turn_rate.limit(self._stick_yaw.max_rate, aux, told.yaw_rate)
        flown, constraints = super().update(now_us, dt_s)
        gimbal = self._gimbal
        if not (gimbal.is_there(now_us) and self._topics.takeoff_status.state == TakeoffState.FLIGHT):
            gimbal.release(now_us)
            return flown, constraints
        rate = self._stick_yaw.yawspeed_constraint
        yaw_rate = centred(self._topics.manual_control_setpoint).yaw * rate
        gimbal.turn(now_us, _position(aux, self._pitch_channel) * rate, yaw_rate)
        yaw = gimbal.yaw
        if math.isfinite(yaw):
            self._stick_yaw.yaw = yaw
        return flown._replace(yaw=yaw if math.isfinite(yaw) else flown.yaw, yawspeed=yaw_rate), constraints


def _position(aux: tuple[float, ...], channel: int) -> float:
    """Of a knob, -1 to 1; none is taken for the first one (getInputFromSanitizedAuxParameterIndex)."""
    knob = aux[max(0, min(AUXILIARIES - 1, channel - 1))]
    return knob if math.isfinite(knob) else 0.0


def _knob(value: Parameters, name: str) -> Knob:
    return Knob(
        int(value[f"MC_SLOW_MAP_{name}"]), float(value[f"MC_SLOW_MIN_{name}"]), float(value[f"MC_SLOW_DEF_{name}"])
    )
