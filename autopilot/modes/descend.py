"""DESCEND: down at landing speed without a position, level, heading held (PX4 v1.18's FlightTaskDescend).

Where not even the vertical speed is known it sinks with a constant acceleration. Where MPC_AUTO_NUDGING lets sticks
change a landing they tilt it as in ALTCTL, turn it, and stop it or make it twice as fast.
"""

import math

from sitl_emu.autopilot.modes.flight_task import Setpoint
from sitl_emu.autopilot.modes.nudging import LANDING
from sitl_emu.autopilot.modes.sticks import (
    Horizontal,
    StickYaw,
    acceleration_at,
    expo_deadzone,
    low_passed,
    north_east,
    within_unit_length,
)
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import NAN3, ManualControlSetpoint, Topics, TrajectorySetpoint, VehicleConstraints

NAN = math.nan
BLIND_M_S2 = 0.3
"""Down, without a vertical speed."""
THROTTLE_M_S2 = 10.0
"""Up, at full throttle then."""


class Descend:
    """The flight task of DESCEND."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._stick_yaw = StickYaw()
        """Its `yaw` is the one flown."""
        self._tilt: Horizontal = (0.0, 0.0)
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        value = self._parameters
        self._speed = value["MPC_LAND_SPEED"]
        self._limits = VehicleConstraints(value["MPC_Z_VEL_MAX_UP"], value["MPC_Z_VEL_MAX_DN"])
        self._takes_sticks = bool(int(value["MPC_AUTO_NUDGING"]) & LANDING)
        self._dead_zone = float(value["MAN_DEADZONE"])
        self._stick_yaw.max_rate, self._stick_yaw.time_constant_s = (
            math.radians(value["MPC_MAN_Y_MAX"]),
            value["MPC_MAN_Y_TAU"],
        )
        self._max_acceleration = acceleration_at(value["MPC_MAN_TILT_MAX"])
        self._tilt_time_constant_s = float(value["MC_MAN_TILT_TAU"])

    def activate(self, last: TrajectorySetpoint) -> None:
        """Hold the heading there is."""
        self._stick_yaw.reset()
        self._stick_yaw.yaw = self._topics.vehicle_local_position.heading
        self._tilt = (0.0, 0.0)

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        local, sticks = self._topics.vehicle_local_position, self._topics.manual_control_setpoint
        down, sinking = (self._speed, NAN) if local.v_z_valid else (NAN, BLIND_M_S2)
        if self._takes_sticks and sticks.valid:
            return self._nudged(now_us, sticks, local.heading, (down, sinking), dt_s), self._limits
        if math.isnan(self._stick_yaw.yaw):
            self._stick_yaw.yaw = local.heading
        velocity, acceleration = (NAN, NAN, down), (0.0, 0.0, sinking)
        return TrajectorySetpoint(now_us, NAN3, velocity, acceleration, self._stick_yaw.yaw, NAN), self._limits

    def _nudged(
        self, now_us: int, sticks: ManualControlSetpoint, heading: float, descent: tuple[float, float], dt_s: float
    ) -> TrajectorySetpoint:
        """Speed and acceleration down, changed by throttle; tilt and heading by the other sticks."""
        turn, (down, sinking) = self._stick_yaw, descent
        turn.update(expo_deadzone(sticks.yaw, self._dead_zone), heading, dt_s)
        to = within_unit_length(sticks.pitch, sticks.roll)
        self._tilt = low_passed(self._tilt, to, self._tilt_time_constant_s, dt_s)
        north, east = north_east(*self._tilt, turn.yaw if math.isfinite(turn.yaw) else heading)
        down *= 1.0 - expo_deadzone(sticks.throttle, self._dead_zone)
        sinking -= sticks.throttle * THROTTLE_M_S2
        acceleration = (north * self._max_acceleration, east * self._max_acceleration, sinking)
        return TrajectorySetpoint(now_us, NAN3, (NAN, NAN, down), acceleration, turn.yaw, turn.yawspeed)
