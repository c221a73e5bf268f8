"""AUTO modes (takeoff, loiter, mission, return, land): the navigator's triplet flown as a smooth trajectory.

Behaves as PX4's FlightTaskAuto (src/modules/flight_mode_manager/tasks/Auto, v1.18): MPC_XY_CRUISE or the triplet's
cruising speed, MPC_ACC_HOR, MPC_JERK_AUTO, MPC_Z_V_AUTO_*, corners cut at the acceptance radius, heading by
MPC_YAW_MODE with MPC_YAWRAUTO_*. The type of the current setpoint makes it take off or land. Sticks count where
MPC_AUTO_NUDGING lets them (`nudging.py`). It avoids no obstacles. Where nothing is known of the Earth, its local frame
begins at latitude, longitude and altitude 0.
"""

import math
from typing import Final

from sitl_emu.autopilot.constants import GEAR_DOWN, GEAR_KEEP, GEAR_UP, SetpointType, TakeoffState
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.modes.flight_task import (
    GEAR_UP_ABOVE_M,
    Setpoint,
    distance_to_ground_m,
    start_state,
)
from sitl_emu.autopilot.modes.heading_smoothing import HeadingSmoothing
from sitl_emu.autopilot.modes.land import descent_speed, land_speeds
from sitl_emu.autopilot.modes.nudging import LandNudge, YawNudge
from sitl_emu.autopilot.modes.position_smoothing import PositionSmoothing
from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON
from sitl_emu.autopilot.modes.weather_vane import WeatherVane
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
)
from sitl_emu.core.geodesy import MapProjection, wrap_pi

NAN = math.nan
SAME_PLACE_M: Final = 0.001
SAME_YAW_RAD: Final = 1e-4
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
YAW_BY_TARGET: Final = 0
YAW_BY_HOME: Final = 1
YAW_FROM_HOME: Final = 2
YAW_BY_TRAJECTORY: Final = 3
YAW_FIRST: Final = 4
LEAST_WAY_M: Final = 1e-3
"""Less has no bearing."""
MOVES_M_S: Final = 0.1
FAR_M: Final = 2.0
"""Faster, and farther from its target than this, a trajectory has a bearing to look along."""
CLIMB_FIRST_M: Final = 1.0
"""So far above where it left the ground, height comes before place."""
NOWHERE: tuple[float, float] = (NAN, NAN)  # no Final: mypyc takes NaN for one that was never set
AT_REST: Final = ((0.0, 0.0, 0.0),) * 3
"""Position, velocity, acceleration."""


class Auto:
    """The flight task of all AUTO modes."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._topics = topics
        self._parameters = parameters
        self._yaw_nudge = YawNudge(topics, parameters)
        self._land_nudge = LandNudge(topics, parameters, say, send)
        self._weather_vane = WeatherVane(topics, parameters)
        self._smoothing = PositionSmoothing()
        self._heading = HeadingSmoothing()
        self._projection = MapProjection(0.0, 0.0)
        self._reference_timestamp = -1
        self._resets = (0, 0, 0, 0, 0)
        self._triplet: PositionSetpointTriplet | None = None
        self._previous: Vector3 = NAN3
        self._current: Vector3 = NAN3
        self._next: Vector3 = NAN3
        self._locked_place: tuple[float, float] = NOWHERE
        """Where the vehicle was when a setpoint without a place came, as long as none with a place does."""
        self._acceptance_m = 0.0
        self._kind: int = SetpointType.LOITER
        """Of the setpoint flown last."""
        self._yaw = self._yawspeed = NAN
        """Flown last; the yaw is NaN where none was, and MPC_YAW_MODE 3 holds none before it moves."""
        self._triplet_yaw = NAN
        self._yaw_lock = False
        self._yaw_aligned = False
        self._braking = False
        self._braked_climb = 0.0
        """Up or down: what the position controller may not cut off while it brakes."""
        self._takeoff_place: tuple[float, float] | None = None
        self._liftoff_z = NAN
        self.gear = GEAR_KEEP
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
        self._yaw_nudge.refresh(parameters)
        self._land_nudge.refresh(parameters)
        self._weather_vane.refresh(parameters)
        self._yaw_mode = parameters["MPC_YAW_MODE"]
        self._yaw_tolerance = math.radians(parameters["MIS_YAW_ERR"])
        self._yaw_rate = math.radians(parameters["MPC_YAWRAUTO_MAX"])
        self._heading.set_limits(self._yaw_rate, math.radians(parameters["MPC_YAWRAUTO_ACC"]))
        smoothing.turn_gain = parameters["MPC_XY_TRAJ_P"]
        smoothing.max_xy_error_m, smoothing.max_z_error_m = parameters["MPC_XY_ERR_MAX"], parameters["MPC_Z_ERR_MAX"]
        smoothing.z_acceptance_m = parameters["NAV_MC_ALT_RAD"]

    def begin(self) -> None:
        """The mode is entered. With MPC_YAW_MODE 4 it has to look where it goes before it goes, once.

        Begun anew on the ground it knows that it does: else nobody would take off (FlightTaskAuto::_yaw_sp_aligned).
        """
        self._yaw_aligned = False
        self._locked_place = NOWHERE
        self._land_nudge.forget()
        self._smoothing.reset(*AT_REST)

    def activate(self, last: TrajectorySetpoint) -> None:
        """Go on from the last setpoint; begun anew on the ground it still has the plan of before."""
        local = self._topics.vehicle_local_position
        self._smoothing.force_state(*start_state(last, local))
        yaw = last.yaw if math.isfinite(last.yaw) else local.heading
        self._heading.reset(yaw, last.yawspeed if math.isfinite(last.yawspeed) else 0.0)
        self._yaw, self._yawspeed = last.yaw, 0.0
        self._triplet_yaw, self._yaw_nudge.is_active = NAN, False
        self._kind = SetpointType.LOITER
        self._yaw_lock = self._braking = False
        self._braked_climb = 0.0
        self._takeoff_place, self._liftoff_z = None, NAN
        self.gear = GEAR_KEEP
        self._resets = _resets(local)

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step along the trajectory."""
        topics = self._topics
        local = topics.vehicle_local_position
        current = topics.position_setpoint_triplet.current
        smoothing = self._smoothing
        self._follow_resets(local)
        self._update_waypoints(topics.position_setpoint_triplet, local)
        kind = current.type if current.valid else SetpointType.LOITER
        yaw, yawspeed = self._wanted_heading(current, kind, local)

        height_m = distance_to_ground_m(local, topics.home_position)
        target, then, feed_forward = self._current, self._next, NAN3
        if kind == SetpointType.LAND:
            self.gear = GEAR_DOWN
            range_m = local.dist_bottom if local.dist_bottom_valid else NAN
            target, feed_forward = (target[0], target[1], NAN), (NAN, NAN, descent_speed(self._land, height_m, range_m))
            if self._kind != SetpointType.LAND:
                self._land_nudge.begin(target[:2])
            if self._land_nudge.takes_sticks():
                target, feed_forward, yaw = self._nudged(now_us, yaw, feed_forward[2], local, dt_s)
                if math.dist(target[:2], self._current[:2]) > EPSILON:
                    then = target
        elif height_m > GEAR_UP_ABOVE_M:
            self.gear = GEAR_UP

        self._check_braking()
        near_ground = kind == SetpointType.TAKEOFF and height_m < self._land.altitude1_m
        self._set_limits(current, near_ground)
        if near_ground and smoothing.unsmoothed_velocity[2] < 0.0 and not self._braking:
            # The setpoint starts where the vehicle is, however long the rotors take to lift it.
            smoothing.z.force_position(local.z)
        if kind == SetpointType.TAKEOFF:
            self._lift_off(local)
            if self._takeoff_place is not None:
                target = then = (*self._takeoff_place, target[2])
        waits = self._yaw_mode == YAW_FIRST and not self._yaw_aligned
        smoothing.update(
            (local.x, local.y, local.z), (self._previous, target, then), feed_forward, dt_s, waits or self._braking
        )
        yaw, yawspeed = self._along_trajectory(yaw, yawspeed, local)
        yaw, yawspeed = self._yaw_nudge.update(kind, yaw, yawspeed, dt_s, holds=not self._turns_into_wind(current))
        self._turn(yaw, yawspeed, local, dt_s)
        self._kind = kind

        constraints = self._constraints()
        if kind == SetpointType.IDLE:
            acceleration = (0.0, 0.0, THRUST_OFF_M_S2)
            return TrajectorySetpoint(now_us, NAN3, NAN3, acceleration, self._yaw, self._yawspeed), constraints
        x, y, z = smoothing.axes
        return (
            TrajectorySetpoint(
                now_us,
                (x.position, y.position, z.position),
                (x.velocity, y.velocity, z.velocity),
                (x.acceleration, y.acceleration, z.acceleration),
                self._yaw,
                self._yawspeed,
                (x.jerk, y.jerk, z.jerk),
            ),
            constraints,
        )

    def _nudged(
        self, now_us: int, yaw: float, speed: float, local: VehicleLocalPosition, dt_s: float
    ) -> tuple[Vector3, Vector3, float]:
        """Where sticks have a landing go, how fast, and with what yaw (_prepareLandSetpoints)."""
        nudge = self._land_nudge
        if nudge.moves_place:
            yaw = self._yaw
        (x, y), (vx, vy) = nudge.update(now_us, yaw if math.isfinite(yaw) else local.heading, local, dt_s)
        return (x, y, NAN), (vx, vy, speed * nudge.share_of_speed()), yaw

    def _lift_off(self, local: VehicleLocalPosition) -> None:
        """Straight up from where it leaves the ground: until it flies the trajectory is where the vehicle drifts."""
        x, y, _ = self._smoothing.axes
        if self._topics.takeoff_status.state < TakeoffState.FLIGHT:
            self._takeoff_place, self._liftoff_z = (local.x, local.y), local.z
            x.force_position(local.x)
            y.force_position(local.y)
        if not self._liftoff_z - local.z >= CLIMB_FIRST_M:
            x.force_velocity(local.vx)
            y.force_velocity(local.vy)

    # --- limits ------------------------------------------------------------------------------------------

    def _constraints(self) -> VehicleConstraints:
        return VehicleConstraints(
            max(self._limit_up, ROOM_TO_CORRECT * self._speed_up, self._braked_climb),
            max(self._limit_down, ROOM_TO_CORRECT * self._speed_down, self._braked_climb),
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
        self._braked_climb = abs(z.velocity) if self._braking else 0.0

    # --- waypoints ---------------------------------------------------------------------------------------

    def _follow_resets(self, local: VehicleLocalPosition) -> None:
        """Move the trajectory along when the estimate jumps, and the reference when it is set anew."""
        if (resets := _resets(local)) != self._resets:
            place, height, speed, climb, heading = (new != old for new, old in zip(resets, self._resets, strict=True))
            self._resets = resets
            x, y, z = self._smoothing.axes
            if place:
                x.force_position(local.x)
                y.force_position(local.y)
            if speed:
                x.force_velocity(local.vx)
                y.force_velocity(local.vy)
            if height:
                z.force_position(local.z)
            if climb:
                z.force_velocity(local.vz)
            if heading:
                self._heading.turned(local.delta_heading)
                self._yaw = wrap_pi(self._yaw + local.delta_heading)
        if local.ref_timestamp != self._reference_timestamp:
            self._reference_timestamp = local.ref_timestamp
            lat, lon = (local.ref_lat, local.ref_lon) if math.isfinite(local.ref_lat) else (0.0, 0.0)
            self._projection = MapProjection(lat, lon)
            self._triplet = None

    def _update_waypoints(self, triplet: PositionSetpointTriplet, local: VehicleLocalPosition) -> None:
        current = triplet.current
        if not _is_known(current):
            self._triplet = None
            self._previous = self._current = self._next = (local.x, local.y, local.z)
            self._acceptance_m = _acceptance(current)
            return
        if self._is_new(triplet):
            self._current = self._local(current, local)
            self._previous = self._local(triplet.previous, local) if _has_place(triplet.previous) else self._current
            follows = _has_place(triplet.next) and current.type != SetpointType.LOITER
            self._next = self._local(triplet.next, local) if follows else self._current
            self._acceptance_m = _acceptance(current)
        self._triplet = triplet

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
        )

    def _local(self, setpoint: PositionSetpoint, local: VehicleLocalPosition) -> Vector3:
        """A setpoint in the local frame; without a place it is where the vehicle was when the first such came."""
        if math.isfinite(setpoint.lat) and math.isfinite(setpoint.lon):
            self._locked_place = NOWHERE
            north, east = self._projection.project(setpoint.lat, setpoint.lon)
        else:
            if not math.isfinite(self._locked_place[0]):
                self._locked_place = local.x, local.y
            north, east = self._locked_place
        return north, east, (local.ref_alt if math.isfinite(local.ref_alt) else 0.0) - setpoint.alt

    # --- heading -----------------------------------------------------------------------------------------

    def _wanted_heading(self, current: PositionSetpoint, kind: int, local: VehicleLocalPosition) -> tuple[float, float]:
        """Yaw and its rate: the triplet's yaw, or by MPC_YAW_MODE.

        NaN and 0: it turns no more, as its heading is not known well enough; NaN twice: along the trajectory. Under a
        weather vane it turns into the wind, unless it moves, when what it leans by tells no wind. A heading that the
        yaw stick has changed stays until the triplet has another yaw.
        """
        if not _is_known(current):
            return local.heading, NAN
        if self._turns_into_wind(current):
            moves = math.hypot(self._smoothing.x.velocity, self._smoothing.y.velocity) > 0.5 * self._xy_cruise
            return NAN, 0.0 if moves else self._weather_vane.yawspeed()
        before, self._triplet_yaw = self._triplet_yaw, current.yaw
        if not local.heading_good_for_control:
            self._yaw_lock, self._triplet_yaw = False, NAN
            return NAN, 0.0
        if math.isfinite(current.yaw):
            is_another = not abs(wrap_pi(current.yaw - before)) <= SAME_YAW_RAD
            if is_another or not self._yaw_nudge.is_active:
                self._yaw_nudge.is_active = False
                return current.yaw, NAN
        elif not self._yaw_nudge.is_active and not kind == SetpointType.LAND == self._kind:
            return self._heading_by_mode(local), NAN
        return self._yaw, self._yawspeed

    def _turns_into_wind(self, current: PositionSetpoint) -> bool:
        return self._weather_vane.enabled and not math.isfinite(current.yaw)

    def _heading_by_mode(self, local: VehicleLocalPosition) -> float:
        """Where MPC_YAW_MODE has it look; near that place as it looked before; NaN along the trajectory."""
        mode, home = self._yaw_mode, self._topics.home_position
        to_n = to_e = 0.0
        if mode == YAW_BY_TRAJECTORY:
            self._yaw_lock = False
            return NAN
        if mode in (YAW_BY_TARGET, YAW_FIRST):
            to_n, to_e = self._current[0] - local.x, self._current[1] - local.y
        elif mode in (YAW_BY_HOME, YAW_FROM_HOME) and home.valid_lpos:
            sign = 1.0 if mode == YAW_BY_HOME else -1.0
            to_n, to_e = sign * (home.x - local.x), sign * (home.y - local.y)
        if to_n * to_n + to_e * to_e > max(self._acceptance_m, LEAST_WAY_M) ** 2:
            self._yaw_lock = True
            return math.atan2(to_e, to_n)
        if self._yaw_lock:
            return self._yaw
        self._yaw_lock = True
        return local.heading

    def _along_trajectory(self, yaw: float, yawspeed: float, local: VehicleLocalPosition) -> tuple[float, float]:
        """The same, or along the trajectory where both are NaN (_generateHeadingAlongTraj)."""
        if yaw == yaw or yawspeed == yawspeed or self._yaw_nudge.is_active:
            return yaw, yawspeed
        vx, vy = self._smoothing.x.velocity, self._smoothing.y.velocity
        is_far = math.hypot(self._current[0] - local.x, self._current[1] - local.y) > FAR_M
        return math.atan2(vy, vx) if math.hypot(vx, vy) > MOVES_M_S and is_far else self._yaw, yawspeed

    def _turn(self, yaw: float, yawspeed: float, local: VehicleLocalPosition, dt_s: float) -> None:
        """One step towards a heading; see `_wanted_heading`."""
        heading = self._heading
        if yaw == yaw:
            heading.update(yaw, dt_s)
            self._yaw, self._yawspeed = heading.heading, heading.rate
            self._yaw_aligned = abs(wrap_pi(yaw - self._yaw)) < self._yaw_tolerance
        else:
            heading.reset(local.heading)
            self._yaw, self._yawspeed = NAN, yawspeed
            self._yaw_aligned = True
        if abs(self._yawspeed) >= self._yaw_rate:
            self._yaw_aligned = False


def _has_place(setpoint: PositionSetpoint) -> bool:
    return _is_known(setpoint) and math.isfinite(setpoint.lat) and math.isfinite(setpoint.lon)


def _is_known(setpoint: PositionSetpoint) -> bool:
    """Whether there is somewhere to go: at least a height."""
    return setpoint.valid and math.isfinite(setpoint.alt)


def _resets(local: VehicleLocalPosition) -> tuple[int, int, int, int, int]:
    """How often the estimate of place, height, their speeds and the heading has jumped."""
    return (
        local.xy_reset_counter,
        local.z_reset_counter,
        local.vxy_reset_counter,
        local.vz_reset_counter,
        local.heading_reset_counter,
    )


def _acceptance(setpoint: PositionSetpoint) -> float:
    radius = setpoint.acceptance_radius
    return radius if math.isfinite(radius) else 0.0
