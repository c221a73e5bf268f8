"""ALTCTL: sticks tilt the vehicle and command its climb rate; the height is held when the throttle is centred.

Behaves as PX4's FlightTaskManualAltitudeSmoothVel (v1.18) with StickTiltXY and ManualVelocitySmoothingZ:
MPC_MAN_TILT_MAX, MPC_Z_VEL_MAX_*, MPC_ACC_*_MAX, MPC_JERK_MAX, MPC_MAN_Y_MAX, MAN_DEADZONE. It follows no
terrain (MPC_ALT_MODE).
"""

import math

from sitl_emu.autopilot.modes.flight_task import Setpoint, start_state
from sitl_emu.autopilot.modes.sticks import StickYaw, centred, expo_deadzone, heading_frame
from sitl_emu.autopilot.modes.velocity_smoothing import VelocitySmoothing
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import ManualControlSetpoint, Topics, TrajectorySetpoint, VehicleConstraints

NAN = math.nan
GRAVITY = 9.80665
TAKEOFF_THROTTLE = 0.3
LOCK_SPEED = 0.1
LOCK_ACCELERATION = 0.2


class ManualAltitude:
    """The flight task of ALTCTL, and the vertical half of POSCTL and ORBIT."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._z = VelocitySmoothing()
        self._locked = False
        self._z_reset_counter = 0
        self._stick_yaw = StickYaw()
        self._tilt = (0.0, 0.0)
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        parameters = self._parameters
        self._speed_up, self._speed_down = parameters["MPC_Z_VEL_MAX_UP"], parameters["MPC_Z_VEL_MAX_DN"]
        self._acceleration_up, self._acceleration_down = parameters["MPC_ACC_UP_MAX"], parameters["MPC_ACC_DOWN_MAX"]
        self._z.max_jerk = parameters["MPC_JERK_MAX"]
        self._dead_zone = parameters["MAN_DEADZONE"]
        self._max_acceleration = math.tan(math.radians(parameters["MPC_MAN_TILT_MAX"])) * GRAVITY
        self._tilt_time_constant_s = parameters["MC_MAN_TILT_TAU"]
        self._stick_yaw.max_rate = math.radians(parameters["MPC_MAN_Y_MAX"])
        self._stick_yaw.time_constant_s = parameters["MPC_MAN_Y_TAU"]

    def activate(self, last: TrajectorySetpoint) -> None:
        """Go on from the last setpoint."""
        local = self._topics.vehicle_local_position
        position, velocity, acceleration = start_state(last, local)
        self._z.reset(position[2], velocity[2], acceleration[2])
        self._locked = math.isfinite(last.position[2]) and abs(velocity[2]) < LOCK_SPEED
        self._z_reset_counter = local.z_reset_counter
        self._stick_yaw.reset(last.yaw if math.isfinite(last.yaw) else local.heading)
        self._tilt = (0.0, 0.0)

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        sticks = centred(self._topics.manual_control_setpoint)
        heading = self._topics.vehicle_local_position.heading
        z, vz, az = self._vertical(sticks.throttle, dt_s)
        yaw = self._stick_yaw
        yaw.update(expo_deadzone(sticks.yaw, self._dead_zone), heading, dt_s)
        share = dt_s / (max(self._tilt_time_constant_s, 0.0) + dt_s)
        forward, right = self._tilt
        self._tilt = (forward + (sticks.pitch - forward) * share, right + (sticks.roll - right) * share)
        north, east = heading_frame(*self._tilt, heading if math.isnan(yaw.yaw) else yaw.yaw)
        acceleration = (north * self._max_acceleration, east * self._max_acceleration, az)
        setpoint = TrajectorySetpoint(now_us, (NAN, NAN, z), (NAN, NAN, vz), acceleration, yaw.yaw, yaw.yawspeed)
        return setpoint, self._constraints(sticks)

    def _constraints(self, sticks: ManualControlSetpoint) -> VehicleConstraints:
        return VehicleConstraints(self._speed_up, self._speed_down, sticks.throttle > TAKEOFF_THROTTLE)

    def _vertical(self, throttle: float, dt_s: float) -> tuple[float, float, float]:
        """Height (NaN while it is not held), velocity and acceleration down for a throttle of -1..1."""
        topics = self._topics
        local = topics.vehicle_local_position
        z = self._z
        stick = -expo_deadzone(throttle, self._dead_zone)
        target = stick * (self._speed_down if stick > 0.0 else self._speed_up)
        if local.z_reset_counter != self._z_reset_counter:
            self._z_reset_counter = local.z_reset_counter
            z.reset(local.z, local.vz, z.acceleration)
        if self._locked and target:
            # The position loop ends: go on with the velocity that it has asked for.
            self._locked = False
            feedback = topics.vehicle_local_position_setpoint.vz
            z.force_velocity(feedback if math.isfinite(feedback) else local.vz)
        if target < 0.0:
            z.max_velocity, z.max_acceleration = self._speed_up, self._acceleration_up
        else:
            z.max_velocity, z.max_acceleration = self._speed_down, self._acceleration_down
            if not target:
                z.max_velocity = max(self._speed_up, self._speed_down)
        z.update_trajectory(dt_s)
        z.update_durations(target)
        if not target and not self._locked and abs(z.velocity) < LOCK_SPEED and abs(z.acceleration) < LOCK_ACCELERATION:
            self._locked = True
            z.force_position(local.z)
        return z.position if self._locked else NAN, z.velocity, z.acceleration
