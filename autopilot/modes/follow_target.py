"""AUTO_FOLLOW_TARGET: stay at a distance and an angle of something that moves, and look at it.

After PX4's FlightTaskAutoFollowTarget (v1.18): FLW_TGT_DST metres away, FLW_TGT_FA degrees from the target's course
(180: behind), FLW_TGT_HT metres above home (FLW_TGT_ALT_M 0), above the ground (1) or above the target (2); first the
height, then the place. A target that has not moved yet has a course to the north, one slower than 1 m/s keeps its own.
The angle begins in the north of the target, whoever comes from where, and turns no faster than FLW_TGT_MAX_VEL; on the
way to the target only the position controller limits the speed. Sticks change distance, height and angle. The gimbal
looks at the target where nobody controls it; who leaves the mode releases it from the autopilot's control. Without a
target it stands; near the ground it climbs.

Left out: without a home PX4 flies another mode.
"""

import math
from typing import Final

from sitl_emu.autopilot.modes import gimbal_control
from sitl_emu.autopilot.modes.flight_task import Setpoint, distance_to_ground_m, wants_takeoff
from sitl_emu.autopilot.modes.second_order_reference_model import SecondOrderReferenceModel
from sitl_emu.autopilot.modes.sticks import expo_deadzone
from sitl_emu.autopilot.modes.target_estimator import TargetEstimator
from sitl_emu.autopilot.modes.trajectory_constraints import max_speed_from_distance
from sitl_emu.autopilot.modes.velocity_smoothing import VelocitySmoothing
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    FollowTarget,
    GimbalManagerSetAttitude,
    ManualControlSetpoint,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleConstraints,
    VehicleLocalPosition,
)
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.geodesy import wrap_pi

ABOVE_HOME, ABOVE_GROUND, ABOVE_TARGET = range(3)
"""FLW_TGT_ALT_M."""
STANDS: Final = (0.0, 0.0, 0.0)
COURSE_SPEED_M_S: Final = 1.0
HEIGHT_FIRST_M: Final = 3.0
"""Farther than this from its height, the vehicle does not move sideways."""
LOOK_AT_M: Final = 1.0
"""Nearer, it does not turn to the target; sticks bring it no nearer."""
SAFE_HEIGHT_M: Final = 1.0
ASCENT_M_S: Final = 0.5
NATURAL_FREQUENCY, DAMPING_RATIO = 1.0, 0.7071
"""Of the filter that the target passes."""
TARGET_TIMEOUT_US: Final = 1_500_000
"""After so long without a target the filter begins anew."""
ORBIT_ACCELERATION, ORBIT_JERK = 2.0, 4.0
"""m/s² and m/s³ along the circle around the target."""
HEIGHT_SPEED, DISTANCE_SPEED, ANGLE_SPEED = 1.5, 2.0, 1.5
"""m/s, m/s and rad/s at a full stick."""
FARTHEST_M: Final = 100.0
"""Height and distance that sticks can ask for."""
BEHIND_S: Final = 0.5
"""A stick waits while the vehicle lags by more than it can change in this time."""
LEAST_RADIUS_M: Final = 0.01
"""A division by no distance is avoided; ours."""


class FollowTargetTask:
    """The flight task of AUTO_FOLLOW_TARGET."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._system_id = int(parameters["MAV_SYS_ID"])
        self._estimator = TargetEstimator()
        self._sample: FollowTarget | None = None
        self._filter = SecondOrderReferenceModel(NATURAL_FREQUENCY, DAMPING_RATIO)
        self._filtered_us = -TARGET_TIMEOUT_US
        self._course = 0.0
        self._orbit_angle = VelocitySmoothing()
        """Of the place around the target, from north."""
        self._home_z = 0.0
        self._position = self._velocity = self._acceleration = NAN3
        """Flown last: what PX4 does not set in one step stays as it was in the step before."""
        self._yaw = NAN
        self._asked = NAN3
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters; what sticks have changed stays until its parameter is changed."""
        value = self._parameters
        before, self._asked = self._asked, (value["FLW_TGT_HT"], value["FLW_TGT_DST"], value["FLW_TGT_FA"])
        height, distance, angle = self._asked
        if height != before[0]:
            self._height_m = height
        if distance != before[1]:
            self._distance_m = distance
        if angle != before[2]:
            self._follow_angle = wrap_pi(math.radians(angle))
        self._altitude_mode = int(value["FLW_TGT_ALT_M"])
        self._max_velocity = float(value["FLW_TGT_MAX_VEL"])
        self._estimator.set_responsiveness(float(value["FLW_TGT_RS"]))
        self._dead_zone = float(value["MAN_DEADZONE"])
        self._up, self._down = float(value["MPC_Z_VEL_MAX_UP"]), float(value["MPC_Z_VEL_MAX_DN"])

    def begin(self) -> None:
        """The mode is entered: the last FOLLOW_TARGET, however old, tells where the target is; its course is unknown.

        PX4 makes the task and its TargetEstimator anew then; uORB gives a new subscriber what was published last.
        """
        self._estimator.reset()
        self._sample = None
        self._course = 0.0

    def end(self, now_us: int) -> None:
        """Another mode is entered: the autopilot controls the gimbal no more, if it did (`gimbal_control`)."""
        gimbal_control.release(self._topics, now_us, self._system_id)

    def activate(self, last: TrajectorySetpoint) -> None:
        """Begin where the vehicle is, with the parameters' distance, height and angle."""
        local, home = self._topics.vehicle_local_position, self._topics.home_position
        self._position, self._velocity, self._acceleration = (local.x, local.y, local.z), NAN3, NAN3
        self._yaw = last.yaw if math.isfinite(last.yaw) else local.heading
        self._filter.reset(NAN3, NAN3)
        self._height_m, self._distance_m, angle = self._asked
        self._follow_angle = wrap_pi(math.radians(angle))
        self._orbit_angle.reset(0.0, 0.0, 0.0)
        self._home_z = home.z if home.valid and math.isfinite(home.z) else 0.0

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        topics, estimator = self._topics, self._estimator
        local = topics.vehicle_local_position
        estimator.predict(now_us, dt_s)
        if topics.follow_target is not self._sample:
            self._sample = topics.follow_target
            estimator.fuse(now_us, self._sample, local)
        if estimator.valid:
            self._follow(now_us, dt_s, local)
        else:
            self._position, self._velocity = NAN3, STANDS
        limits = VehicleConstraints(self._up, self._down, wants_takeoff(self._position, self._velocity, local))
        return TrajectorySetpoint(now_us, self._position, self._velocity, self._acceleration, self._yaw), limits

    def _follow(self, now_us: int, dt_s: float, local: VehicleLocalPosition) -> None:
        self._filter_target(now_us, dt_s)
        target, velocity, told = self._filter.state, self._filter.rate, self._estimator.velocity
        to_n, to_e = target[0] - local.x, target[1] - local.y
        distance_m, heading = math.hypot(to_n, to_e), math.atan2(to_e, to_n)
        sticks = self._topics.manual_control_setpoint
        if sticks.valid:
            self._adjust(sticks, distance_m, heading, local, dt_s)
        # Where the target stops, the filter's velocity swings to the other side
        if min(math.hypot(velocity[0], velocity[1]), math.hypot(told[0], told[1])) >= COURSE_SPEED_M_S:
            self._course = math.atan2(velocity[1], velocity[0])
        self._turn_orbit(dt_s)
        height_m = distance_to_ground_m(local, self._topics.home_position)
        below = self._home_z
        if self._altitude_mode == ABOVE_GROUND:
            below = local.z + height_m
        elif self._altitude_mode == ABOVE_TARGET:
            below = target[2]
        self._go(target, velocity, below - self._height_m, local)
        if distance_m > LOOK_AT_M:
            self._yaw = heading
        self._point_gimbal(now_us, below - local.z, distance_m)
        if height_m < SAFE_HEIGHT_M:
            self._position, self._velocity = (NAN, NAN, local.z), (0.0, 0.0, -ASCENT_M_S)

    def _filter_target(self, now_us: int, dt_s: float) -> None:
        """The target without its jumps (updateTargetPositionVelocityFilter)."""
        estimator, filtered = self._estimator, self._filter
        is_late = now_us - self._filtered_us > TARGET_TIMEOUT_US
        self._filtered_us = now_us
        if is_late or not math.isfinite(sum(filtered.state) + sum(filtered.rate)):
            filtered.reset(estimator.position, estimator.velocity)
        else:
            filtered.update(dt_s, estimator.position, estimator.velocity)

    def _adjust(
        self, sticks: ManualControlSetpoint, distance_m: float, heading: float, local: VehicleLocalPosition, dt_s: float
    ) -> None:
        """Height by throttle, distance by pitch, angle by roll (updateRcAdjustedFollow...)."""
        throttle, pitch, roll = (
            expo_deadzone(stick, self._dead_zone) for stick in (sticks.throttle, sticks.pitch, sticks.roll)
        )
        if abs(self._position[2] - local.z) < HEIGHT_SPEED * BEHIND_S:
            self._height_m = _within(SAFE_HEIGHT_M, self._height_m + HEIGHT_SPEED * throttle * dt_s)
        if abs(distance_m - self._distance_m) < DISTANCE_SPEED * BEHIND_S:
            self._distance_m = _within(LOOK_AT_M, self._distance_m + DISTANCE_SPEED * pitch * dt_s)
        if abs(wrap_pi(heading + math.pi - self._orbit_angle.position)) < ANGLE_SPEED * BEHIND_S:
            rate = min(ANGLE_SPEED, self._max_velocity / max(self._distance_m, LEAST_RADIUS_M))
            self._follow_angle = wrap_pi(self._follow_angle + rate * roll * dt_s)

    def _turn_orbit(self, dt_s: float) -> None:
        """The angle around the target, the short way to where it is to be (updateOrbitAngleTrajectory)."""
        angle, radius_m = self._orbit_angle, max(self._distance_m, LEAST_RADIUS_M)
        angle.max_jerk, angle.max_acceleration = ORBIT_JERK / radius_m, ORBIT_ACCELERATION / radius_m
        angle.max_velocity = self._max_velocity / radius_m
        missing = wrap_pi(self._course + self._follow_angle - angle.position)
        rate = max_speed_from_distance(angle.max_jerk, angle.max_acceleration, abs(missing), 0.0)
        angle.update_durations(math.copysign(rate, missing) if missing else 0.0)
        angle.update_trajectory(dt_s)

    def _go(self, target: Vector3, velocity: Vector3, down: float, local: VehicleLocalPosition) -> None:
        """To the place around the target, which moves with it and along the circle; while too high or low, only there.

        Its position setpoint is that place, however far the vehicle is from it.
        """
        angle, radius_m = self._orbit_angle, self._distance_m
        cosine, sine = math.cos(angle.position), math.sin(angle.position)
        place = (target[0] + cosine * radius_m, target[1] + sine * radius_m, down)
        if not math.isfinite(sum(place)):
            self._position, self._velocity, self._acceleration = (local.x, local.y, local.z), STANDS, NAN3
        elif abs(down - local.z) < HEIGHT_FIRST_M:
            along, to_along = angle.velocity * radius_m, angle.acceleration * radius_m
            inwards = along * angle.velocity
            self._position = place
            self._velocity = (velocity[0] - sine * along, velocity[1] + cosine * along, self._velocity[2])
            self._acceleration = (
                -cosine * inwards - sine * to_along, -sine * inwards + cosine * to_along, self._acceleration[2]
            )  # fmt: skip
        else:
            self._position = (local.x, local.y, down)

    def _point_gimbal(self, now_us: int, height_m: float, distance_m: float) -> None:
        """Down to the target as somebody who is nobody: who controls the gimbal keeps it (pointGimbalAt)."""
        pitch = math.atan2(height_m, distance_m) if math.isfinite(height_m) else 0.0
        q = quaternion(0.0, -pitch, 0.0)
        self._topics.gimbal_manager_set_attitude = GimbalManagerSetAttitude(now_us, q=q, angular_velocity=STANDS)


def _within(least: float, value: float) -> float:
    return max(least, min(FARTHEST_M, value))
