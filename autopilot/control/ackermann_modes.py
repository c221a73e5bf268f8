"""What each mode gives an Ackermann rover to do (PX4's rover_ackermann/AckermannDriveModes, v1.18).

Its quirks are kept: an invalid place of the triplet is where the rover is; a velocity of zero asks for a heading of
north; sticks that have fallen silent stay as they were. Modes of aircraft give nothing to do.
"""

import math
from typing import NamedTuple

from sitl_emu.autopilot.commander.control_mode import asks_for_position, has_any, is_of_mode
from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.control.ackermann_controllers import NAN, RoverState, Setpoints, Target
from sitl_emu.autopilot.control.pure_pursuit import Place
from sitl_emu.autopilot.control.rover_control import arrival_speed, clamp, corner_angle
from sitl_emu.autopilot.control.rover_parameters import EPSILON, RoverParameters
from sitl_emu.autopilot.topics import (
    PositionControllerStatus,
    PositionSetpoint,
    RoverSetpoint,
    Topics,
    TrajectorySetpoint,
)
from sitl_emu.core.c_types import quotient
from sitl_emu.core.geodesy import MapProjection

STANDSTILL = TrajectorySetpoint(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0))
"""trajectory_setpoint before anybody published one: zeros."""


class AutoMode:
    """MISSION, HOLD and RETURN: whenever the navigator publishes a triplet. Writer of position_controller_status."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._seen = topics.position_setpoint_triplet
        self._projection: MapProjection | None = None
        self._reference_timestamp = -1

    def generate(self, now_us: int, parameters: RoverParameters, setpoints: Setpoints, state: RoverState) -> None:
        """From a new triplet to `setpoints.target`."""
        triplet = self._topics.position_setpoint_triplet
        if triplet is self._seen:
            return
        self._seen = triplet
        self._follow_reference()
        current = triplet.current
        place = self._local(current) or state.place
        start = self._local(triplet.previous) or state.place
        then = self._local(triplet.next)
        angle = corner_angle(start, place, then) if then is not None else NAN
        if parameters.acceptance_max_m >= parameters.acceptance_m:
            radius = acceptance_radius_m(angle, parameters)
            self._topics.position_controller_status = PositionControllerStatus(now_us, radius)
        cruising = parameters.speed_limit
        if current.cruising_speed > 0.0:
            cruising = clamp(current.cruising_speed, 0.0, parameters.speed_limit)
        leaving = 0.0
        if current.type not in (SetpointType.LAND, SetpointType.IDLE):
            full, reduction = parameters.full_throttle_speed, parameters.speed_reduction
            leaving = arrival_speed(angle, full, reduction, parameters.least_cornering_speed, cruising)
        setpoints.target = Target(place, start, leaving, cruising)

    def _follow_reference(self) -> None:
        local = self._topics.vehicle_local_position
        if local.ref_timestamp != self._reference_timestamp and math.isfinite(local.ref_lat):
            self._reference_timestamp = local.ref_timestamp
            self._projection = MapProjection(local.ref_lat, local.ref_lon)

    def _local(self, setpoint: PositionSetpoint) -> Place | None:
        if not setpoint.valid or self._projection is None or not math.isfinite(setpoint.lat + setpoint.lon):
            return None
        return self._projection.project(setpoint.lat, setpoint.lon)


def acceptance_radius_m(angle_rad: float, parameters: RoverParameters) -> float:
    """How near a waypoint counts as reached: where the smallest turning circle touches both legs of the corner.

    RA_ACC_RAD_GAIN times that, between NAV_ACC_RAD and RA_ACC_RAD_MAX; without a corner (NaN) NAV_ACC_RAD.
    """
    if not math.isfinite(angle_rad):
        return parameters.acceptance_m
    turning_m = quotient(parameters.wheel_base_m, math.sin(parameters.max_steering_rad))
    touches_m = quotient(parameters.acceptance_gain * turning_m, math.tan(angle_rad / 2.0))
    return clamp(touches_m, parameters.acceptance_m, parameters.acceptance_max_m)


class OffboardMode:
    """OFFBOARD with positions or velocities. A setpoint counts only from the first that came in the mode.

    Asked for anything else the mode writes nothing (AckermannOffboardMode.cpp): by an acceleration alone the rover
    drives on as it did. ROS 2 then writes what the controllers that run take, each message once. What a controller
    makes itself, it writes over that.
    """

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._trajectory = STANDSTILL
        self._taken = RoverSetpoint()

    def publish(self) -> None:
        """What has come in the mode, as PX4's MAVLink does, whatever the vehicle makes of it (mavlink_receiver.cpp)."""
        topics, status = self._topics, self._topics.vehicle_status
        offboard = topics.offboard_setpoint
        trajectory, attitude, rates = offboard.trajectory, offboard.attitude, offboard.rates
        if trajectory is not None and is_of_mode(trajectory.timestamp, status):
            self._trajectory = topics.trajectory_setpoint = trajectory
        if attitude is not None and is_of_mode(attitude.timestamp, status):
            topics.vehicle_attitude_setpoint = attitude
        if rates is not None and is_of_mode(rates.timestamp, status):
            topics.vehicle_rates_setpoint = rates

    def generate(self, setpoints: Setpoints) -> None:
        """From the last setpoint to `setpoints.target`, or speed and yaw."""
        offboard = self._topics.offboard_setpoint
        if offboard.rover is not None:
            self._take(offboard.rover, setpoints)
        if offboard.rover is not None or offboard.trajectory is None:
            return
        if asks_for_position(offboard):
            north, east, _ = self._trajectory.position
            setpoints.target = Target((north, east))
        elif has_any(offboard.trajectory.velocity):
            vn, ve, _ = self._trajectory.velocity
            setpoints.speed, setpoints.yaw = math.hypot(vn, ve), math.atan2(ve, vn)

    def _take(self, told: RoverSetpoint, setpoints: Setpoints) -> None:
        status = self._topics.vehicle_status
        for name, new, taken in zip(told._fields, told, self._taken, strict=True):
            if new is not taken and is_of_mode(new[0], status):
                setattr(setpoints, name, new[1])
        self._taken = told


class Course(NamedTuple):
    """A line that POSCTL drives along: where it began, and its direction (unit vector, north and east)."""

    start: Place
    along: Place


class ManualMode:
    """MANUAL, ACRO, STAB and POSCTL: throttle and roll of the sticks."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._held_yaw = NAN
        self._course: Course | None = None

    def reset(self) -> None:
        """Keep neither a heading nor a course."""
        self._held_yaw, self._course = NAN, None

    def generate(
        self, nav_state: NavState, parameters: RoverParameters, setpoints: Setpoints, state: RoverState
    ) -> None:
        """From the sticks to the setpoints of the mode."""
        sticks = self._topics.manual_control_setpoint
        throttle, roll = sticks.throttle, sticks.roll
        if nav_state is NavState.MANUAL:
            setpoints.throttle, setpoints.steering = throttle, roll
        elif nav_state is NavState.ACRO:
            setpoints.throttle = throttle
            setpoints.yaw_rate = yaw_rate_of_stick(throttle, roll, 0.0, parameters)
        elif nav_state is NavState.STAB:
            self._stabilized(throttle, roll, parameters, setpoints, state)
        else:
            self._position(throttle, roll, parameters, setpoints, state)

    def _stabilized(
        self, throttle: float, roll: float, parameters: RoverParameters, setpoints: Setpoints, state: RoverState
    ) -> None:
        setpoints.throttle = throttle
        if abs(roll) > EPSILON or abs(throttle) < EPSILON:
            self._held_yaw = setpoints.yaw = NAN
            setpoints.yaw_rate = yaw_rate_of_stick(throttle, roll, parameters.stick_dead_zone, parameters)
            return
        if not math.isfinite(self._held_yaw):
            self._held_yaw = state.yaw
        setpoints.yaw = self._held_yaw

    def _position(
        self, throttle: float, roll: float, parameters: RoverParameters, setpoints: Setpoints, state: RoverState
    ) -> None:
        """At a speed and a yaw rate; or, with steering centred, on along the line on which it was centred.

        The place to drive to stays out of reach of the look-ahead.
        """
        wanted = clamp(throttle, -1.0, 1.0) * parameters.speed_limit
        if abs(roll) > EPSILON or abs(wanted) < EPSILON:
            self._course, setpoints.target = None, Target()
            setpoints.speed, setpoints.yaw = wanted, NAN
            setpoints.yaw_rate = yaw_rate_of_stick(throttle, roll, parameters.stick_dead_zone, parameters)
            return
        if self._course is None:
            self._course = Course(state.place, (math.cos(state.yaw), math.sin(state.yaw)))
        (start_n, start_e), (along_n, along_e) = self._course
        gone = abs((state.place[0] - start_n) * along_n + (state.place[1] - start_e) * along_e)
        reach = math.copysign(gone + parameters.ahead_max_m, wanted)
        place = (start_n + reach * along_n, start_e + reach * along_e)
        setpoints.target = Target(place, self._course.start, cruising_speed=wanted)


def yaw_rate_of_stick(throttle: float, roll: float, dead_zone: float, parameters: RoverParameters) -> float:
    """Yaw rate for the steering stick: dead zone, curve (RO_YAW_EXPO, RO_YAW_SUPEXPO), limit; none without throttle."""
    size = min(abs(roll), 1.0)
    if size <= dead_zone or not throttle:
        return 0.0
    moved = (size - dead_zone) / (1.0 - dead_zone)
    expo, super_expo = parameters.stick_expo, parameters.stick_super_expo
    curved = (1.0 - expo) * moved + expo * moved**3
    curved *= (1.0 - super_expo) / (1.0 - moved * super_expo)
    return math.copysign(curved * parameters.yaw_rate_limit, roll * throttle)
