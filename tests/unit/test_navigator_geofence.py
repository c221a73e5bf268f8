"""The fence and its limits, and regions of interest, on a point that is where its setpoint says."""

import math

import pytest

from sitl_emu.autopilot.storage.dataman import FENCE, MissionItem, Plan
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

from .navigation_fake import PLACE, FakeVehicle, flying, place

NAN = math.nan


def fence(command: int, corners: list[tuple[float, float]], param1: float) -> tuple[MissionItem, ...]:
    """Fence items at (north, east) metres from home."""
    items = []
    for seq, (north, east) in enumerate(corners):
        lat, lon = PLACE.reproject(north, east)
        items.append(MissionItem(seq, 0, command, 1, param1, 0, 0, NAN, round(lat * 1e7), round(lon * 1e7), 0.0))
    return tuple(items)


SQUARE = [(30.0, 30.0), (30.0, -30.0), (-30.0, -30.0), (-30.0, 30.0)]
AHEAD = [(30.0, 20.0), (30.0, -20.0), (60.0, -20.0), (60.0, 20.0)]
INCLUSION = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
EXCLUSION = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
CIRCLE_OUT = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
CIRCLE_IN = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION


@pytest.mark.parametrize(
    ("items", "inside", "outside"),
    [
        (fence(INCLUSION, SQUARE, 4), (20.0, -20.0), (31.0, 0.0)),
        (fence(EXCLUSION, AHEAD, 4), (29.0, 0.0), (40.0, 5.0)),
        (fence(CIRCLE_IN, [(0.0, 0.0)], 25.0), (17.0, 17.0), (0.0, 26.0)),
        (fence(CIRCLE_OUT, [(40.0, 0.0)], 10.0), (20.0, 0.0), (35.0, 5.0)),
        (fence(INCLUSION, SQUARE, 4) + fence(CIRCLE_IN, [(0.0, 0.0)], 25.0), (17.0, 17.0), (28.0, 0.0)),
    ],
)
def test_reposition_beyond_the_fence_is_refused(
    items: tuple[MissionItem, ...], inside: tuple[float, float], outside: tuple[float, float]
) -> None:
    vehicle = flying(GF_ACTION=0)
    vehicle.reposition(*inside, 10.0)
    vehicle.run(10.0)
    vehicle.dataman.store(FENCE, Plan(items, 1), 0)
    vehicle.parameters.set("GF_ACTION", 2)
    vehicle.reposition(*outside, 10.0)
    vehicle.step()
    assert "Reposition is outside geofence" in vehicle.take_texts()
    lat = PLACE.reproject(*inside)[0]
    assert vehicle.topics.position_setpoint_triplet.current.lat == pytest.approx(lat, abs=1e-7)
    vehicle.reposition(*inside, 12.0)
    vehicle.run(5.0)
    assert place(vehicle) == (*inside, 12.0)


@pytest.mark.parametrize(
    ("items", "north", "text"),
    [
        (fence(EXCLUSION, SQUARE, 4), 0.0, "Geofence invalid, doesn't contain Home position"),
        (fence(CIRCLE_IN, [(40.0, 0.0)], -10.0), 40.0, "Geofence invalid, doesn't contain Home position"),
        (fence(INCLUSION, SQUARE, 4), 40.0, "Geofence invalid, doesn't contain current vehicle position"),
        (fence(CIRCLE_IN, [(0.0, 0.0)], -25.0), 10.0, None),
    ],
)
def test_a_fence_that_is_broken_at_once_is_not_watched(
    items: tuple[MissionItem, ...], north: float, text: str | None
) -> None:
    vehicle = flying(GF_ACTION=1)
    vehicle.take_texts()
    vehicle.north = north
    vehicle.step()
    vehicle.dataman.store(FENCE, Plan(items, 1), 0)
    vehicle.run(0.3)
    texts = vehicle.take_texts()
    assert texts[:1] == ([] if text is None else [text])
    assert not vehicle.topics.geofence_result.breached


def test_a_fence_that_was_left_out_stays_so_when_it_is_uploaded_again() -> None:
    """Geofence::run knows it by its id; another one in between makes it new."""
    vehicle = flying(GF_ACTION=1)
    square = fence(INCLUSION, SQUARE, 4)
    vehicle.north = 40.0
    vehicle.step()
    told = [upload_fence(vehicle, square)]
    vehicle.north = 0.0
    vehicle.step()
    told += [upload_fence(vehicle, tuple(square)), upload_fence(vehicle, ()), upload_fence(vehicle, square)]
    assert told == [["Geofence invalid, doesn't contain current vehicle position"], [], [], []]
    vehicle.north = 40.0
    vehicle.run(0.3)
    assert vehicle.topics.geofence_result.breached


@pytest.mark.parametrize("again", [False, True])
def test_whether_a_fence_is_watched(again: bool) -> None:
    vehicle = flying(GF_ACTION=1)
    vehicle.north = 40.0 if again else 0.0
    vehicle.step()
    upload_fence(vehicle, fence(INCLUSION, SQUARE, 4))
    vehicle.north = 0.0
    vehicle.step()
    upload_fence(vehicle, fence(INCLUSION, SQUARE, 4))
    vehicle.north = 40.0
    vehicle.run(0.3)
    assert vehicle.topics.geofence_result.breached is not again


def upload_fence(vehicle: FakeVehicle, items: tuple[MissionItem, ...]) -> list[str]:
    """What is said of it."""
    vehicle.take_texts()
    vehicle.dataman.store(FENCE, Plan(items, len(items)), 0)
    vehicle.run(0.3)
    return vehicle.take_texts()


WITHOUT_HOME = "Geofence invalid, doesn't contain Home position"


@pytest.mark.parametrize(
    ("items", "texts", "watched"),
    [
        (fence(CIRCLE_IN, [(0.0, 0.0)], 90.0) + fence(INCLUSION, SQUARE, 4), [WITHOUT_HOME] * 3, 2),
        (fence(INCLUSION, SQUARE, 4) + fence(CIRCLE_IN, [(0.0, 0.0)], 90.0), [], 2),
        (fence(CIRCLE_OUT, [(90.0, 0.0)], 9.0) + fence(EXCLUSION, AHEAD, 4), [], 5),
        (fence(INCLUSION, SQUARE[:3], 4), [WITHOUT_HOME], 0),
    ],
)
def test_a_polygon_behind_a_circle_is_one_area_for_each_vertex(
    items: tuple[MissionItem, ...], texts: list[str], watched: int
) -> None:
    """As Geofence::_updateFence reads it; an area that lacks a vertex contains nothing, so not home either."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    assert upload_fence(vehicle, items) == texts
    assert len(vehicle.navigator.fence_areas) == watched


def test_a_fence_of_before_the_start_is_watched() -> None:
    vehicle = FakeVehicle(GF_ACTION=1)
    vehicle.dataman.store(FENCE, Plan(fence(CIRCLE_IN, [(0.0, 0.0)], 25.0), 1), 0)
    vehicle = FakeVehicle(VehicleKind.MULTICOPTER, vehicle.dataman, GF_ACTION=1)
    vehicle.run(3.0)
    vehicle.north = 30.0
    vehicle.run(0.3)
    assert vehicle.topics.geofence_result.breached


def test_breaking_a_fence_with_hold_comes_back_to_where_it_was_broken() -> None:
    vehicle = flying(GF_ACTION=2)
    vehicle.dataman.store(FENCE, Plan(fence(INCLUSION, SQUARE, 4), 1), 0)
    vehicle.run(0.2)
    vehicle.north = 30.5
    for _ in range(6):
        vehicle.step()
        vehicle.north = 30.5
    assert vehicle.take_texts()[0] == "Geofence: approaching or outside geofence"
    assert vehicle.topics.geofence_result.breached
    assert vehicle.topics.vehicle_status.system_status == 5
    vehicle.run(2.0)
    assert vehicle.north == pytest.approx(30.5, abs=0.1)


def test_a_fence_that_is_broken_already_is_held_at_once_gf_action_says_so() -> None:
    """Navigator::geofence_breach_check; what is broken is told without an action too."""
    vehicle = flying(GF_ACTION=0)
    vehicle.dataman.store(FENCE, Plan(fence(INCLUSION, SQUARE, 4), 1), 0)
    vehicle.reposition(100.0, 0.0, 10.0)
    vehicle.run(10.0)
    assert vehicle.topics.geofence_result.breached
    assert not vehicle.topics.failsafe_flags.geofence_breached
    vehicle.parameters.set("GF_ACTION", 2)
    broken_north = vehicle.north
    vehicle.run(2.0)
    assert vehicle.topics.vehicle_status.failsafe
    assert vehicle.north == pytest.approx(broken_north, abs=1.5)


def test_height_limit() -> None:
    vehicle = flying(GF_ACTION=1, GF_MAX_VER_DIST=15.0)
    vehicle.reposition(0.0, 0.0, 20.0)
    vehicle.run(10.0)
    assert vehicle.take_texts() == ["Geofence: exceeding maximum altitude above Home"]
    assert vehicle.topics.geofence_result.breach_count == 1


def test_region_of_interest_by_command() -> None:
    vehicle = flying()
    vehicle.command(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0, 0, 0, 47.4, 8.5, 500.0)
    vehicle.step()
    assert vehicle.topics.vehicle_roi[:4] == (3, 47.4, 8.5, 500.0)
    vehicle.command(mavlink.MAV_CMD_DO_SET_ROI_NONE)
    vehicle.step()
    assert vehicle.topics.vehicle_roi.mode == 0


@pytest.mark.parametrize(("up_m", "allowed"), [(14.5, True), (15.0, False), (15.5, False)])
def test_at_its_height_limit_a_place_is_outside(up_m: float, allowed: bool) -> None:
    """PX4's Geofence::isBelowMaxAltitude: inside is below."""
    vehicle = flying(GF_ACTION=1, GF_MAX_VER_DIST=15.0)
    vehicle.topics.home_position = home = vehicle.topics.home_position._replace(alt=500.0)
    assert vehicle.navigator._geofence.allows(home.lat, home.lon, 500.0 + up_m) is allowed


@pytest.mark.parametrize(("away_m", "allowed"), [(29.9, True), (30.0, False), (30.1, False)])
def test_at_its_distance_limit_a_place_is_outside(
    monkeypatch: pytest.MonkeyPatch, away_m: float, allowed: bool
) -> None:
    """PX4's Geofence::isCloserThanMaxDistToHome: inside is closer."""
    vehicle = flying(GF_ACTION=1, GF_MAX_HOR_DIST=30.0)
    home = vehicle.topics.home_position
    monkeypatch.setattr("sitl_emu.autopilot.navigator.geofence.distance_m", lambda *_: away_m)
    assert vehicle.navigator._geofence.allows(home.lat, home.lon, home.alt) is allowed


def test_limits_of_zero_are_none() -> None:
    vehicle = flying(GF_ACTION=1, GF_MAX_HOR_DIST=0.0, GF_MAX_VER_DIST=0.0)
    home = vehicle.topics.home_position
    assert vehicle.navigator._geofence.allows(home.lat + 1.0, home.lon, home.alt + 1000.0)


def test_a_limit_below_a_metre_is_one() -> None:
    vehicle = flying(GF_ACTION=1, GF_MAX_HOR_DIST=0.5)
    home = vehicle.topics.home_position
    assert vehicle.navigator._geofence.allows(home.lat, home.lon, home.alt)
    assert not vehicle.navigator._geofence.allows(home.lat + 1e-5, home.lon, home.alt)
