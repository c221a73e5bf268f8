"""PX4's five controllers of an Ackermann rover, from one setpoint to the next (src/modules/rover_ackermann, v1.18).

Position -> speed and heading -> yaw rate -> steering; speed -> throttle; throttle and steering -> actuators. The
setpoints lie in `Setpoints`, where flight modes write them too; one that is NaN moves nothing, and what it would have
moved stays as it was. A step is PX4's time since the last one within 1 and 10 ms.
"""

import math
from typing import NamedTuple

from sitl_emu.autopilot.control.pure_pursuit import Place, lookahead_m, pursuit
from sitl_emu.autopilot.control.rover_control import (
    HeadingControl,
    Pid,
    Slew,
    SpeedControl,
    clamp,
    speed_limited_by_course,
)
from sitl_emu.autopilot.control.rover_parameters import EPSILON, RoverParameters
from sitl_emu.autopilot.modes.trajectory_constraints import max_speed_from_distance
from sitl_emu.autopilot.topics import PurePursuitStatus, RoverAttitudeStatus, RoverRateStatus, RoverSpeedStatus
from sitl_emu.core.geodesy import wrap_pi

NAN = math.nan


class RoverState(NamedTuple):
    """What the estimator says: metres, rad, m/s along the body (backwards is negative), rad/s.

    Speed and yaw rate are 0 below RO_SPEED_TH and RO_YAW_RATE_TH.
    """

    place: Place
    yaw: float
    speed: float
    yaw_rate: float
    xy_reset_counter: int


class Target(NamedTuple):
    """rover_position_setpoint: where to drive, along the line from where, and how fast. NaN for what is not said."""

    place: Place = (NAN, NAN)
    """NaN for nowhere."""
    start: Place = (NAN, NAN)
    """NaN for here."""
    arrival_speed: float = NAN
    """NaN for 0."""
    cruising_speed: float = NAN
    """NaN for RO_SPEED_LIM."""


class Setpoints:
    """The topics rover_*_setpoint as their controllers hold them."""

    __slots__ = ("speed", "steering", "target", "throttle", "yaw", "yaw_rate")

    def __init__(self) -> None:
        self.target: Target | None = None
        self.speed = self.yaw = self.yaw_rate = NAN
        self.throttle = self.steering = NAN

    def reset(self) -> None:
        """Forget all but throttle and steering, as PX4 does when other controllers take over."""
        self.target = None
        self.speed = self.yaw = self.yaw_rate = NAN


class PositionControl:
    """Where to drive -> how fast and in which direction (AckermannPosControl)."""

    def __init__(self) -> None:
        self.acceptance_m = 0.0
        """position_controller_status.acceptance_radius as it was told last."""
        self._taken: Target | None = None
        self._place: Place | None = None
        self._start: Place = (0.0, 0.0)
        self._stopped = False
        self._resets = 0

    def reset(self) -> None:
        """Nowhere to drive."""
        self._taken = self._place = None
        self._stopped = False

    def update(
        self, now_us: int, parameters: RoverParameters, setpoints: Setpoints, state: RoverState
    ) -> PurePursuitStatus | None:
        """From `setpoints.target` to speed and yaw; how its line is followed, None where none is."""
        target = setpoints.target
        if target is None or not math.isfinite(target.place[0] + target.place[1]):
            return None
        if target is not self._taken:
            self._taken, self._place, self._stopped = target, target.place, False
            self._start = target.start if math.isfinite(target.start[0] + target.start[1]) else state.place
        assert self._place is not None
        distance = math.dist(state.place, self._place)
        arrival = target.arrival_speed if math.isfinite(target.arrival_speed) else 0.0
        passes = arrival > EPSILON
        if passes:
            distance -= self.acceptance_m
        if distance <= self.acceptance_m and not passes:
            self._rest(setpoints, state)
            return None
        cruising = target.cruising_speed if math.isfinite(target.cruising_speed) else parameters.speed_limit
        speed = cruising
        if parameters.deceleration > EPSILON and parameters.jerk > EPSILON:
            jerk, deceleration = parameters.jerk, parameters.deceleration
            speed = min(max_speed_from_distance(jerk, deceleration, max(distance, 0.0), abs(arrival)), cruising)
        ahead_m = lookahead_m(speed, parameters.ahead_gain, parameters.ahead_min_m, parameters.ahead_max_m)
        followed = pursuit(now_us, self._place, self._start, state.place, ahead_m)
        bearing = followed.target_bearing
        setpoints.speed = speed = speed_limited_by_course(
            speed,
            bearing - state.yaw,
            parameters.full_throttle_speed,
            parameters.speed_reduction,
            parameters.least_cornering_speed,
        )
        setpoints.yaw = bearing if speed > -EPSILON else wrap_pi(bearing + math.pi)
        return followed

    def _rest(self, setpoints: Setpoints, state: RoverState) -> None:
        """Within the acceptance radius of a place to stop at: where it has come to rest is the place from then on."""
        setpoints.speed, setpoints.yaw = 0.0, state.yaw
        if not self._stopped and abs(state.speed) < EPSILON:
            self._stopped, self._place = True, state.place
        if self._stopped and state.xy_reset_counter != self._resets:
            self._place, self._resets = state.place, state.xy_reset_counter


class SpeedToThrottle:
    """Speed -> throttle (AckermannSpeedControl)."""

    def __init__(self) -> None:
        self._control = SpeedControl()
        self.reset = self._control.reset

    def update(self, parameters: RoverParameters, setpoints: Setpoints, state: RoverState, dt_s: float) -> None:
        """From `setpoints.speed` to throttle."""
        if not math.isfinite(setpoints.speed):
            return
        setpoints.throttle = self._control.update(
            clamp(setpoints.speed, -parameters.speed_limit, parameters.speed_limit),
            state.speed,
            (parameters.acceleration, parameters.deceleration),
            parameters.full_throttle_speed,
            (parameters.speed_p, parameters.speed_i),
            dt_s,
        )

    def status(self, now_us: int, state: RoverState) -> RoverSpeedStatus:
        """What it has come to."""
        return RoverSpeedStatus(now_us, state.speed, self._control.setpoint.value, self._control.pid.integral)


class HeadingToYawRate:
    """Heading -> yaw rate (AckermannAttControl). PX4's proportional PID keeps nothing that had to be reset."""

    def __init__(self) -> None:
        self._control = HeadingControl()

    def update(
        self, parameters: RoverParameters, setpoints: Setpoints, state: RoverState, motor: float, dt_s: float
    ) -> None:
        """From `setpoints.yaw` to yaw rate; `motor` is what the motor was told last."""
        if not math.isfinite(setpoints.yaw):
            return
        limit = parameters.yaw_rate_limit
        slew_rate = min(parameters.feasible_yaw_rate(motor * parameters.full_throttle_speed), limit)
        setpoints.yaw_rate = self._control.update(setpoints.yaw, state.yaw, slew_rate, parameters.yaw_p, limit, dt_s)

    def status(self, now_us: int, state: RoverState) -> RoverAttitudeStatus:
        """What it has come to."""
        return RoverAttitudeStatus(now_us, state.yaw, wrap_pi(self._control.setpoint))


class YawRateToSteering:
    """Yaw rate -> steering (AckermannRateControl): by geometry at the speed that the throttle gives, and a PID.

    The PID rests while it drives backwards.
    """

    def __init__(self) -> None:
        self._pid = Pid()
        self._setpoint = 0.0

    def reset(self) -> None:
        """Forget what the PID has learnt."""
        self._pid.integral = 0.0

    def update(
        self, parameters: RoverParameters, setpoints: Setpoints, state: RoverState, motor: float, dt_s: float
    ) -> None:
        """From `setpoints.yaw_rate` to steering; `motor` is what the motor was told last."""
        wanted = setpoints.yaw_rate
        if not math.isfinite(wanted):
            return
        speed = motor * parameters.full_throttle_speed
        if abs(speed) <= max(parameters.speed_threshold, EPSILON):
            self._pid.integral = setpoints.steering = 0.0
            return
        limit = min(parameters.feasible_yaw_rate(speed), parameters.yaw_rate_limit)
        wanted, setpoint, rate = clamp(wanted, -limit, limit), self._setpoint, parameters.yaw_acceleration
        if rate > EPSILON:
            if abs(setpoint - state.yaw_rate) > abs(wanted - state.yaw_rate):
                setpoint = state.yaw_rate
            setpoint += clamp(wanted - setpoint, -rate * dt_s, rate * dt_s)
        else:
            setpoint = wanted
        self._setpoint = setpoint
        angle = math.atan(setpoint * parameters.wheel_base_m / speed) * parameters.yaw_rate_correction
        if speed > EPSILON:
            error = setpoint - state.yaw_rate
            angle += self._pid.update(error, parameters.yaw_rate_p, parameters.yaw_rate_i, 1.0, dt_s)
        setpoints.steering = clamp(angle / parameters.max_steering_rad, -1.0, 1.0)

    def status(self, now_us: int, state: RoverState) -> RoverRateStatus:
        """What it has come to."""
        return RoverRateStatus(now_us, state.yaw_rate, self._setpoint, self._pid.integral)


class Actuators:
    """Throttle and steering -> motor and servo, each at a limited rate (AckermannActControl)."""

    def __init__(self) -> None:
        self.motor = self.servo = 0.0
        """actuator_motors and actuator_servos as they were told last: -1..1."""
        self._motor_slew = Slew()
        self._servo_slew = 0.0

    def update(self, parameters: RoverParameters, setpoints: Setpoints, dt_s: float) -> None:
        """One step."""
        throttle, steering = setpoints.throttle, setpoints.steering
        if math.isfinite(throttle):
            faster = abs(throttle) > abs(self.motor)
            limit = parameters.acceleration if faster else parameters.deceleration
            full = parameters.full_throttle_speed
            rate = limit / full if limit > EPSILON and full > EPSILON else 0.0
            self.motor = self._motor_slew.towards(throttle, rate, self.motor, dt_s)
        if math.isfinite(steering):
            if parameters.steering_rate > 0.0:
                if abs(self._servo_slew - self.servo) > abs(steering - self.servo):
                    self._servo_slew = self.servo
                most = parameters.steering_rate * dt_s
                self._servo_slew += clamp(steering - self._servo_slew, -most, most)
            else:
                self._servo_slew = steering
            self.servo = self._servo_slew

    def told(self, motor: float, servo: float) -> None:
        """Another has told both; what is no number is 0, from where they would go on."""
        self.motor, self.servo = (value if math.isfinite(value) else 0.0 for value in (motor, servo))

    def stop(self) -> None:
        """Tell both to do nothing, at once."""
        self.motor = self.servo = 0.0
