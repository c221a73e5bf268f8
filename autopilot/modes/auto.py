"""AUTO modes (takeoff, loiter, mission, return, land): the navigator's triplet flown as a smooth trajectory.

Behaves as PX4's FlightTaskAuto (src/modules/flight_mode_manager/tasks/Auto, v1.18): MPC_XY_CRUISE or the triplet's
cruising speed, MPC_ACC_HOR, MPC_JERK_AUTO, MPC_Z_V_AUTO_*, corners cut at the acceptance radius, heading by
MPC_YAW_MODE with MPC_YAWRAUTO_*, or towards a mission's region of interest (of which PX4's navigator takes care). The
type of the current setpoint makes it take off or land. It avoids no obstacles, takes no stick input (MPC_AUTO_NUDGING),
and knows no weather vane.
"""

import math
from enum import IntEnum
from typing import Final

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.modes.flight_task import (
    GEAR_DOWN,
    GEAR_KEEP,
    GEAR_UP,
    GEAR_UP_ABOVE_M,
    Setpoint,
    distance_to_ground_m,
    start_state,
)
from sitl_emu.autopilot.modes.heading_smoothing import HeadingSmoothing
from sitl_emu.autopilot.modes.land import descent_speed, land_speeds
from sitl_emu.autopilot.modes.position_smoothing import PositionSmoothing
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN3,
    PositionSetpoint,
    PositionSetpointTriplet,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleConstraints,
    VehicleLocalPosition,
    VehicleRoi,
)
from sitl_emu.core.geodesy import MapProjection, wrap_pi

NAN = math.nan
SAME_PLACE_M: Final = 0.001
WANT_TAKEOFF_SPEED: Final = -0.3
"""Vertical velocity (down) that asks for a takeoff."""
THRUST_OFF_M_S2: Final = 100.0
"""Acceleration down that leaves no thrust."""
ROOM_TO_CORRECT: Final = 1.2
"""Share of the trajectory's speed down which the position controller may ask for, to correct the height."""
EXCESS: Final = 1.3
"""Speed over its limit by which the vehicle brakes before it goes on."""
STOPPED_M_S: Final = 0.01
BRAKING_M_S2: Final = 9.80665
ROI_LOCATION: Final = 3
"""MAV_ROI_LOCATION."""
YAW_BY_TARGET: Final = 0
YAW_BY_HOME: Final = 1
YAW_FROM_HOME: Final = 2
YAW_BY_TRAJECTORY: Final = 3
YAW_FIRST: Final = 4


class Leg(IntEnum):
    """Where the vehicle is on the way from the previous to the current waypoint."""

    ON_TRACK = 0
    TARGET_BEHIND = 1
    PREVIOUS_IN_FRONT = 2
    OFF_TRACK = 3


class Auto:
    """The flight task of all AUTO modes."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._smoothing = PositionSmoothing()
        self._heading = HeadingSmoothing()
        self._projection: MapProjection | None = None
        self._reference_timestamp = -1
        self._xy_reset_counter = self._z_reset_counter = 0
        self._triplet: PositionSetpointTriplet | None = None
        self._previous: Vector3 = NAN3
        self._current: Vector3 = NAN3
        self._next: Vector3 = NAN3
        self._leg = Leg.ON_TRACK
        self._waypoints: tuple[Vector3, Vector3, Vector3] = (NAN3, NAN3, NAN3)
        self._acceptance_m = 0.0
        self._land_heading = NAN
        self._yaw = NAN
        self._yaw_lock = False
        self._yaw_aligned = False
        self._braking = False
        self.gear = GEAR_KEEP
        self._roi: VehicleRoi | None = None
        self._roi_place = (0.0, 0.0)
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        parameters = self._parameters
        smoothing = self._smoothing
        self._xy_cruise = parameters["MPC_XY_CRUISE"]
        self._xy_max = parameters["MPC_XY_VEL_MAX"]
        self._acceleration = parameters["MPC_ACC_HOR"]
        self._jerk = parameters["MPC_JERK_AUTO"]
        self._speed_up, self._speed_down = parameters["MPC_Z_V_AUTO_UP"], parameters["MPC_Z_V_AUTO_DN"]
        self._limit_up, self._limit_down = parameters["MPC_Z_VEL_MAX_UP"], parameters["MPC_Z_VEL_MAX_DN"]
        self._acceleration_up, self._acceleration_down = parameters["MPC_ACC_UP_MAX"], parameters["MPC_ACC_DOWN_MAX"]
        self._takeoff_speed = parameters["MPC_TKO_SPEED"]
        self._takeoff_acceleration = self._takeoff_speed / max(parameters["MPC_TKO_RAMP_T"], 0.01)
        self._land = land_speeds(parameters)
        self._yaw_mode = parameters["MPC_YAW_MODE"]
        self._yaw_tolerance = math.radians(parameters["MIS_YAW_ERR"])
        self._heading.set_limits(
            math.radians(parameters["MPC_YAWRAUTO_MAX"]), math.radians(parameters["MPC_YAWRAUTO_ACC"])
        )
        smoothing.turn_gain = parameters["MPC_XY_TRAJ_P"]
        smoothing.max_xy_error_m, smoothing.max_z_error_m = parameters["MPC_XY_ERR_MAX"], parameters["MPC_Z_ERR_MAX"]
        smoothing.z_acceptance_m = parameters["NAV_MC_ALT_RAD"]

    def activate(self, last: TrajectorySetpoint) -> None:
        """Go on from the last setpoint."""
        local = self._topics.vehicle_local_position
        self._smoothing.reset(*start_state(last, local))
        yaw = last.yaw if math.isfinite(last.yaw) else local.heading
        self._heading.reset(yaw, last.yawspeed if math.isfinite(last.yawspeed) else 0.0)
        self._yaw = yaw
        self._land_heading = NAN
        self._braking = False
        self.gear = GEAR_KEEP
        self._xy_reset_counter, self._z_reset_counter = local.xy_reset_counter, local.z_reset_counter

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step along the trajectory."""
        topics = self._topics
        local = topics.vehicle_local_position
        current = topics.position_setpoint_triplet.current
        smoothing = self._smoothing
        self._follow_resets(local)
        self._update_waypoints(topics.position_setpoint_triplet, local)
        kind = current.type if current.valid else SetpointType.LOITER
        yaw = self._wanted_yaw(current, local)

        height_m = distance_to_ground_m(local, topics.home_position)
        previous, target, then = self._waypoints
        feed_forward = NAN3
        if kind == SetpointType.LAND:
            self.gear = GEAR_DOWN
            if math.isnan(self._land_heading):
                self._land_heading = yaw
            yaw = self._land_heading
            range_m = local.dist_bottom if local.dist_bottom_valid else NAN
            feed_forward = (NAN, NAN, descent_speed(self._land, height_m, range_m))
            target = (target[0], target[1], NAN)
        else:
            if height_m > GEAR_UP_ABOVE_M:
                self.gear = GEAR_UP
            self._land_heading = NAN

        self._check_braking()
        taking_off = kind == SetpointType.TAKEOFF and height_m < self._land.altitude1_m
        self._set_limits(current, taking_off)
        if taking_off and smoothing.unsmoothed_velocity[2] < 0.0:
            # The setpoint starts where the vehicle is, however long the rotors take to lift it.
            smoothing.z.force_position(local.z)
        waits = self._yaw_mode == YAW_FIRST and not self._yaw_aligned
        smoothing.update(
            (local.x, local.y, local.z), (previous, target, then), feed_forward, dt_s, waits or self._braking
        )

        heading = self._heading
        self._yaw_aligned = abs(wrap_pi(yaw - local.heading)) < self._yaw_tolerance
        heading.update(yaw, dt_s)
        self._yaw = yaw
        constraints = self._constraints()
        if kind == SetpointType.IDLE:
            acceleration = (0.0, 0.0, THRUST_OFF_M_S2)
            return TrajectorySetpoint(now_us, NAN3, NAN3, acceleration, heading.heading, heading.rate), constraints
        x, y, z = smoothing.axes
        return (
            TrajectorySetpoint(
                now_us,
                (x.position, y.position, z.position),
                (x.velocity, y.velocity, z.velocity),
                (x.acceleration, y.acceleration, z.acceleration),
                heading.heading,
                heading.rate,
                (x.jerk, y.jerk, z.jerk),
            ),
            constraints,
        )

    # --- limits ------------------------------------------------------------------------------------------

    def _constraints(self) -> VehicleConstraints:
        return VehicleConstraints(
            max(self._limit_up, ROOM_TO_CORRECT * self._speed_up),
            max(self._limit_down, ROOM_TO_CORRECT * self._speed_down),
            self._smoothing.unsmoothed_velocity[2] < WANT_TAKEOFF_SPEED,
        )

    def _set_limits(self, current: PositionSetpoint, taking_off: bool) -> None:
        smoothing = self._smoothing
        cruise = current.cruising_speed
        smoothing.cruise_speed = min(cruise if cruise >= 0.0 else self._xy_cruise, self._xy_max)
        smoothing.xy_acceptance_m = self._acceptance_m
        if self._braking:
            smoothing.set_horizontal_limits(self._xy_max, BRAKING_M_S2, BRAKING_M_S2)
            smoothing.set_vertical_limits(max(self._limit_up, self._limit_down), BRAKING_M_S2)
            return
        smoothing.set_horizontal_limits(self._xy_max, self._acceleration, self._jerk)
        if smoothing.unsmoothed_velocity[2] >= 0.0:
            smoothing.set_vertical_limits(self._speed_down, self._acceleration_down)
        elif taking_off:
            smoothing.set_vertical_limits(self._takeoff_speed, min(self._acceleration_up, self._takeoff_acceleration))
        else:
            smoothing.set_vertical_limits(self._speed_up, self._acceleration_up)

    def _check_braking(self) -> None:
        """Brake to a stop when a mode that flew much faster than AUTO may went before."""
        x, y, z = self._smoothing.axes
        speed = math.sqrt(x.velocity * x.velocity + y.velocity * y.velocity)
        if self._braking:
            self._braking = abs(z.velocity) > STOPPED_M_S or speed > STOPPED_M_S
        elif (
            z.velocity > EXCESS * self._limit_down
            or z.velocity < -EXCESS * self._limit_up
            or speed > EXCESS * self._xy_max
        ):
            self._braking = True

    # --- waypoints ---------------------------------------------------------------------------------------

    def _follow_resets(self, local: VehicleLocalPosition) -> None:
        """Move the trajectory along when the estimate jumps, and the reference when it is set anew."""
        smoothing = self._smoothing
        if local.xy_reset_counter != self._xy_reset_counter:
            self._xy_reset_counter = local.xy_reset_counter
            for axis, position, velocity in ((smoothing.x, local.x, local.vx), (smoothing.y, local.y, local.vy)):
                axis.reset(position, velocity, axis.acceleration)
        if local.z_reset_counter != self._z_reset_counter:
            self._z_reset_counter = local.z_reset_counter
            smoothing.z.reset(local.z, local.vz, smoothing.z.acceleration)
        if local.ref_timestamp != self._reference_timestamp or self._projection is None:
            if math.isfinite(local.ref_lat):
                self._reference_timestamp = local.ref_timestamp
                self._projection = MapProjection(local.ref_lat, local.ref_lon)
            self._triplet = self._roi = None

    def _update_waypoints(self, triplet: PositionSetpointTriplet, local: VehicleLocalPosition) -> None:
        position = (local.x, local.y, local.z)
        current = triplet.current
        if self._projection is None or not current.valid or not math.isfinite(current.alt):
            self._triplet = None
            self._previous = self._current = self._next = position
            self._acceptance_m = _acceptance(current)
            self._leg = Leg.ON_TRACK
            self._waypoints = (position, position, position)
            return
        changed = self._is_new(triplet)
        self._triplet = triplet
        if changed:
            self._current = self._local(current, local)
            self._previous = self._local(triplet.previous, local) if triplet.previous.valid else position
            follows = triplet.next.valid and current.type != SetpointType.LOITER
            self._next = self._local(triplet.next, local) if follows else self._current
            self._acceptance_m = _acceptance(current)
        leg, closest = leg_state(self._previous, self._current, position, self._acceptance_m)
        if changed or leg != self._leg or leg == Leg.OFF_TRACK:
            self._leg = leg
            if leg == Leg.ON_TRACK:
                self._waypoints = (self._previous, self._current, self._next)
            elif leg == Leg.TARGET_BEHIND:
                self._waypoints = (position, self._current, self._next)
            elif leg == Leg.PREVIOUS_IN_FRONT:
                self._waypoints = (position, self._previous, self._current)
            else:
                self._waypoints = (position, closest, self._current)

    def _is_new(self, triplet: PositionSetpointTriplet) -> bool:
        """Whether the current waypoint is another one; a new yaw or speed moves no waypoint."""
        known = self._triplet
        if known is triplet:
            return False
        if known is None:
            return True
        current, before = triplet.current, known.current
        return (
            known.previous.valid != triplet.previous.valid
            or known.next.valid != triplet.next.valid
            or current.lat != before.lat
            or current.lon != before.lon
            or abs(current.alt - before.alt) >= SAME_PLACE_M
            or current.type != before.type
        )

    def _local(self, setpoint: PositionSetpoint, local: VehicleLocalPosition) -> Vector3:
        """A setpoint in the local frame; the vehicle's own place where it has none."""
        north, east = local.x, local.y
        if self._projection is not None and math.isfinite(setpoint.lat) and math.isfinite(setpoint.lon):
            north, east = self._projection.project(setpoint.lat, setpoint.lon)
        down = local.ref_alt - setpoint.alt
        return north, east, down if math.isfinite(down) else local.z

    # --- heading -----------------------------------------------------------------------------------------

    def _wanted_yaw(self, current: PositionSetpoint, local: VehicleLocalPosition) -> float:
        """The bearing of a mission's region of interest, else the triplet's yaw, else that of MPC_YAW_MODE."""
        roi = self._topics.vehicle_roi
        if roi.mode == ROI_LOCATION and self._topics.vehicle_status.nav_state == NavState.AUTO_MISSION:
            if roi is not self._roi and self._projection is not None:
                self._roi, self._roi_place = roi, self._projection.project(roi.lat, roi.lon)
            self._yaw_lock = False
            return math.atan2(self._roi_place[1] - local.y, self._roi_place[0] - local.x)
        if current.valid and math.isfinite(current.yaw):
            self._yaw_lock = False
            return current.yaw
        mode = self._yaw_mode
        if mode == YAW_BY_TRAJECTORY:
            vx, vy = self._smoothing.x.velocity, self._smoothing.y.velocity
            return math.atan2(vy, vx) if vx * vx + vy * vy > 1.0 else self._yaw
        home = self._topics.home_position
        target = self._waypoints[1]
        to_n, to_e = target[0] - local.x, target[1] - local.y
        if mode in (YAW_BY_HOME, YAW_FROM_HOME):
            if not home.valid:
                return self._yaw
            sign = 1.0 if mode == YAW_BY_HOME else -1.0
            to_n, to_e = sign * (home.x - local.x), sign * (home.y - local.y)
        if to_n * to_n + to_e * to_e > self._acceptance_m * self._acceptance_m:
            self._yaw_lock = False
            return math.atan2(to_e, to_n)
        if not self._yaw_lock:
            self._yaw_lock = True
            return local.heading
        return self._yaw


def leg_state(previous: Vector3, current: Vector3, position: Vector3, acceptance_m: float) -> tuple[Leg, Vector3]:
    """Where a position is on a leg, and the leg's point next to it."""
    leg_n, leg_e, leg_d = current[0] - previous[0], current[1] - previous[1], current[2] - previous[2]
    length = math.sqrt(leg_n * leg_n + leg_e * leg_e + leg_d * leg_d)
    if length < 1e-6:
        return Leg.ON_TRACK, previous
    u_n, u_e, u_d = leg_n / length, leg_e / length, leg_d / length
    off_n, off_e, off_d = position[0] - previous[0], position[1] - previous[1], position[2] - previous[2]
    along = off_n * u_n + off_e * u_e + off_d * u_d
    closest = (previous[0] + u_n * along, previous[1] + u_e * along, previous[2] + u_d * along)
    if along > length:
        return Leg.TARGET_BEHIND, closest
    if along < 0.0 and math.sqrt(off_n * off_n + off_e * off_e + off_d * off_d) > acceptance_m:
        return Leg.PREVIOUS_IN_FRONT, closest
    if math.dist(position, closest) > acceptance_m:
        return Leg.OFF_TRACK, closest
    return Leg.ON_TRACK, closest


def _acceptance(setpoint: PositionSetpoint) -> float:
    radius = setpoint.acceptance_radius
    return radius if math.isfinite(radius) else 0.0
