"""Collision prevention: what sticks may ask for near obstacles. PX4's CollisionPrevention (v1.18).

A map of 72 directions around the body is filled by OBSTACLE_DISTANCE and by DISTANCE_SENSORs that look sideways, and
forgets what is older than half a second. A sensor that sees something nearer than it can measure tells nothing. With
CP_DIST above 0 the acceleration towards the nearest obstacle shrinks as the vehicle comes near CP_DIST, and speed that
could not be stopped in time is braked away (CP_DELAY). Where nothing is known one goes only with CP_GO_NO_DATA; without
any data, not at all, and after 5 s the mode is HOLD. CP_GUIDE_ANG turns the stick's direction to the wider gap.
"""

import math

from sitl_emu.autopilot.commands.vehicle_commands import give_inside, nearest, tell
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.modes.trajectory_constraints import max_speed_from_distance
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.distance_sensors import distance_sensors
from sitl_emu.autopilot.topics import (
    CollisionConstraints,
    DistanceSensorSample,
    ObstacleDistance,
    Topics,
    VehicleCommand,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import heading, rotated, rotation
from sitl_emu.core.c_types import truncated

BINS = 72
BIN_DEG = 5
TIMEOUT_US = 500_000
HOLD_AFTER_US = 5_000_000
"""TIMEOUT_HOLD_US."""
WARNS_EVERY_US = 1_000_000
AWAY_US = 100_000
"""Not asked for so long, another task has flown: PX4 makes prevention and map anew with each task."""
HOLDS_SYSTEM, HOLDS_COMPONENT = 1, 1
"""The command to hold is for these, whatever MAV_SYS_ID is (_publishVehicleCmdDoLoiter)."""
UNKNOWN = 65535
"""Nothing was measured there; distances in cm, as in the message."""
FRAME_GLOBAL, FRAME_LOCAL_NED, FRAME_BODY_FRD = 0, 1, 12
LEAST_STICK = 0.001
YAW_OF_ORIENTATION_DEG = 45
"""MAV_SENSOR_ORIENTATION 0 to 7 turn by this to the right."""
HORIZONTAL = range(8)
UPWARD, DOWNWARD, CUSTOM = 24, 25, 100
NOTHING_IN_RANGE = (-1.0, 0)
"""Distance and signal quality of a sensor that sees as far as it can."""
LEAST_PROJECTION = 1.2e-7

Vector2 = tuple[float, float]


class CollisionPrevention:
    """The map, and the limits that follow from it."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._topics = topics
        self._say, self._send = say, send
        self._limited_us = -AWAY_US - 1
        self._warned_us = 0
        self._obeys_hold = int(parameters["MAV_SYS_ID"]) == HOLDS_SYSTEM
        self._begin(0)
        self.refresh(parameters)

    def _begin(self, now_us: int) -> None:
        """Know nothing yet but what was told last."""
        self._distances = [UNKNOWN] * BINS
        self._measured_us = [-TIMEOUT_US - 1] * BINS
        self._ranges = [0] * BINS
        self._known = [False] * BINS
        self._nearest_cm = UNKNOWN
        self._obstacles: ObstacleDistance | None = None
        self._sensors: tuple[DistanceSensorSample, ...] = ()
        self._since_us, self._heard_us = now_us, 0

    def refresh(self, value: Parameters) -> None:
        """Copy the parameters."""
        self.active = float(value["CP_DIST"]) > 0.0
        self._distance_m, self._delay_s = float(value["CP_DIST"]), float(value["CP_DELAY"])
        self._go_without_data = bool(value["CP_GO_NO_DATA"])
        self._guide_bins = int(min(float(value["CP_GUIDE_ANG"]) / BIN_DEG, BINS // 2))  # that is all round
        self._acceleration, self._jerk = float(value["MPC_ACC_HOR"]), float(value["MPC_JERK_MAX"])
        self._gain = float(value["MPC_XY_VEL_P_ACC"])
        self._scale_m = float(value["MPC_VEL_MANUAL"]) / float(value["MPC_XY_P"]) if value["MPC_XY_P"] else 1.0

    def limit(self, now_us: int, acceleration: Vector2, velocity: Vector2) -> Vector2:
        """(north, east) acceleration that is left of what the sticks ask for."""
        left = self._left(now_us, acceleration, velocity)
        self._topics.collision_constraints = CollisionConstraints(now_us, acceleration, left)
        return left

    def _left(self, now_us: int, acceleration: Vector2, velocity: Vector2) -> Vector2:
        if now_us - self._limited_us > AWAY_US:
            self._begin(now_us)
        self._limited_us = now_us
        self._take(now_us)
        size = math.hypot(*acceleration)
        if not any(distance < UNKNOWN for distance in self._distances):
            self._hold_without_data(now_us)
            return 0.0, 0.0
        if size <= LEAST_STICK:
            return acceleration
        yaw = self._topics.vehicle_local_position.heading
        keep_m = max(self._nearest_cm * 0.01, self._distance_m)
        wanted = math.degrees(math.atan2(acceleration[1], acceleration[0]) - yaw) % 360.0
        index = _bin(wanted)
        direction = (acceleration[0] / size, acceleration[1] / size)
        guided = self._guided(index)
        if guided != index:
            index, direction = guided, self._direction(guided, yaw)
        allowed = (0.0, 0.0)
        if self._distances[index] < UNKNOWN or (self._go_without_data and not self._known[index]):
            allowed = self._slowed(direction, size, keep_m, yaw)
        braking, brakes_along = self._braking(now_us, velocity, keep_m, yaw)
        return allowed[0] + braking * brakes_along[0], allowed[1] + braking * brakes_along[1]

    def _hold_without_data(self, now_us: int) -> None:
        """Ask for HOLD, once a second, where nothing has told of obstacles for long (_calculateConstrainedSetpoint)."""
        if min(now_us - self._warned_us, now_us - self._since_us) <= WARNS_EVERY_US:
            return
        self._warned_us = now_us
        if min(now_us - self._heard_us, now_us - self._since_us) <= HOLD_AFTER_US or not self._obeys_hold:
            return
        hold = FLIGHT_MODES[NavState.AUTO_LOITER]
        command = VehicleCommand(
            mavlink.MAV_CMD_DO_SET_MODE, float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), float(hold.main_mode),
            float(hold.sub_mode), target_system=HOLDS_SYSTEM, target_component=HOLDS_COMPONENT,
            source_system=HOLDS_SYSTEM, source_component=HOLDS_COMPONENT, from_external=False,
        )  # fmt: skip
        give_inside(self._topics, now_us, command)
        tell(self._topics, now_us, command)

    # --- map ------------------------------------------------------------------------------------------------

    def _take(self, now_us: int) -> None:
        topics = self._topics
        if topics.obstacle_distance is not self._obstacles:
            self._obstacles = topics.obstacle_distance
            if _is_fresh(now_us, self._obstacles.timestamp):
                self._add_obstacles(self._obstacles)
        before, self._sensors = self._sensors, distance_sensors(topics)
        for sensor in self._sensors:
            if not any(sensor is each for each in before) and _is_fresh(now_us, sensor.timestamp):
                self._add_sensor(sensor)
        for index, measured_us in enumerate(self._measured_us):
            if now_us - measured_us > TIMEOUT_US:
                self._distances[index] = UNKNOWN
        topics.obstacle_distance_fused = ObstacleDistance(
            self._heard_us, FRAME_BODY_FRD, tuple(self._distances), float(BIN_DEG), self._nearest_cm, max(self._ranges),
            told_us=now_us,
        )  # fmt: skip

    def _add_obstacles(self, obstacles: ObstacleDistance) -> None:
        """Each distance in all directions that its angle touches (_addObstacleSensorData)."""
        increment, offset = obstacles.increment, obstacles.angle_offset
        if increment <= 0.0:
            return
        self._heard_us = max(self._heard_us, obstacles.timestamp)
        self._nearest_cm = min(self._nearest_cm, obstacles.min_distance)
        if obstacles.frame in (FRAME_GLOBAL, FRAME_LOCAL_NED):
            offset -= math.degrees(self._topics.vehicle_local_position.heading)
        elif obstacles.frame != FRAME_BODY_FRD:
            self._say(Severity.CRITICAL, f"Obstacle message received in unsupported frame {obstacles.frame}\t")
            self._send("col_prev_unsup_frame", Severity.ERROR, obstacles.frame)
            return
        for place, distance in enumerate(obstacles.distances if math.isfinite(offset) else ()):
            if place * increment >= 360.0:
                break
            if distance != UNKNOWN:
                for index in _touched(place, increment, offset):
                    self._enter(obstacles.timestamp, index, distance, obstacles.max_distance)

    def _add_sensor(self, sensor: DistanceSensorSample) -> None:
        yaw = _yaw_of(sensor)
        if yaw is None:
            return
        self._heard_us = max(self._heard_us, sensor.timestamp)
        self._nearest_cm = min(self._nearest_cm, int(sensor.min_distance * 100.0))
        reading = min(sensor.current_distance, sensor.max_distance)
        if (sensor.current_distance, sensor.signal_quality) == NOTHING_IN_RANGE:
            reading = sensor.max_distance
        if not reading > sensor.min_distance:
            return
        middle, half = math.degrees(yaw), math.degrees(sensor.h_fov) / 2.0
        if reading < sensor.max_distance:
            reading *= self._horizontal_share(yaw)
        reading_cm, furthest_cm = nearest(100.0 * reading), nearest(100.0 * sensor.max_distance)
        for index in range(nearest((middle - half) / BIN_DEG), nearest((middle + half) / BIN_DEG) + 1):
            self._enter(sensor.timestamp, index % BINS, reading_cm, furthest_cm)

    def _horizontal_share(self, yaw: float) -> float:
        """What of a distance is horizontal, for a sensor on a tilted vehicle (project_distance_on_horizontal_plane)."""
        ahead = (math.cos(yaw), math.sin(yaw), 0.0)
        north, east, _ = rotated(rotation(self._topics.vehicle_attitude.q), ahead)
        return max(LEAST_PROJECTION, min(1.0, math.hypot(north, east)))

    def _enter(self, measured_us: int, index: int, distance: int, furthest: int) -> None:
        """The sensor with the shortest range wins where it sees something, the one with the longest where none does."""
        in_range, had_in_range = distance < furthest, self._distances[index] < self._ranges[index]
        known_range = self._ranges[index]
        if in_range:
            use = not had_in_range or furthest <= known_range
        else:
            use = furthest == known_range if had_in_range else furthest >= known_range
        if use:
            self._distances[index], self._measured_us[index] = distance, measured_us
            self._ranges[index], self._known[index] = furthest, True

    # --- limits ---------------------------------------------------------------------------------------------

    @staticmethod
    def _direction(index: int, yaw: float) -> Vector2:
        angle = yaw + math.radians(index * BIN_DEG)
        return math.cos(angle), math.sin(angle)

    def _guided(self, wanted: int) -> int:
        """The direction with the most room within CP_GUIDE_ANG of what the sticks ask for."""
        best, best_cost = wanted, math.inf
        distances, assumed = self._distances, self._distance_m * 100.0
        for way in range(wanted - self._guide_bins, wanted + self._guide_bins + 1):
            index = way % BINS
            if distances[index] == UNKNOWN:
                continue
            around = (distances[(index + step) % BINS] for step in (-1, 0, 1))
            mean = sum(assumed if distance == UNKNOWN else distance for distance in around) / 3.0
            cost = 50.0 * self._distance_m * abs(way - wanted) - mean - distances[index]
            if cost < best_cost:
                best, best_cost = index, cost
        return best

    def _slowed(self, direction: Vector2, size: float, keep_m: float, yaw: float) -> Vector2:
        """Less acceleration towards the nearest obstacle; along it as much as there is room."""
        index = min(range(BINS), key=self._distances.__getitem__)
        obstacle = self._direction(index, yaw)
        towards = direction[0] * obstacle[0] + direction[1] * obstacle[1]
        if towards <= 0.0:
            return direction[0] * size, direction[1] * size
        normal = (obstacle[0] * towards, obstacle[1] * towards)
        along = (direction[0] - normal[0], direction[1] - normal[1])
        at_normal = self._scale(self._distances[index] * 0.01, keep_m)
        at_along = 0.0
        if math.hypot(*along) > 1e-6:
            angle = math.degrees(math.atan2(along[1], along[0]) - yaw) % 360.0
            at_along = self._scale(self._distances[nearest(angle / BIN_DEG) % BINS] * 0.01, keep_m)
        return (
            (along[0] * at_along + normal[0] * at_normal) * size,
            (along[1] * at_along + normal[1] * at_normal) * size,
        )

    def _scale(self, distance_m: float, keep_m: float) -> float:
        room = distance_m - keep_m
        share = room / max(keep_m, self._scale_m)
        return min(share * share if room > 0.0 else room, 1.0)

    def _braking(self, now_us: int, velocity: Vector2, keep_m: float, yaw: float) -> tuple[float, Vector2]:
        """Acceleration (negative) along the direction in which the vehicle is too fast to stop in time."""
        worst, along = 0.0, (0.0, 0.0)
        for index, distance in enumerate(self._distances):
            if not self._nearest_cm < distance < UNKNOWN:
                continue
            direction = self._direction(index, yaw)
            speed = max(0.0, velocity[0] * direction[0] + velocity[1] * direction[1])
            late_s = self._delay_s
            if distance < self._ranges[index]:
                late_s += (now_us - self._measured_us[index]) * 1e-6
            room_m = max(0.0, distance * 0.01 - keep_m - speed * late_s)
            allowed = max_speed_from_distance(self._jerk, self._acceleration, room_m, 0.0)
            braking = self._gain * (allowed - speed)
            if braking < worst:
                worst, along = braking, direction
        return worst, along


def _touched(place: int, increment: float, offset: float) -> range:
    """The directions of the map that a distance's angle touches; the last distance ends where the first begins."""
    count = max(1, int(360.0 / increment))
    lower = (place % count * increment + offset - increment / 2.0) % 360.0
    upper = ((place + 1) % count * increment + offset - increment / 2.0) % 360.0
    if lower > upper:
        lower -= 360.0
    first, last = math.floor(lower / BIN_DEG - 0.5) + 1, math.ceil(upper / BIN_DEG + 0.5)
    return range(max(first, 0), min(last, BINS))


def _yaw_of(sensor: DistanceSensorSample) -> float | None:
    """To where it looks, 0 to 2π to the right; None up, down or nowhere (sensor_orientation_to_yaw_offset).

    An orientation that is neither level nor of its own is taken for forward.
    """
    if sensor.orientation in (UPWARD, DOWNWARD):
        return None
    if sensor.orientation != CUSTOM:
        return math.radians(sensor.orientation * YAW_OF_ORIENTATION_DEG) if sensor.orientation in HORIZONTAL else 0.0
    yaw = heading(sensor.q)
    return yaw % math.tau if math.isfinite(yaw) else None


def _is_fresh(now_us: int, time_us: int) -> bool:
    """What was told at that time (0: never) still counts."""
    return time_us > 0 and now_us - time_us < TIMEOUT_US


def _bin(angle_deg: float) -> int:
    """The direction of the map for an angle of 0 to 360; the first one while no heading is known."""
    return max(0, min(truncated(angle_deg / BIN_DEG), BINS - 1))
