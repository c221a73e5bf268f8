"""Collision prevention: POSCTL stops before what OBSTACLE_DISTANCE tells of."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.mavlink.services.obstacle_distance import distance
from sitl_emu.autopilot.topics import DistanceSensorSample, ManualControlSetpoint, ObstacleDistance, VehicleAttitude
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion

from .modes_follower import Follower

UNKNOWN = 65535
DO_SET_MODE = 176
BODY_FRD, LOCAL_NED = 12, 1
AHEAD, RIGHT = 0, 2
"""MAV_SENSOR_ORIENTATION."""


def fly_at_wall(follower: Follower, wall_north_m: float, seconds: float, frame: int = BODY_FRD) -> None:
    """Full stick ahead, towards a wall that a sensor all around tells of at 10 Hz."""
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    for _ in range(round(seconds * 10)):
        ahead_m = wall_north_m - follower.topics.vehicle_local_position.x
        distances = []
        for index in range(72):
            cosine = math.cos(math.radians(index * 5))
            away_m = ahead_m / cosine if cosine > 0.1 else math.inf
            distances.append(round(min(away_m, 20.01) * 100) if away_m > 0 else 0)
        follower.topics.obstacle_distance = ObstacleDistance(
            follower.now_us, frame, tuple(distances), 5.0, 20, 2000, 0.0
        )
        follower.fly(0.1)


@pytest.mark.parametrize("frame", [BODY_FRD, LOCAL_NED])
def test_it_stops_before_a_wall(frame: int) -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    fly_at_wall(follower, 40.0, 25.0, frame)
    local = follower.topics.vehicle_local_position
    assert 30.0 < local.x < 37.0
    assert abs(local.vx) < 0.3
    told = follower.topics.obstacle_distance_fused
    assert told.distances[0] == pytest.approx((40.0 - local.x) * 100.0, abs=100.0)
    assert (told.frame, told.increment, told.min_distance, told.max_distance) == (BODY_FRD, 5.0, 20, 2000)


def test_it_flies_into_it_where_prevention_is_off() -> None:
    follower = Follower(nav_state=NavState.POSCTL)
    fly_at_wall(follower, 40.0, 10.0)
    assert follower.topics.vehicle_local_position.x > 50.0


def test_what_it_knows_is_told_with_the_time_of_the_last_data() -> None:
    """CollisionPrevention::_updateObstacleMap publishes it all the same."""
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    fly_at_wall(follower, 40.0, 1.0)
    last_us = follower.topics.obstacle_distance.timestamp
    follower.fly(2.0)
    told = follower.topics.obstacle_distance_fused
    assert (told.timestamp, told.told_us) == (last_us, follower.now_us) and set(told.distances) == {65535}


def test_without_data_it_does_not_move() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    follower.fly(5.0)
    assert abs(follower.topics.vehicle_local_position.x) < 0.1


def holds(follower: Follower) -> list[tuple[float, ...]]:
    """Mode flag, main and sub mode of the commands to change the mode that were given inside."""
    commands = (record.command for record in follower.topics.navigator_commands)
    return [(each.param1, each.param2, each.param3) for each in commands if each.command == DO_SET_MODE]


def test_without_data_for_five_seconds_it_asks_for_hold_every_second() -> None:
    """CollisionPrevention::_calculateConstrainedSetpoint, _publishVehicleCmdDoLoiter."""
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.fly(4.9)
    assert holds(follower) == []
    follower.fly(0.5)
    assert holds(follower) == [(1.0, 4.0, 3.0)]
    follower.fly(1.0)
    assert len(holds(follower)) == 2


def test_the_five_seconds_begin_anew_with_the_mode_and_with_data() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.fly(4.5)
    for mode, seconds in ((NavState.ALTCTL, 1.0), (NavState.POSCTL, 4.5)):
        follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=mode)
        follower.fly(seconds)
    follower.topics.distance_sensors_outside = (DistanceSensorSample(follower.now_us, 9.0, 0.2, 10.0, 4, 0.5),)
    follower.fly(4.5)
    assert holds(follower) == []


def test_a_vehicle_with_another_system_id_does_not_obey_its_own_command_to_hold() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0, MAV_SYS_ID=2)
    follower.fly(7.0)
    assert holds(follower) == []


@pytest.mark.parametrize(("goes", "moved"), [(0, False), (1, True)])
def test_where_nothing_is_known_it_goes_only_if_it_may(goes: int, moved: bool) -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0, CP_GO_NO_DATA=goes, CP_GUIDE_ANG=0.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    for _ in range(50):
        # A sensor that looks backwards alone
        follower.topics.distance_sensors_outside = (DistanceSensorSample(follower.now_us, 9.0, 0.2, 10.0, 4, 0.5),)
        follower.fly(0.1)
    assert (follower.topics.vehicle_local_position.x > 5.0) is moved


def test_the_map_is_made_anew_with_the_mode() -> None:
    """With the flight task: where a sensor has looked before, one may go without data then (CP_GO_NO_DATA)."""
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0, CP_GO_NO_DATA=1, CP_GUIDE_ANG=0.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True)
    follower.topics.distance_sensors_outside = (DistanceSensorSample(follower.now_us, 9.0, 0.2, 10.0, AHEAD, 0.5),)
    follower.fly(1.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)

    def behind() -> None:
        follower.topics.distance_sensors_outside = (DistanceSensorSample(follower.now_us, 9.0, 0.2, 10.0, 4, 0.5),)

    follower.fly(3.0, behind)
    assert abs(follower.topics.vehicle_local_position.x) < 0.1
    for mode, seconds in ((NavState.AUTO_LOITER, 0.5), (NavState.POSCTL, 3.0)):
        follower.topics.vehicle_status = follower.topics.vehicle_status._replace(nav_state=mode)
        follower.fly(seconds, behind)
    assert follower.topics.vehicle_local_position.x > 1.0


def sensed(sample: DistanceSensorSample, *earlier: DistanceSensorSample, attitude: float = 0.0) -> dict[int, int]:
    """What the map knows after some samples, 0.3 s apart: cm by direction; `attitude`: pitch, rad."""
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.topics.vehicle_attitude = VehicleAttitude(q=quaternion(0.0, attitude, 0.0))
    for each in (*earlier, sample):
        follower.fly(0.3)
        follower.topics.distance_sensors_outside = (each._replace(timestamp=follower.now_us),)
        follower.fly(0.02)
    told = enumerate(follower.topics.obstacle_distance_fused.distances)
    return {index: cm for index, cm in told if cm != UNKNOWN}


def reading(metres: float, orientation: int = AHEAD, fov_deg: float = 20.0, quality: int = -1) -> DistanceSensorSample:
    return DistanceSensorSample(0, metres, 0.2, 10.0, orientation, math.radians(fov_deg), quality)


def test_a_sensor_tells_the_directions_that_are_nearest_to_its_borders() -> None:
    """The borders of 24 degrees to the right, 78 and 102, are nearest to 80 and 100."""
    assert sensed(reading(5.0, RIGHT, 24.0)) == dict.fromkeys(range(16, 21), 500)
    assert sensed(reading(5.0, AHEAD, 16.0)) == dict.fromkeys((70, 71, 0, 1, 2), 500)


@pytest.mark.parametrize(
    ("orientation", "yaw_deg", "middle"),
    [(100, 90.0, 18), (100, -40.0, 64), (100, math.nan, None), (12, 90.0, 0), (24, 90.0, None), (25, 90.0, None)],
)
def test_a_sensor_may_look_anywhere(orientation: int, yaw_deg: float, middle: int | None) -> None:
    """ObstacleMath's sensor_orientation_to_yaw_offset: 100 tells it by its quaternion; 12 turns about roll."""
    q = quaternion(0.0, 0.0, math.radians(yaw_deg))
    known = sensed(reading(5.0, orientation, 9.0)._replace(q=q))
    assert known == ({} if middle is None else dict.fromkeys(((middle + step) % 72 for step in (-1, 0, 1)), 500))


@pytest.mark.parametrize("metres", [0.1, 0.2, 0.0, math.nan])
def test_what_is_nearer_than_a_sensor_can_measure_tells_nothing(metres: float) -> None:
    """CollisionPrevention.cpp: the direction stays as it was, and is unknown after half a second."""
    assert sensed(reading(metres), reading(5.0))[0] == 500
    assert sensed(reading(metres), reading(5.0), reading(metres)) == {}
    assert sensed(reading(metres)) == {}


@pytest.mark.parametrize(("metres", "quality", "cm"), [(12.0, -1, 1000), (12.0, 0, 1000), (-1.0, 0, 1000)])
def test_a_sensor_that_sees_nothing_is_free_to_its_maximum(metres: float, quality: int, cm: int) -> None:
    assert sensed(reading(metres, quality=quality), attitude=1.0)[0] == cm
    assert sensed(reading(-1.0, quality=50)) == {}


def test_a_tilted_vehicle_sees_less_far() -> None:
    assert sensed(reading(5.0), attitude=math.radians(60.0))[0] == 250
    assert sensed(reading(5.0, RIGHT), attitude=math.radians(60.0))[18] == 500


def test_a_message_from_a_sensor_that_looks_aside_is_taken_as_it_is() -> None:
    """Below its minimum, above its maximum, and of no quality; one that looks down has seen nothing then."""
    for cm, quality, percent in ((5, 0, -1), (1200, 0, -1), (500, 1, 0), (500, 100, 100)):
        sample = distance(
            1, mavlink.MAVLink_distance_sensor_message(0, 20, 1000, cm, 0, 0, RIGHT, 0, 0.1, 0.1, [0] * 4, quality)
        )
        assert sample.current_distance == pytest.approx(cm * 0.01)
        assert (sample.signal_quality, sample.q) == (percent, (0.0, 0.0, 0.0, 0.0))
    down = distance(1, mavlink.MAVLink_distance_sensor_message(0, 20, 1000, 5, 0, 0, 25, 0))
    assert math.isnan(down.current_distance)


@pytest.mark.parametrize(
    ("increment", "offset", "place", "directions"),
    [(5.0, 0.0, 3, [3]), (5.0, 2.5, 71, [0]), (5.0, 2.5, 3, [3, 4]), (10.0, 0.0, 35, [69, 70, 71]), (1.0, 0.0, 8, [2])],
)
def test_a_distance_is_for_all_directions_that_it_touches(
    increment: float, offset: float, place: int, directions: list[int]
) -> None:
    """The last one, too, which ends where the first begins."""
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.fly(0.1)
    distances = tuple(500 if index == place else UNKNOWN for index in range(72))
    follower.topics.obstacle_distance = ObstacleDistance(
        follower.now_us, BODY_FRD, distances, increment, 20, 1000, offset
    )
    follower.fly(0.02)
    told = follower.topics.obstacle_distance_fused.distances
    assert [index for index, cm in enumerate(told) if cm != UNKNOWN] == directions


def test_obstacles_in_another_frame_are_told_of() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    follower.fly(0.1)
    follower.topics.obstacle_distance = ObstacleDistance(follower.now_us, 8, (500,) * 72, 5.0, 20, 1000, 0.0)
    follower.fly(0.1)
    (text,) = follower.texts.recent
    assert (text.severity, text.text) == (Severity.CRITICAL, "Obstacle message received in unsupported frame 8\t")
    (event,) = follower.texts.events.recent
    assert (event.id, event.arguments) == (layout("col_prev_unsup_frame")[0], bytes([8]))


def test_away_from_the_wall_it_is_free() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0)
    fly_at_wall(follower, 40.0, 20.0)
    near = follower.topics.vehicle_local_position.x
    for _ in range(50):
        follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=-1.0)
        distances = tuple(400 if index in (0, 1, 71) else 2001 for index in range(72))
        follower.topics.obstacle_distance = ObstacleDistance(follower.now_us, BODY_FRD, distances, 5.0, 20, 2000, 0.0)
        follower.fly(0.1)
    assert follower.topics.vehicle_local_position.x < near - 10.0


def test_nonsense_breaks_nothing() -> None:
    follower = Follower(nav_state=NavState.POSCTL, CP_DIST=4.0, CP_GUIDE_ANG=90.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0, roll=-1.0)
    for frame in (0, 1, 12, 99):
        for increment in (0.0, 1e-9, 400.0):
            follower.topics.obstacle_distance = ObstacleDistance(
                follower.now_us, frame, (0, 65534) * 36, increment, 65535, 0, 1e9
            )
            row = follower.fly(0.1)[-1]
            assert all(math.isfinite(value) for value in row.setpoint.velocity)
