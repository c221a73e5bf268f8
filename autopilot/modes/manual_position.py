"""POSCTL: sticks accelerate the vehicle against a drag that limits its speed; centred, it brakes and holds its place.

Behaves as PX4's FlightTaskManualAcceleration (v1.18, MPC_POS_MODE 4) with StickAccelerationXY: MPC_VEL_MANUAL,
MPC_ACC_HOR, MPC_JERK_MAX, with collision prevention (CP_DIST). The other two values of MPC_POS_MODE fly the same.
"""

import math

from sitl_emu.autopilot.modes.collision_prevention import CollisionPrevention
from sitl_emu.autopilot.modes.flight_task import Setpoint, start_state
from sitl_emu.autopilot.modes.manual_altitude import GRAVITY, ManualAltitude
from sitl_emu.autopilot.modes.sticks import centred, expo_deadzone, heading_frame
from sitl_emu.autopilot.modes.vectors import shortened
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, TrajectorySetpoint

NAN = math.nan
BRAKE_BOOST_MIN = 2.0
BRAKE_TIME_CONSTANT_S = 0.8
EPSILON = 1.2e-7


class ManualPosition(ManualAltitude):
    """The flight task of POSCTL."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._velocity = (0.0, 0.0)
        self._stick_acceleration = (0.0, 0.0)
        self._held: tuple[float, float] | None = None
        self._brake_boost = 1.0
        self._xy_reset_counter = 0
        self._now_us = 0
        self._collision_prevention = CollisionPrevention(topics, parameters)
        super().__init__(topics, parameters)

    def refresh(self) -> None:
        """Copy the parameters."""
        super().refresh()
        parameters = self._parameters
        # Because of the drag the mean acceleration is half of the stick's.
        self._acceleration = 2.0 * parameters["MPC_ACC_HOR"]
        velocity = max(parameters["MPC_VEL_MANUAL"], 0.1)
        self._drag = self._acceleration / velocity
        self._braking = max(BRAKE_BOOST_MIN, math.sqrt(velocity))
        self._jerk = parameters["MPC_JERK_MAX"]
        self._collision_prevention.refresh(parameters)

    def activate(self, last: TrajectorySetpoint) -> None:
        """Go on from the last setpoint."""
        super().activate(last)
        local = self._topics.vehicle_local_position
        _, velocity, acceleration = start_state(last, local)
        self._velocity = velocity[:2]
        self._stick_acceleration = acceleration[:2]
        self._held = None
        self._brake_boost = 1.0
        self._xy_reset_counter = local.xy_reset_counter

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        topics = self._topics
        self._now_us = now_us
        local = topics.vehicle_local_position
        sticks = centred(topics.manual_control_setpoint)
        z, vz, az = self._vertical(sticks.throttle, dt_s)
        yaw = self._stick_yaw
        yaw.update(expo_deadzone(sticks.yaw, self._dead_zone), local.heading, dt_s)
        forward, right = expo_deadzone(sticks.pitch, self._dead_zone), expo_deadzone(sticks.roll, self._dead_zone)
        north, east = heading_frame(forward, right, local.heading if math.isnan(yaw.yaw) else yaw.yaw)
        ax, ay = self._accelerate(north, east, dt_s)
        x, y = self._hold()
        vx, vy = self._velocity
        setpoint = TrajectorySetpoint(now_us, (x, y, z), (vx, vy, vz), (ax, ay, az), yaw.yaw, yaw.yawspeed)
        return setpoint, self._constraints(sticks)

    def _accelerate(self, north: float, east: float, dt_s: float) -> tuple[float, float]:
        """Acceleration by sticks and drag, integrated to the velocity setpoint."""
        step = self._jerk * dt_s if self._jerk > 0.0 else math.inf
        ax, ay = self._stick_acceleration
        ax += max(-step, min(step, north * self._acceleration - ax))
        ay += max(-step, min(step, east * self._acceleration - ay))
        self._stick_acceleration = ax, ay
        if self._collision_prevention.active:
            ax, ay = self._collision_prevention.limit(self._now_us, (ax, ay), self._velocity)
        vx, vy = self._velocity
        speed = math.sqrt(vx * vx + vy * vy)
        boost = self._braking if north == 0.0 and east == 0.0 else 1.0
        self._brake_boost += (boost - self._brake_boost) * dt_s / (BRAKE_TIME_CONSTANT_S + dt_s)
        # Below 1 m/s the drag follows the square root, so that the vehicle does stop.
        drag = self._drag * self._brake_boost * (math.sqrt(speed) if speed < 1.0 else speed)
        if ax * ax + ay * ay < EPSILON and speed <= drag * dt_s:
            self._velocity = (0.0, 0.0)
            return 0.0, 0.0
        if speed > 0.0:
            ax -= drag * vx / speed
            ay -= drag * vy / speed
        tilt = self._topics.takeoff_status.tilt_limit
        if math.isfinite(tilt):
            ax, ay = shortened(ax, ay, math.tan(tilt) * GRAVITY)
        self._velocity = (vx + ax * dt_s, vy + ay * dt_s)
        return ax, ay

    def _hold(self) -> tuple[float, float]:
        """Place that is held, NaN while the setpoint moves."""
        local = self._topics.vehicle_local_position
        vx, vy = self._velocity
        moving = vx * vx + vy * vy > EPSILON
        if self._held and local.xy_reset_counter != self._xy_reset_counter:
            self._held = (local.x, local.y)
        self._xy_reset_counter = local.xy_reset_counter
        if not moving and self._held is None:
            self._held = (local.x, local.y)
        elif moving and self._held is not None:
            self._held = None
            feedback = self._topics.vehicle_local_position_setpoint
            if math.isfinite(feedback.vx) and math.isfinite(feedback.vy):
                # The position loop ends: go on with the velocity that it has asked for.
                self._velocity = (feedback.vx, feedback.vy)
        return self._held or (NAN, NAN)
