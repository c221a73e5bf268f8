"""Aircraft nearby: which are a conflict, what is told, what is done (PX4's AdsbConflict and check_traffic)."""

import math
import struct
from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import layout
from sitl_emu.autopilot.topics import TransponderReport

from .navigation_fake import HOME_ALT, PLACE, FakeVehicle

ALL_VALID = 0x0F
EAST, SOUTH = math.pi / 2.0, math.pi


def flying(**parameters: float) -> FakeVehicle:
    vehicle = FakeVehicle(**parameters)
    vehicle.run(3.0)
    vehicle.take_off(50.0)
    vehicle.take_texts()
    return vehicle


def see(
    vehicle: FakeVehicle,
    north_m: float,
    east_m: float = 0.0,
    up_m: float = 50.0,
    heading: float = SOUTH,
    speed: float = 50.0,
    address: int = 1,
    flags: int = ALL_VALID,
) -> list[tuple[str, tuple[int, ...]]]:
    """Report an aircraft; the events about traffic that follow."""
    names = ["navigator_traffic", "navigator_traffic_rtl", "navigator_traffic_land", "navigator_traffic_hold"]
    names += ["navigator_traffic_resolved", "navigator_traffic_expired", "buffer_full"]
    by_id = {layout(name)[0]: name for name in names}
    before = vehicle.events.count
    reports = vehicle.topics.transponder_reports
    lat, lon = PLACE.reproject(north_m, east_m)
    number = reports[-1].number + 1 if reports else 1
    report = TransponderReport(
        vehicle.now_us, number, address, lat, lon, 1, HOME_ALT + up_m, heading, speed, 0.0, b"HBABC", 3, 1, flags, 7000
    )
    vehicle.topics.transponder_reports = (*reports[-19:], report)
    vehicle.run(0.08)
    found = []
    for event in vehicle.events.recent:
        if event.number >= before and event.id in by_id:
            name = by_id[event.id]
            found.append((name, struct.unpack("<" + layout(name)[1], event.arguments)))
    return found


def test_an_aircraft_on_the_way_is_told_once_and_again_after_a_minute() -> None:
    vehicle = flying()
    assert see(vehicle, 1000.0, 30.0) == [("navigator_traffic", (1, 30, 180))]
    assert see(vehicle, 900.0) == []
    assert vehicle.mode is NavState.AUTO_LOITER
    vehicle.run(60.0)
    assert see(vehicle, 900.0) == [("navigator_traffic", (1, 0, 180))]


@pytest.mark.parametrize(
    "report",
    [
        {"north_m": 4000.0},  # 80 s away: beyond NAV_TRAFF_COLL_T
        {"north_m": 1000.0, "up_m": 551.0},  # more than NAV_TRAFF_A_VER above
        {"north_m": 1000.0, "heading": EAST},  # passes 1000 m ahead
        {"north_m": 1000.0, "flags": 0x0E},  # without a place
        {"north_m": 1000.0, "speed": 0.0},
    ],
)
def test_aircraft_that_are_no_conflict(report: dict[str, Any]) -> None:
    vehicle = flying()
    assert see(vehicle, **report) == []


@pytest.mark.parametrize(("above_m", "conflicts"), [(90.0, 1), (110.0, 0)])
def test_heights_have_a_separation_of_their_own(above_m: float, conflicts: int) -> None:
    vehicle = flying(NAV_TRAFF_A_VER=100.0)
    assert len(see(vehicle, 1000.0, up_m=50.0 + above_m)) == conflicts


def test_a_conflict_is_resolved_or_forgotten() -> None:
    vehicle = flying()
    see(vehicle, 1000.0)
    assert see(vehicle, 5000.0) == [("navigator_traffic_resolved", (1,))]
    assert see(vehicle, 1000.0) == [("navigator_traffic", (1, 0, 180))]
    vehicle.run(119.0)
    before = vehicle.events.count
    vehicle.run(1.2)
    names = [event.id for event in vehicle.events.recent if event.number >= before]
    assert names == [layout("navigator_traffic_expired")[0]]


@pytest.mark.parametrize(
    ("avoid", "events", "mode"),
    [
        (0, [], NavState.AUTO_LOITER),
        (1, ["navigator_traffic"], NavState.AUTO_LOITER),
        (2, ["navigator_traffic_rtl"], NavState.AUTO_RTL),
        (3, ["navigator_traffic_land"], NavState.AUTO_LAND),
        (4, ["navigator_traffic_hold"], NavState.AUTO_LOITER),
    ],
)
def test_what_nav_traff_avoid_asks_for(avoid: int, events: list[str], mode: NavState) -> None:
    vehicle = flying(NAV_TRAFF_AVOID=avoid)
    assert [name for name, _ in see(vehicle, 1000.0)] == events
    vehicle.run(0.2)
    assert vehicle.mode is mode


@pytest.mark.parametrize(("avoid", "phases"), [(2, [0, 1]), (1, [1])])
def test_after_traffic_a_return_goes_to_its_height_first(avoid: int, phases: list[int]) -> None:
    """RTL::set_return_alt_min; it flies higher than RTL_RETURN_ALT here."""
    vehicle = flying(NAV_TRAFF_AVOID=avoid)
    vehicle.reposition(100.0, 0.0, 50.0)
    vehicle.run(21.0)
    see(vehicle, 1000.0)
    vehicle.run(0.2)
    vehicle.set_mode(4, 3)
    vehicle.run(1.0)
    told: list[int] = []
    assert vehicle.set_mode(4, 5) == 0
    for _ in range(30):
        vehicle.step()
        phase = vehicle.topics.navigator_mission_item.sequence_current
        if vehicle.mode is NavState.AUTO_RTL and told[-1:] != [phase]:
            told.append(phase)
    assert told == phases


def test_more_than_ten_conflicts_are_too_many() -> None:
    vehicle = flying()
    vehicle.run(60.0)
    for address in range(1, 11):
        assert see(vehicle, 1000.0, address=address) == [("navigator_traffic", (address, 0, 180))]
    assert see(vehicle, 1000.0, address=11) == [("buffer_full", ())]
    assert see(vehicle, 1000.0, address=12) == []


def test_an_aircraft_that_is_nowhere_troubles_nobody() -> None:
    """Poles, antipodes and heights that no aircraft has."""
    vehicle = flying()
    for north_m, east_m, up_m in ((1e7, 0.0, 1e6), (2.0015e7, 0.0, -1e6), (0.0, 2e7, 50.0), (0.0, 0.0, 50.0)):
        for heading in (SOUTH, EAST, 0.3):
            see(vehicle, north_m, east_m, up_m, heading, 600.0)
    assert vehicle.mode is NavState.AUTO_LOITER
