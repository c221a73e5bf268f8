"""AUTO_FOLLOW_TARGET: stay at a distance and an angle of something that moves, and look at it.

After PX4's FlightTaskAutoFollowTarget (v1.18): FLW_TGT_DST metres away, FLW_TGT_FA degrees from the target's course
(180: behind), FLW_TGT_HT metres above home (FLW_TGT_ALT_M 0), above the ground (1) or above the target (2); first the
height, then the place. A target slower than 1 m/s has no course: the angle stays as it is. FLW_TGT_MAX_VEL limits how
fast the place around the target changes. Without a target, and in the second before it is known, it hovers.

Left out: sticks that change distance, height and angle, and pointing the gimbal.
"""

import math

from sitl_emu.autopilot.modes.flight_task import Setpoint, distance_to_ground_m, start_state
from sitl_emu.autopilot.modes.target_estimator import TargetEstimator
from sitl_emu.autopilot.modes.vectors import shortened
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import NAN, Topics, TrajectorySetpoint, Vector3, VehicleConstraints
from sitl_emu.core.geodesy import wrap_pi

ABOVE_HOME, ABOVE_GROUND, ABOVE_TARGET = range(3)
"""FLW_TGT_ALT_M."""
COURSE_SPEED_M_S = 1.0
HEIGHT_FIRST_M = 3.0
"""Farther than this from its height, the vehicle does not move sideways."""
LOOK_AT_M = 1.0
SAFE_HEIGHT_M = 1.0
ASCENT_M_S = 0.2
POSITION_GAIN = 1.0


class FollowTargetTask:
    """The flight task of AUTO_FOLLOW_TARGET."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._parameters = parameters
        self._estimator = TargetEstimator()
        self._sample = topics.follow_target
        self._angle = NAN
        """Of the place around the target, from north; NaN before there is a target."""
        self._course = NAN
        self._position: Vector3 = (0.0, 0.0, 0.0)
        self._velocity: Vector3 = (0.0, 0.0, 0.0)
        self._yaw = 0.0
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters."""
        value = self._parameters
        self._height_m, self._distance_m = float(value["FLW_TGT_HT"]), float(value["FLW_TGT_DST"])
        self._follow_angle = math.radians(value["FLW_TGT_FA"])
        self._altitude_mode = int(value["FLW_TGT_ALT_M"])
        self._max_velocity = float(value["FLW_TGT_MAX_VEL"])
        self._estimator.set_responsiveness(float(value["FLW_TGT_RS"]))
        self._acceleration = float(value["MPC_ACC_HOR"])
        self._up, self._down = float(value["MPC_Z_V_AUTO_UP"]), float(value["MPC_Z_V_AUTO_DN"])
        self._vertical_acceleration = min(float(value["MPC_ACC_UP_MAX"]), float(value["MPC_ACC_DOWN_MAX"]))
        self._yaw_rate = math.radians(value["MPC_YAWRAUTO_MAX"])
        self._limits = VehicleConstraints(float(value["MPC_Z_VEL_MAX_UP"]), float(value["MPC_Z_VEL_MAX_DN"]), False)

    def activate(self, last: TrajectorySetpoint) -> None:
        """Begin where the vehicle is, with a target that has to be told anew."""
        local = self._topics.vehicle_local_position
        self._position, self._velocity, _ = start_state(last, local)
        self._yaw = last.yaw if math.isfinite(last.yaw) else local.heading
        self._estimator.reset()
        self._sample = self._topics.follow_target
        self._angle = self._course = NAN

    def update(self, now_us: int, dt_s: float) -> Setpoint:
        """One step."""
        topics, estimator = self._topics, self._estimator
        local = topics.vehicle_local_position
        estimator.predict(now_us, dt_s)
        if topics.follow_target is not self._sample:
            self._sample = topics.follow_target
            estimator.fuse(now_us, self._sample, local)
        if not estimator.valid:
            self._track(self._position, (0.0, 0.0, 0.0), dt_s)
            return self._setpoint(now_us), self._limits
        down = self._wanted_down(local.z)
        if abs(down - local.z) < HEIGHT_FIRST_M:
            place, speed = self._place(dt_s)
            self._track((place[0], place[1], down), (*speed, 0.0), dt_s)
        else:
            here = self._position
            self._track((here[0], here[1], down), (0.0, 0.0, 0.0), dt_s)
        self._look_at_target(dt_s)
        if distance_to_ground_m(local, topics.home_position) < SAFE_HEIGHT_M:
            away = TrajectorySetpoint(now_us, (NAN, NAN, NAN), (0.0, 0.0, -ASCENT_M_S), yaw=self._yaw)
            return away, self._limits
        return self._setpoint(now_us), self._limits

    def _wanted_down(self, present: float) -> float:
        topics = self._topics
        if self._altitude_mode == ABOVE_TARGET:
            return self._estimator.position[2] - self._height_m
        home, local = topics.home_position, topics.vehicle_local_position
        if self._altitude_mode == ABOVE_GROUND and local.dist_bottom_valid:
            return present + local.dist_bottom - self._height_m
        ground = home.z if home.valid and math.isfinite(home.z) else 0.0
        return ground - self._height_m

    def _place(self, dt_s: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where around the target, and how fast that moves."""
        target, velocity = self._estimator.position, self._estimator.velocity
        if math.isnan(self._angle):
            self._angle = math.atan2(self._position[1] - target[1], self._position[0] - target[0])
        if math.hypot(velocity[0], velocity[1]) > COURSE_SPEED_M_S:
            self._course = math.atan2(velocity[1], velocity[0])
        turn = 0.0
        if math.isfinite(self._course):
            limit = self._max_velocity / self._distance_m * dt_s
            turn = max(-limit, min(limit, wrap_pi(self._course + self._follow_angle - self._angle)))
            self._angle = wrap_pi(self._angle + turn)
        cosine, sine = math.cos(self._angle), math.sin(self._angle)
        tangential = turn / dt_s * self._distance_m if dt_s > 0.0 else 0.0
        place = (target[0] + cosine * self._distance_m, target[1] + sine * self._distance_m)
        return place, (velocity[0] - sine * tangential, velocity[1] + cosine * tangential)

    def _track(self, place: Vector3, speed: Vector3, dt_s: float) -> None:
        """Move the setpoint to a place that moves, with limited speed and acceleration."""
        (x, y, z), (vx, vy, vz) = self._position, self._velocity
        to_x, to_y = POSITION_GAIN * (place[0] - x), POSITION_GAIN * (place[1] - y)
        to_x, to_y = shortened(to_x, to_y, self._max_velocity)
        step_x, step_y = shortened(to_x + speed[0] - vx, to_y + speed[1] - vy, self._acceleration * dt_s)
        wanted_z = max(-self._up, min(self._down, POSITION_GAIN * (place[2] - z) + speed[2]))
        limit = self._vertical_acceleration * dt_s
        vx, vy, vz = vx + step_x, vy + step_y, vz + max(-limit, min(limit, wanted_z - vz))
        self._velocity = (vx, vy, vz)
        self._position = (x + vx * dt_s, y + vy * dt_s, z + vz * dt_s)

    def _look_at_target(self, dt_s: float) -> None:
        local, target = self._topics.vehicle_local_position, self._estimator.position
        north, east = target[0] - local.x, target[1] - local.y
        if math.hypot(north, east) > LOOK_AT_M:
            step = self._yaw_rate * dt_s
            turn = wrap_pi(math.atan2(east, north) - self._yaw)
            self._yaw = wrap_pi(self._yaw + max(-step, min(step, turn)))

    def _setpoint(self, now_us: int) -> TrajectorySetpoint:
        return TrajectorySetpoint(now_us, self._position, self._velocity, yaw=self._yaw)
