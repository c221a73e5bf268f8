"""Rover with Ackermann steering: modes, position, speed, heading, yaw rate and the two actuators.

Behaves as PX4's rover_ackermann (src/modules/rover_ackermann, v1.18), which runs its own modes: MANUAL, ACRO, STAB,
POSCTL, AUTO_* and OFFBOARD with position or velocity. Pure pursuit to the target; it brakes by RO_DECEL_LIM and
RO_JERK_LIM, slows down for corners and while it heads elsewhere by RO_SPEED_RED, and turns a yaw rate into a steering
angle by the wheelbase and a PID, which rests while it reverses. Its quirks are kept: a target passed is not sought, and
a velocity of zero asks for a heading of north. ORBIT and modes of aircraft stop it. It does not reverse on its own.
"""

import math
from typing import NamedTuple

from autopilot.constants import NavState, SetpointType
from autopilot.control.actuator_test import ActuatorTests
from autopilot.control.peripherals import last_used, with_peripherals
from autopilot.control.pure_pursuit import Place, lookahead_m, target_bearing
from autopilot.control.rover_control import (
    Pid,
    SpeedControl,
    approach_speed,
    arrival_speed,
    corner_angle,
    least_cornering_speed,
    slew,
    speed_limited_by_course,
)
from autopilot.parameters import Parameters
from autopilot.topics import (
    ActuatorOutputs,
    PositionSetpoint,
    PositionSetpointTriplet,
    Topics,
    TrajectorySetpoint,
    VehicleLocalPosition,
)
from sitl_emu.core.geodesy import MapProjection, wrap_pi

NAN = math.nan
LONGEST_STEP_S = 0.1
STEERING_FUNCTION, MOTOR_FUNCTION = 201, 101
STEEPEST = 0.99
"""Dead zone and super-exponential curve of a stick at most (PX4: math::superexpo, math::deadzone)."""
OUTPUTS = 16
PWM_CENTRE, PWM_RANGE, PWM_DISARMED = 1500, 500, 900
LATENCY_US = 80_000
"""How long PX4's rover takes to act on another mode or triplet, as its drives show."""
AUTO = frozenset(
    (
        NavState.AUTO_MISSION,
        NavState.AUTO_LOITER,
        NavState.AUTO_RTL,
        NavState.AUTO_TAKEOFF,
        NavState.AUTO_LAND,
        NavState.AUTO_PRECLAND,
    )
)
STICKS = frozenset((NavState.MANUAL, NavState.ACRO, NavState.STAB, NavState.POSCTL, NavState.POSITION_SLOW))


class Target(NamedTuple):
    """rover_position_setpoint: where to drive, along which line, and how fast."""

    place: Place
    start: Place
    arrival_speed: float = 0.0
    cruising_speed: float = NAN
    acceptance_m: float = NAN
    """NaN for NAV_ACC_RAD."""


class Course(NamedTuple):
    """A line that POSCTL drives along: where it began, and its direction (unit vector, north and east)."""

    start: Place
    along: Place


class RoverAckermannControl:
    """Writer of actuator_outputs for a rover."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._speed_control = SpeedControl()
        self._yaw_rate_pid = Pid()
        self._projection: MapProjection | None = None
        self._reference_timestamp = -1
        self._triplet: PositionSetpointTriplet | None = None
        self._waypoint: PositionSetpoint | None = None
        self._offboard: TrajectorySetpoint | None = None
        self._target: Target | None = None
        self._course: Course | None = None
        self._held_yaw = NAN
        self._nav_state: NavState | None = None
        self._updated_us = 0
        self._yaw_rate_setpoint = 0.0
        self._throttle = self._steering = 0.0
        self._tests = ActuatorTests(topics)
        self._version = -1
        self._refresh()

    def update_position(self, now_us: int) -> None:
        """All controllers, at 125 Hz."""
        topics = self._topics
        dt_s = min((now_us - self._updated_us) * 1e-6, LONGEST_STEP_S)
        self._updated_us = now_us
        if self._version != self._parameters.version:
            self._refresh()
        if not topics.actuator_armed.armed or topics.actuator_armed.manual_lockdown:
            self._stop(now_us)
            if self._tests.due:
                self._test(now_us)
            return
        local = topics.vehicle_local_position
        status = topics.vehicle_status
        nav_state = status.nav_state
        if nav_state != self._nav_state and self._nav_state is not None:
            nav_state = nav_state if now_us - status.nav_state_timestamp >= LATENCY_US else self._nav_state
        if nav_state != self._nav_state:
            self._nav_state = nav_state
            self._triplet = self._waypoint = self._offboard = self._target = self._course = None
            self._held_yaw = NAN
        heading = local.heading
        forward = local.vx * math.cos(heading) + local.vy * math.sin(heading)
        size = math.hypot(local.vx, local.vy)
        speed = math.copysign(size, forward) if size > self._speed_threshold else 0.0
        if nav_state in AUTO:
            self._update_waypoint(topics.position_setpoint_triplet, local)
            throttle, steering = self._to_target(self._target, local, speed, dt_s)
        elif nav_state == NavState.OFFBOARD:
            throttle, steering = self._fly_offboard(local, speed, dt_s)
        elif nav_state in STICKS:
            throttle, steering = self._fly_sticks(nav_state, local, speed, dt_s)
        else:
            throttle, steering = self._speed_control.update(0.0, speed, dt_s), 0.0
        self._actuate(now_us, throttle, steering, dt_s)

    def update_rate(self, now_us: int) -> None:
        """Nothing to do between the steps of `update_position`, but to stop at once when disarmed."""
        actuators = self._topics.actuator_armed
        if self._throttle and (not actuators.armed or actuators.manual_lockdown):
            self._stop(now_us)

    # --- modes -------------------------------------------------------------------------------------------

    def _update_waypoint(self, triplet: PositionSetpointTriplet, local: VehicleLocalPosition) -> None:
        """`_target` from the navigator's triplet, whenever that changes."""
        if local.ref_timestamp != self._reference_timestamp and math.isfinite(local.ref_lat):
            self._reference_timestamp = local.ref_timestamp
            self._projection = MapProjection(local.ref_lat, local.ref_lon)
            self._triplet = None
        if triplet is self._triplet or self._updated_us - triplet.timestamp < LATENCY_US:
            return
        self._triplet = triplet
        current = triplet.current
        place = self._local(current)
        if place is None:
            self._target = self._waypoint = None
            return
        here = (local.x, local.y)
        start = self._local(triplet.previous)
        if start is None:
            known = self._waypoint
            same = known is not None and known.lat == current.lat and known.lon == current.lon
            start = self._target.start if same and self._target else here
        self._waypoint = current
        then = self._local(triplet.next)
        angle = corner_angle(start, place, then) if then else NAN
        stops = current.type in (SetpointType.LAND, SetpointType.IDLE)
        cruising = current.cruising_speed if current.cruising_speed > 0.0 else self._speed_limit
        cruising = min(cruising, self._speed_limit)
        leaving = 0.0
        if not stops:
            leaving = arrival_speed(angle, self._full_throttle_speed, self._reduction, self._least_speed, cruising)
        self._target = Target(place, start, leaving, cruising, current.acceptance_radius)

    def _fly_offboard(self, local: VehicleLocalPosition, speed: float, dt_s: float) -> tuple[float, float]:
        setpoint = self._topics.offboard_setpoint.trajectory
        if setpoint is None:
            return self._speed_control.update(0.0, speed, dt_s), 0.0
        north, east, _ = setpoint.position
        if math.isfinite(north) and math.isfinite(east):
            if setpoint is not self._offboard:
                self._offboard = setpoint
                self._target = Target((north, east), (local.x, local.y))
            return self._to_target(self._target, local, speed, dt_s)
        vn, ve, _ = setpoint.velocity
        if math.isfinite(vn) and math.isfinite(ve):
            return self._to_course(math.hypot(vn, ve), math.atan2(ve, vn), local.heading, speed, dt_s)
        return self._speed_control.update(0.0, speed, dt_s), 0.0

    def _fly_sticks(
        self, nav_state: NavState, local: VehicleLocalPosition, speed: float, dt_s: float
    ) -> tuple[float, float]:
        sticks = self._topics.manual_control_setpoint
        throttle, roll = (sticks.throttle, sticks.roll) if sticks.valid else (0.0, 0.0)
        if nav_state == NavState.MANUAL:
            return throttle, roll
        direction = math.copysign(1.0, throttle) if throttle else 0.0
        if nav_state == NavState.ACRO:
            return throttle, self._steer(direction * self._yaw_rate_of_stick(roll, 0.0), dt_s)
        yaw_rate = direction * self._yaw_rate_of_stick(roll, self._stick_dead_zone)
        steers = bool(roll) or not throttle
        if nav_state in (NavState.POSCTL, NavState.POSITION_SLOW):
            wanted = throttle * self._speed_limit
            if steers:
                self._course = None
                return self._speed_control.update(wanted, speed, dt_s), self._steer(yaw_rate, dt_s)
            return self._along_course(wanted, local, speed, dt_s)
        if steers:
            self._held_yaw = NAN
            return throttle, self._steer(yaw_rate, dt_s)
        if math.isnan(self._held_yaw):
            self._held_yaw = local.heading
        return throttle, self._steer(self._turn(self._held_yaw, local.heading), dt_s)

    def _along_course(
        self, wanted: float, local: VehicleLocalPosition, speed: float, dt_s: float
    ) -> tuple[float, float]:
        """POSCTL with a centred steering stick: on along the line on which it was centred.

        The place to drive to stays out of reach of the look-ahead.
        """
        if self._course is None:
            self._course = Course((local.x, local.y), (math.cos(local.heading), math.sin(local.heading)))
        (start_n, start_e), (along_n, along_e) = self._course
        gone = abs((local.x - start_n) * along_n + (local.y - start_e) * along_e)
        reach = math.copysign(gone + self._ahead_max_m, wanted)
        place = (start_n + reach * along_n, start_e + reach * along_e)
        target = Target(place, self._course.start, cruising_speed=wanted)
        return self._to_target(target, local, speed, dt_s)

    # --- controllers -------------------------------------------------------------------------------------

    def _to_target(
        self, target: Target | None, local: VehicleLocalPosition, speed: float, dt_s: float
    ) -> tuple[float, float]:
        """Throttle and steering on the way to a place, or to stop there."""
        if target is None:
            return self._speed_control.update(0.0, speed, dt_s), self._steer(0.0, dt_s)
        here = (local.x, local.y)
        distance = math.dist(here, target.place)
        acceptance_m = target.acceptance_m if math.isfinite(target.acceptance_m) else self._acceptance_m
        if distance <= acceptance_m:
            return self._to_course(0.0, local.heading, local.heading, speed, dt_s)
        if target.arrival_speed > 0.0:
            distance -= acceptance_m
        wanted = approach_speed(distance, target.arrival_speed, self._jerk, self._deceleration)
        wanted = min(wanted, target.cruising_speed if math.isfinite(target.cruising_speed) else self._speed_limit)
        ahead_m = lookahead_m(wanted, self._ahead_gain, self._ahead_min_m, self._ahead_max_m)
        bearing = target_bearing(target.place, target.start, here, ahead_m)
        error = bearing - local.heading
        wanted = speed_limited_by_course(wanted, error, self._full_throttle_speed, self._reduction, self._least_speed)
        if wanted < 0.0:
            bearing += math.pi
        return self._to_course(wanted, bearing, local.heading, speed, dt_s)

    def _to_course(self, wanted: float, yaw: float, heading: float, speed: float, dt_s: float) -> tuple[float, float]:
        """Throttle and steering for a speed and a heading."""
        limit = self._speed_limit
        wanted = max(-limit, min(limit, wanted))
        return self._speed_control.update(wanted, speed, dt_s), self._steer(self._turn(yaw, heading), dt_s)

    def _turn(self, yaw: float, heading: float) -> float:
        """Yaw rate towards a heading."""
        limit = self._yaw_rate_limit
        return max(-limit, min(limit, self._yaw_gain * wrap_pi(yaw - heading)))

    def _steer(self, yaw_rate: float, dt_s: float) -> float:
        """Steering of -1..1 for a yaw rate, at the speed that the throttle gives."""
        speed = self._throttle * self._full_throttle_speed
        if abs(speed) <= self._speed_threshold:
            self._yaw_rate_pid.integral = 0.0
            self._yaw_rate_setpoint = 0.0
            return 0.0
        feasible = abs(speed) * math.tan(self._max_angle) / self._wheel_base
        limit = min(feasible, self._yaw_rate_limit)
        yaw_rate = max(-limit, min(limit, yaw_rate))
        measured = self._topics.vehicle_angular_velocity.xyz[2]
        measured = measured if abs(measured) > self._yaw_rate_threshold else 0.0
        rate = self._yaw_acceleration if abs(yaw_rate) >= abs(measured) else self._yaw_deceleration
        setpoint = self._yaw_rate_setpoint = slew(self._yaw_rate_setpoint, yaw_rate, rate, dt_s)
        angle = math.atan(setpoint * self._yaw_rate_correction * self._wheel_base / speed)
        if speed > 0.0:
            angle += self._yaw_rate_pid.update(setpoint - measured, dt_s)
        return max(-1.0, min(1.0, angle / self._max_angle))

    def _yaw_rate_of_stick(self, stick: float, dead_zone: float) -> float:
        """Yaw rate for the steering stick: dead zone, curve (RO_YAW_EXPO, RO_YAW_SUPEXPO), limit."""
        size = abs(stick)
        if size <= dead_zone:
            return 0.0
        moved = (size - dead_zone) / (1.0 - dead_zone)
        curved = (1.0 - self._stick_expo) * moved + self._stick_expo * moved**3
        curved *= (1.0 - self._stick_super_expo) / (1.0 - moved * self._stick_super_expo)
        return math.copysign(curved * self._yaw_rate_limit, stick)

    # --- actuators ---------------------------------------------------------------------------------------

    def _actuate(self, now_us: int, throttle: float, steering: float, dt_s: float) -> None:
        faster = abs(throttle) >= abs(self._throttle)
        rate = self._throttle_up if faster else self._throttle_down
        self._throttle = max(-1.0, min(1.0, slew(self._throttle, throttle, rate, dt_s)))
        self._steering = max(-1.0, min(1.0, slew(self._steering, steering, self._steering_rate, dt_s)))
        motor = self._throttle if self._reversible else max(self._throttle, 0.0)
        values = {STEERING_FUNCTION: self._steering, MOTOR_FUNCTION: motor}
        controls = tuple(values.get(function, 0.0) for function in self._functions)
        pwm = tuple(round(PWM_CENTRE + PWM_RANGE * value) for value in controls)
        outputs = ActuatorOutputs(now_us, controls, pwm)
        self._topics.actuator_outputs = with_peripherals(self._topics, self._functions, outputs)

    def _stop(self, now_us: int) -> None:
        """Disarmed: nothing moves, and everything begins anew."""
        self._speed_control.reset(0.0)
        self._yaw_rate_pid.integral = self._yaw_rate_setpoint = 0.0
        self._throttle = self._steering = 0.0
        self._nav_state = None
        self._topics.actuator_outputs = ActuatorOutputs(now_us, self._stopped, self._stopped_pwm)

    def _test(self, now_us: int) -> None:
        """Disarmed, and an actuator is tried out."""
        if not self._tests.update(now_us, self._functions):
            self._topics.actuator_outputs = self._topics.actuator_outputs._replace(test_mode=True)
            return
        outputs = [
            self._tests.outputs(function, lambda thrust: thrust, self._reversible) for function in self._functions
        ]
        controls, pwm = zip(*outputs, strict=True)
        self._topics.actuator_outputs = ActuatorOutputs(now_us, controls, pwm, test_mode=True)

    # --- helpers -----------------------------------------------------------------------------------------

    def _local(self, setpoint: PositionSetpoint) -> Place | None:
        if not setpoint.valid or self._projection is None or not math.isfinite(setpoint.lat + setpoint.lon):
            return None
        return self._projection.project(setpoint.lat, setpoint.lon)

    def _refresh(self) -> None:
        parameters = self._parameters
        self._version = parameters.version
        get = parameters.__getitem__
        self._wheel_base = max(get("RA_WHEEL_BASE"), 1e-3)
        self._max_angle = max(get("RA_MAX_STR_ANG"), 1e-3)
        self._steering_rate = math.radians(get("RA_STR_RATE_LIM")) / self._max_angle
        self._acceptance_m = get("NAV_ACC_RAD")
        self._speed_limit = max(get("RO_SPEED_LIM"), 0.0)
        self._speed_threshold = max(get("RO_SPEED_TH"), 0.0)
        self._full_throttle_speed = get("RO_MAX_THR_SPEED")
        self._deceleration, self._jerk = get("RO_DECEL_LIM"), get("RO_JERK_LIM")
        self._reduction = get("RO_SPEED_RED")
        self._throttle_up = self._throttle_down = 0.0
        if self._full_throttle_speed > 0.0:
            self._throttle_up = get("RO_ACCEL_LIM") / self._full_throttle_speed
            self._throttle_down = get("RO_DECEL_LIM") / self._full_throttle_speed
        speed_control = self._speed_control
        speed_control.acceleration, speed_control.deceleration = get("RO_ACCEL_LIM"), get("RO_DECEL_LIM")
        speed_control.full_throttle_speed = self._full_throttle_speed
        speed_control.pid.gain_p, speed_control.pid.gain_i = get("RO_SPEED_P"), get("RO_SPEED_I")
        self._yaw_gain = get("RO_YAW_P")
        self._yaw_rate_limit = math.radians(get("RO_YAW_RATE_LIM"))
        self._yaw_rate_threshold = math.radians(get("RO_YAW_RATE_TH"))
        self._least_speed = least_cornering_speed(self._wheel_base, self._yaw_rate_limit, self._max_angle)
        self._yaw_acceleration = math.radians(get("RO_YAW_ACCEL_LIM"))
        self._yaw_deceleration = math.radians(get("RO_YAW_DECEL_LIM"))
        self._yaw_rate_correction = get("RO_YAW_RATE_CORR")
        self._yaw_rate_pid.gain_p, self._yaw_rate_pid.gain_i = get("RO_YAW_RATE_P"), get("RO_YAW_RATE_I")
        self._stick_dead_zone = max(0.0, min(STEEPEST, get("RO_YAW_STICK_DZ")))
        self._stick_expo = max(0.0, min(1.0, get("RO_YAW_EXPO")))
        self._stick_super_expo = max(0.0, min(STEEPEST, get("RO_YAW_SUPEXPO")))
        self._ahead_gain = get("PP_LOOKAHD_GAIN")
        self._ahead_min_m, self._ahead_max_m = get("PP_LOOKAHD_MIN"), get("PP_LOOKAHD_MAX")
        self._reversible = bool(int(get("CA_R_REV")) & 1)
        functions = [int(get(f"PWM_MAIN_FUNC{n}")) for n in range(1, OUTPUTS + 1)]
        used = [function in (STEERING_FUNCTION, MOTOR_FUNCTION) for function in functions]
        self._functions = functions = functions[: last_used(functions, used)]
        self._stopped = (0.0,) * len(functions)
        self._stopped_pwm = (PWM_DISARMED,) * len(functions)
