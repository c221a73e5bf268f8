"""The trajectory to a waypoint: where the vehicle is to be, and how fast, with limited acceleration and jerk.

Behaves as PX4's `PositionSmoothing` (src/lib/motion_planning, v1.18): the velocity that still allows to stop or to turn
at the waypoints is smoothed by three `VelocitySmoothing` axes; the trajectory waits for a vehicle that lags behind it,
the height by itself. To a place that is no corner of a way (`is_single`) it aims at once, however it moves. It avoids
no obstacles.
"""

import math
from typing import Final

from sitl_emu.autopilot.modes.trajectory_constraints import (
    MOST_RAD,
    Limits,
    Point,
    max_speed_from_distance,
    max_speed_in_waypoint,
    speed_through,
)
from sitl_emu.autopilot.modes.velocity_smoothing import VelocitySmoothing, time_synchronization

L1_MIN_M: Final = 5.0
"""Least distance ahead on the leg at which a turning vehicle aims."""
LEAST_ERROR_M: Final = 1.2e-7
"""MPC_XY_ERR_MAX and MPC_Z_ERR_MAX of no more let the trajectory run, however far the vehicle lags."""
TURNING_COSINE: Final = 0.98
TURNING_SPEED: Final = 0.2
SAME_HEIGHT_M: Final = 0.001


class PositionSmoothing:
    """Three axes of a trajectory. Limits are plain attributes, set by the flight mode before `update`."""

    def __init__(self, *, is_single: bool = False) -> None:
        """`is_single`: as PX4's generateSetpoints with one waypoint; the three of `update` are the same then."""
        self._is_single = is_single
        self.x = VelocitySmoothing()
        self.y = VelocitySmoothing()
        self.z = VelocitySmoothing()
        self.axes = (self.x, self.y, self.z)
        self.cruise_speed = 5.0
        self.turn_gain = 0.5
        self.xy_acceptance_m = 2.0
        self.z_acceptance_m = 0.8
        self.max_xy_error_m = 2.0
        self.max_z_error_m = 1.0
        self.unsmoothed_velocity: Point = (0.0, 0.0, 0.0)
        self._straight_speed = 0.0

    def set_horizontal_limits(self, velocity: float, acceleration: float, jerk: float) -> None:
        """Limits of both horizontal axes; the jerk is that of the vertical too."""
        for axis in (self.x, self.y):
            axis.max_velocity, axis.max_acceleration = velocity, acceleration
        self.x.max_jerk = self.y.max_jerk = self.z.max_jerk = jerk

    def set_vertical_limits(self, velocity: float, acceleration: float) -> None:
        """Limits of the vertical axis."""
        self.z.max_velocity, self.z.max_acceleration = velocity, acceleration

    def reset(self, position: Point, velocity: Point, acceleration: Point) -> None:
        """Go on from this state."""
        for axis, x, v, a in zip(self.axes, position, velocity, acceleration, strict=True):
            axis.reset(x, v, a)
        self._straight_speed = 0.0

    def force_state(self, position: Point, velocity: Point, acceleration: Point) -> None:
        """Be elsewhere and move otherwise, with the plan as it is (PositionSmoothing::reset)."""
        for axis, x, v, a in zip(self.axes, position, velocity, acceleration, strict=True):
            axis.force_state(x, v, a)

    def update(
        self,
        position: Point,
        waypoints: tuple[Point, Point, Point],
        feed_forward: Point,
        dt_s: float,
        stop: bool = False,
    ) -> None:
        """One step: `x`, `y`, `z` then hold the setpoints.

        `position`: where the vehicle is; `waypoints`: previous, target, next; an axis whose target is NaN follows
        `feed_forward` (m/s) instead, which else is added where it is not NaN. `stop` brakes.
        """
        x, y, z = self.x, self.y, self.z
        wanted = (0.0, 0.0, 0.0) if stop else self._velocity_setpoint(waypoints, feed_forward)
        self.unsmoothed_velocity = wanted
        # The trajectory's time runs slower while the vehicle lags behind it, and stands when it does by the limit.
        behind_n, behind_e, behind_d = x.position - position[0], y.position - position[1], z.position - position[2]
        xy_step_s = z_step_s = dt_s
        if behind_n * x.velocity + behind_e * y.velocity >= 0.0:
            xy_step_s *= _pace(math.sqrt(behind_n * behind_n + behind_e * behind_e), self.max_xy_error_m)
        if behind_d * z.velocity >= 0.0:
            z_step_s *= _pace(abs(behind_d), self.max_z_error_m)
        x.update_trajectory(xy_step_s)
        y.update_trajectory(xy_step_s)
        z.update_trajectory(z_step_s)
        x.update_durations(wanted[0])
        y.update_durations(wanted[1])
        z.update_durations(wanted[2])
        time_synchronization(self.axes)

    def _velocity_setpoint(self, waypoints: tuple[Point, Point, Point], feed_forward: Point) -> Point:
        target = waypoints[1]
        z_known = target[2] == target[2]
        aim_d = target[2]
        vx, vy, vz = 0.0, 0.0, 0.0
        if target[0] == target[0] and target[1] == target[1]:
            turning = not self._is_single and self._is_turning(target)
            aim_n, aim_e = target[0], target[1]
            if turning:
                aim_n, aim_e, aim_d = self._l1_point(waypoints) if z_known else waypoints[0]
            speed = self._max_xy_speed(waypoints)
            if turning:
                speed = min(self._straight_speed, speed)
            else:
                self._straight_speed = speed
            way_n, way_e = aim_n - self.x.position, aim_e - self.y.position
            way = math.sqrt(way_n * way_n + way_e * way_e)
            if way > 0.0:
                vx, vy = way_n * speed / way, way_e * speed / way
        if z_known:
            way_d = aim_d - self.z.position
            if way_d:
                vz = math.copysign(self._max_z_speed(waypoints), way_d)
        return _sum(vx, feed_forward[0]), _sum(vy, feed_forward[1]), _sum(vz, feed_forward[2])

    def _is_turning(self, target: Point) -> bool:
        """Whether the trajectory moves in another direction than to a target that is not near yet."""
        vx, vy = self.x.velocity, self.y.velocity
        speed = math.sqrt(vx * vx + vy * vy)
        if speed <= TURNING_SPEED:
            return False
        way_n, way_e = target[0] - self.x.position, target[1] - self.y.position
        way = math.sqrt(way_n * way_n + way_e * way_e)
        return way > self.xy_acceptance_m and vx * way_n + vy * way_e < TURNING_COSINE * speed * way

    def _l1_point(self, waypoints: tuple[Point, Point, Point]) -> Point:
        """Point of the leg at a fixed distance ahead of the trajectory: where it aims while it turns.

        In three dimensions: the height to which it climbs or descends meanwhile is the leg's, not the target's. To a
        target without a height, as a landing has, a leg has no direction in PX4 (unit_or_zero of NaN): it aims at the
        leg's begin, and who has to turn towards a landing that is far away comes down there instead.
        """
        previous, target, _ = waypoints
        x, y, z = self.x.position, self.y.position, self.z.position
        leg_n, leg_e = target[0] - previous[0], target[1] - previous[1]
        from_d, leg_d = previous[2], target[2] - previous[2]
        leg = math.sqrt(leg_n * leg_n + leg_e * leg_e + leg_d * leg_d)
        if leg > 0.0:
            leg_n, leg_e, leg_d = leg_n / leg, leg_e / leg, leg_d / leg
        along = (x - previous[0]) * leg_n + (y - previous[1]) * leg_e + (z - from_d) * leg_d
        near_n, near_e, near_d = previous[0] + leg_n * along, previous[1] + leg_e * along, from_d + leg_d * along
        across_n, across_e, across_d = near_n - x, near_e - y, near_d - z
        across = math.sqrt(across_n * across_n + across_e * across_e + across_d * across_d)
        l1 = max(self.xy_acceptance_m, L1_MIN_M)
        ahead = math.sqrt(l1 * l1 - across * across) if l1 > across else 0.0
        return near_n + leg_n * ahead, near_e + leg_e * ahead, near_d + leg_d * ahead

    def _max_xy_speed(self, waypoints: tuple[Point, Point, Point]) -> float:
        x = self.x
        limits = Limits(
            self.xy_acceptance_m,
            self.cruise_speed,
            x.max_acceleration,
            x.max_jerk,
            self.turn_gain,
        )
        return speed_through((x.position, self.y.position, self.z.position), waypoints[1], waypoints[2], limits)

    def _max_z_speed(self, waypoints: tuple[Point, Point, Point]) -> float:
        """Vertical speed on the way to the target, above which the next waypoint may lie higher or lower.

        As PX4 has it, the corner is seen in the plane of height and distance from the local origin, and the speed that
        it allows counts at the target's height too: on level legs that a climb or descent follows, the vehicle swings
        about its height by some metres.
        """
        _, target, following = waypoints
        z = self.z
        limit = z.max_velocity
        arrival = 0.0
        rise = target[2] - following[2]
        if abs(rise) > SAME_HEIGHT_M:
            far = math.hypot(target[0], target[1])
            in_m, in_d = far - math.hypot(self.x.position, self.y.position), target[2] - z.position
            out_m = far - math.hypot(following[0], following[1])
            size = math.hypot(in_m, in_d) * math.hypot(out_m, rise)
            cosine = (in_m * out_m + in_d * rise) / size if size > 0.0 else 0.0
            angle = min(math.acos(max(-1.0, min(1.0, cosine))), MOST_RAD)
            arrival = min(max_speed_in_waypoint(angle, z.max_acceleration, self.z_acceptance_m), limit)
        distance = abs(target[2] - z.position)
        return min(limit, max_speed_from_distance(z.max_jerk, z.max_acceleration, distance, arrival))


def _pace(behind_m: float, limit_m: float) -> float:
    """Share of its speed at which a trajectory goes on while the vehicle lags behind it."""
    return 1.0 - min(behind_m / limit_m, 1.0) if limit_m > LEAST_ERROR_M else 1.0


def _sum(velocity: float, feed_forward: float) -> float:
    return velocity + feed_forward if feed_forward == feed_forward else velocity
