"""Sticks, switches and radio channels (writers: mavlink/services/, manual_control/)."""

from typing import NamedTuple

from sitl_emu.autopilot.constants import NavState, RequestedAction

SOURCE_UNKNOWN, SOURCE_RC, SOURCE_MAVLINK_0 = 0, 1, 2
"""manual_control_setpoint.data_source; the other MAVLink links follow."""


class InputRc(NamedTuple):
    """Channels as they came, µs of pulse; a channel that its sender ignores is 0."""

    timestamp: int = 0
    values: tuple[int, ...] = ()


Aux = tuple[float, float, float, float, float, float]
NO_AUX: Aux = (0.0,) * 6


class RcParameter(NamedTuple):
    """Which parameter a knob of the RC turns (PARAM_MAP_RC): value0 + scale * (-1..1), within limits; no name: none."""

    name: str = ""
    value0: float = 0.0
    scale: float = 0.0
    value_min: float = 0.0
    value_max: float = 0.0


class ManualControlInput(NamedTuple):
    """Sticks of one source: roll, pitch, yaw, throttle and the six auxiliary ones, each -1..1."""

    timestamp: int = 0
    data_source: int = SOURCE_UNKNOWN
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    throttle: float = 0.0
    buttons: int = 0
    aux: Aux = NO_AUX


class ManualControlSwitches(NamedTuple):
    """Switches of the RC: 0 not mapped, 1 on, 3 off; mode_slot 1..6, 0 not mapped. Writer: rc_update."""

    timestamp: int = 0
    mode_slot: int = 0
    arm: int = 0
    return_to_launch: int = 0
    loiter: int = 0
    offboard: int = 0
    kill: int = 0
    terminate: int = 0
    gear: int = 0


class ActionRequest(NamedTuple):
    """What a gesture (source 0), switch (1), button (2) or mode slot (3) asks; writer: manual_control."""

    number: int
    timestamp: int
    action: RequestedAction
    source: int
    mode: NavState


class ManualControlSetpoint(NamedTuple):
    """The sticks that are flown: roll, pitch, yaw, throttle each -1..1. Writer: manual_control."""

    timestamp: int = 0
    valid: bool = False
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    throttle: float = 0.0
    sticks_moving: bool = False
    data_source: int = SOURCE_UNKNOWN
    buttons: int = 0
    aux: Aux = NO_AUX
