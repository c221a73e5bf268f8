"""Aside from the line to a place for the parcel: one that lasts, that a front has reached, or none at all."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from shapely import Point, box

from sitl_emu.gcs.telemetry import Wind
from sitl_emu.missions.companion.onboard import Script
from sitl_emu.missions.disaster import places, tries
from sitl_emu.missions.disaster.aborts import Aborted, Reason
from sitl_emu.missions.disaster.flight import Flight
from tests.unit.disaster_sky import Gripper, Sky

AREA_M = [(0.0, 0.0), (0.0, 60.0), (40.0, 60.0), (40.0, 0.0)]
FIRE = box(24.0, 15.0, 40.0, 45.0)
REACHED_M = 3.5
"""The fire of `disaster-wildfire`, seed 4, comes by 2.5 m while the vehicle goes down; here it does at once."""


def test_who_is_low_over_a_place_that_the_front_has_reached_goes_on_to_another() -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)

    def burns(sky: Sky) -> bool:
        if sky.tells(1, "phase", phase="delivering"):
            sky.ponds = FIRE.buffer(REACHED_M)
        return bool(sky.parcels)

    assert sky.fly(300.0, then=burns)
    assert sky.tells(1, "place_changed")
    ((_, north_m, east_m),) = sky.parcels
    assert 0.5 < sky.ponds.distance(Point(north_m, east_m)) < 5.0
    assert [event.kind for _, _, event in sky.events].count("target_confirmed") == 1


@pytest.mark.parametrize("speed_m_s", [2.0, 5.0])
def test_it_flies_as_fast_as_the_scenario_says(speed_m_s: float) -> None:
    sky = Sky(1, AREA_M, [], 0.0, 1)
    flight, fastest = sky.companions[1].flight, [0.0]
    flight.settings = flight.settings._replace(scan_speed_m_s=speed_m_s)

    def is_seen(sky: Sky) -> bool:
        fastest[0] = max(fastest[0], math.hypot(*sky.quads[1].velocity[:2]))
        return sky.tells(1, "line_scanned")

    assert sky.fly(300.0, then=is_seen)
    assert fastest[0] == pytest.approx(speed_m_s, rel=0.02)


@pytest.mark.parametrize(("pitch_deg", "looks"), [(-40.0, True), (-50.0, False), (130.0, False)])
def test_who_leans_farther_than_any_autopilot_does_looks_at_nothing(pitch_deg: float, looks: bool) -> None:
    """Who falls: what it takes for the ground is elsewhere."""
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    assert sky.fly(300.0, then=lambda sky: sky.tells(1, "line_scanned"))
    sky.quads[1].pitch = math.radians(pitch_deg)
    since_us = sky.now_us
    sky.fly(300.0, then=lambda sky: sky.now_us > since_us + 1_000_000)
    assert (sky.companions[1].wants_frame(sky.now_us // 1000 * 1000) is not None) is looks


def test_a_place_has_to_be_one_for_a_moment() -> None:
    lasting, place = places.Lasting(), places.Place("fire_region", 0.9, (10.0, 5.0), (12.0, 5.0), 0.1, 40.0)
    beside, far = place._replace(place_m=(12.0, 5.0)), place._replace(place_m=(30.0, 5.0))
    assert not lasting.lasts(0, place) and not lasting.lasts(1_000_000, beside)
    assert not lasting.lasts(1_100_000, far), "that is another"
    assert lasting.lasts(1_500_000, place)
    assert not lasting.lasts(4_000_000, place), "it was none in between"


def test_a_place_that_stays_one_is_kept() -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    assert sky.fly(300.0, then=lambda sky: bool(sky.parcels))
    assert not sky.tells(1, "place_changed")


def test_a_parcel_is_delivered_though_the_answer_is_lost_that_says_so() -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    Gripper(sky.quads[1], lost=1)
    assert sky.fly(300.0)
    assert len(sky.parcels) == 1 and sky.flown().outcomes == {1: "success"}


@pytest.mark.parametrize("ack", [4, None])
def test_a_parcel_counts_as_gone_unless_the_gripper_says_that_it_does_not_open(ack: int | None) -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    if ack is None:
        Gripper(sky.quads[1], lost=100)
    else:
        sky.quads[1].ack = lambda command: ack if command == 211 else 0
    assert sky.fly(300.0)
    assert sky.companions[1].flight.delivered is (ack is None)
    assert sky.flown().outcomes[1] == ("gripper: no answer to 10 tries" if ack is None else "gripper: failed")


def test_who_can_not_see_any_more_goes_home() -> None:
    sky = Sky(1, AREA_M, [], 0.0, 1)
    assert sky.fly(300.0, then=lambda sky: sky.tells(1, "line_scanned"))
    sky.companions[1].fail("detector: no such layer")
    assert sky.fly(300.0)
    assert sky.flown().outcomes == {1: "detector: no such layer"}
    assert not sky.quads[1].armed and len(sky.flown().lines[1]) == 1


def test_where_nothing_has_a_place_the_parcel_stays_on_board_for_that_reason() -> None:
    sky = Sky(1, AREA_M, [box(-40.0, -40.0, 80.0, 100.0)], 0.0, 1)
    assert sky.fly(300.0)
    flown = sky.flown()
    assert not flown.parcels and flown.aborts == [(1, "no safe place")]
    assert flown.outcomes[1].startswith("aborted: no safe place") and len(flown.lines[1]) == flown.lines_in_all


def test_what_may_be_a_place_is_looked_at_from_above_before_the_parcel_is_taken_home(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # a ditch between two lines, with no ground at its edge that is so near to below one of them
    monkeypatch.setattr(places, "ASLANT", 0.05)
    sky = Sky(1, AREA_M, [box(13.4, 20.0, 14.4, 40.0)], 0.0, 1)
    sky.companions[1].flight.seen = lambda label: {"frame_time_us": 1}
    assert sky.fly(400.0)
    flown = sky.flown()
    told = [event.kind for _, _, event in sky.events if event.kind in ("line_scanned", "target_confirmed")]
    assert told == ["line_scanned"] * flown.lines_in_all + ["target_confirmed"]
    assert len(flown.parcels) == 1 and flown.outcomes == {1: "success"}
    (confirmed,) = (event for _, _, event in sky.events if event.kind == "target_confirmed")
    assert "frame_time_us" not in confirmed.data, "no picture of another place"


def test_who_has_left_its_lines_in_vain_three_times_flies_them_first(monkeypatch: pytest.MonkeyPatch) -> None:
    ponds = [box(north_m, 8.0, north_m + 4.0, 12.0) for north_m in (4.0, 18.0, 32.0)]
    ponds += [box(north_m, 34.0, north_m + 4.0, 38.0) for north_m in (4.0, 18.0, 32.0)]
    sky = Sky(1, AREA_M, ponds, 0.0, 1)
    flight = sky.companions[1].flight

    def none(place: places.Place) -> Script:
        yield from ()
        raise Aborted(Reason.NO_PLACE, "none")

    monkeypatch.setattr(flight, "_deliver", none)
    assert sky.fly(600.0)
    told = [event.kind for _, _, event in sky.events if event.kind in ("line_scanned", "target_confirmed")]
    assert told.count("line_scanned") == sky.flown().lines_in_all
    last = len(told) - told[::-1].index("line_scanned")
    assert told[:last].count("target_confirmed") == tries.LEAVES
    assert told[last:].count("target_confirmed") > 0, "then what is left is tried"


def test_in_a_wind_that_ended_a_delivery_none_is_begun_until_it_has_dropped() -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    telemetry = sky.companions[1].flight.onboard.telemetry
    telemetry.wind = Wind(13.0, 0.0)
    lines, begun = list[int](), list[int]()

    def blows(sky: Sky) -> bool:
        kinds = [event.kind for _, _, event in sky.events]
        if not lines and sky.flown().aborts:
            telemetry.wind = Wind(11.5, 0.0)
            lines.append(kinds.count("line_scanned"))
        if lines and not begun and kinds.count("line_scanned") > lines[0]:
            telemetry.wind = Wind(10.0, 0.0)
            begun.append(kinds.count("target_confirmed"))
        return bool(sky.parcels)

    assert sky.fly(400.0, then=blows)
    assert begun == [1] and sky.flown().aborts == [(1, "wind")] and len(sky.parcels) == 1


def test_where_nothing_is_found_that_is_a_success() -> None:
    sky = Sky(1, AREA_M, [box(500.0, 500.0, 510.0, 510.0)], 0.0, 1)
    assert sky.fly(300.0)
    assert not sky.flown().aborts and sky.flown().outcomes == {1: "success"}


@pytest.mark.parametrize("name", ["MIS_TAKEOFF_ALT", "RTL_RETURN_ALT"])
def test_it_does_not_take_off_where_a_height_is_not_taken(name: str) -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    sky.quads[1].kept = {name}
    assert sky.fly(60.0)
    assert sky.flown().outcomes == {1: f"parameter {name}: the autopilot does not take 15"}
    assert 400 not in [command for command, _ in sky.quads[1].commands], "it was not armed"


def test_pictures_of_another_size_than_the_cameras_are_refused_and_end_the_mission() -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)
    assert sky.fly(60.0, then=lambda sky: sky.tells(1, "phase", phase="scanning"))
    companion = sky.companions[1]
    assert companion.detect(np.zeros((480, 640, 3), np.uint8), 0.06) == []
    assert sky.fly(200.0)
    (outcome,) = sky.flown().outcomes.values()
    assert all(words in outcome for words in ("640 x 480", "320 x 240", "`calibration`"))
    assert not sky.parcels and sky.quads[1].up_m == 0.0


def test_a_place_that_is_another_each_time_it_is_looked_at_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    sky = Sky(1, AREA_M, [FIRE], 0.0, 1)

    def moves_on(place: places.Place) -> places.Place:
        return place._replace(place_m=(place.place_m[0] - 2.0, place.place_m[1]))

    monkeypatch.setattr(sky.companions[1].flight, "_again", moves_on)
    assert sky.fly(400.0)
    flown = sky.flown()
    assert not flown.parcels and set(flown.aborts) == {(1, "no safe place")}
    assert not sky.tells(1, "phase", phase="delivering") and len(flown.lines[1]) == flown.lines_in_all


def test_of_several_regions_about_a_place_the_nearest_to_its_edge_is_the_one_it_is_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    flight = Sky(1, AREA_M, [], 0.0, 1).companions[1].flight
    north_m, east_m = np.mgrid[0:10, 0:10].astype(np.float64)
    place, chosen = places.Place("water_body", 0.9, (5.0, 3.0), (5.0, 5.0), 0.1, 40.0), list[object]()
    far, near = (SimpleNamespace(label="water_body", cells=east_m == east) for east in (8.0, 6.0))

    def choose(region: object, *_: object) -> places.Place:
        chosen.append(region)
        return place

    regions = SimpleNamespace(regions=lambda: [far, near], north_m=north_m, east_m=east_m)
    monkeypatch.setattr(flight, "regions", regions)
    monkeypatch.setattr(flight, "choose", choose)
    monkeypatch.setattr(Flight, "over_ground_m", 15.0)
    assert flight._again(place) == place and all(one is near for one in chosen)
