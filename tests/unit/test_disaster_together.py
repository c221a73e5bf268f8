"""Several aircraft share a disaster, on rails and over a bad radio: all is scanned, each pond served once, no two meet.

What each does alone, `tests/missions/test_disaster_run.py` shows; two fly in a whole run in `test_disaster_together.py`
there.
"""

from typing import Any

import pytest
from shapely import Point, Polygon, box

from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.missions.companion.perception import Perception
from sitl_emu.missions.companion.selection import Selected, Wanted
from sitl_emu.missions.companion.swarm.airspace import KEEP_M
from sitl_emu.missions.companion.swarm.extents import tiles_of
from sitl_emu.missions.companion.swarm.records import LINES_OF_A_RECORD, Covered, Doing, Sighting, State
from sitl_emu.missions.disaster import places
from sitl_emu.missions.disaster.detectors import CONFIRMING
from sitl_emu.missions.disaster.settings import Settings
from tests.unit.companion_px4 import RETURN
from tests.unit.disaster_sky import AMSL_M, ORIGIN, Flown, Gripper, Sky

AREA = [(0.0, 0.0), (70.0, 0.0), (70.0, 90.0), (0.0, 90.0)]
BENT, APART, FIRST = box(20, -5, 60, 5).union(box(20, -5, 28, 70)), box(50, 60, 62, 75), box(50, 5, 62, 20)
"""A pond that lies on the lines of all, so that nobody sees it whole, and two of their own, on the lines of the second
and of the first of a pair.
"""
LIMIT_S = 500.0


def served(flown: Flown, *ponds: object) -> list[int]:
    """How many parcels lie at each pond."""
    near = [[pond.distance(Point(north, east)) <= 5.0 for pond in ponds] for _, north, east in flown.parcels]  # type: ignore[attr-defined]
    assert all(sum(one) == 1 for one in near), flown.parcels
    return [sum(column) for column in zip(*near, strict=True)] if near else [0] * len(ponds)


def all_lines(flown: Flown) -> bool:
    return {line for lines in flown.lines.values() for line in lines} == set(range(1, flown.lines_in_all + 1))


@pytest.mark.parametrize(("count", "loss"), [(2, 0.3), (3, 0.1)])
def test_they_scan_all_and_serve_each_pond_once(count: int, loss: float) -> None:
    sky = Sky(count, AREA, [BENT, APART], loss, seed=count)
    assert sky.fly(LIMIT_S)
    flown = sky.flown()
    assert all_lines(flown) and all(flown.lines.values()), flown.lines
    assert served(flown, BENT, APART) == [1, 1] and set(flown.outcomes.values()) == {"success"}
    assert flown.nearest_m >= KEEP_M


def test_the_lines_of_who_dies_are_flown_by_the_other_which_serves_on_its_own_side() -> None:
    sky = Sky(2, AREA, [APART, FIRST], 0.1, seed=5)
    assert sky.fly(60.0, then=lambda it: it.tells(2, "line_scanned"))
    sky.dead.add(2)
    assert sky.fly(LIMIT_S)
    flown = sky.flown()
    assert all_lines(flown) and len(flown.lines[2]) == 1
    assert served(flown, APART, FIRST) == [0, 1] and flown.nearest_m >= KEEP_M
    assert flown.outcomes[1] == "success"


def test_the_lines_of_who_falls_and_talks_on_are_flown_by_the_other() -> None:
    sky = Sky(2, AREA, [APART], 0.1, seed=5)
    assert sky.fly(60.0, then=lambda it: it.tells(2, "line_scanned"))
    fell_s = sky.now_us / 1e6
    sky.quads[2].fallen = True
    assert sky.fly(LIMIT_S)
    failed_s, given_up_s = (time_s for time_s, by, event in sky.events if by == 2 and event.kind == "failed")
    assert failed_s - fell_s < 25.0 and given_up_s - failed_s < 25.0
    flown = sky.flown()
    assert all_lines(flown) and len(flown.lines[2]) == 1 and served(flown, APART) == [1]
    assert flown.outcomes[1] == "success" and flown.outcomes[2].startswith("does not move")


def test_a_pond_is_served_once_though_no_answer_of_the_gripper_arrives() -> None:
    sky = Sky(2, AREA, [APART], 0.0, seed=6)
    for quad in sky.quads.values():
        Gripper(quad, lost=100)
    assert sky.fly(LIMIT_S)
    assert served(sky.flown(), APART) == [1]
    assert sorted(sky.flown().outcomes.values()) == ["gripper: no answer to 10 tries", "success"]


def test_what_no_line_shows_well_enough_is_looked_at_when_all_are_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    """As who flies alone does; without it the parcel was taken home."""
    monkeypatch.setattr(places, "ASLANT", 0.0)
    sky = Sky(2, AREA, [APART], 0.1, seed=3)
    assert sky.fly(LIMIT_S)
    flown = sky.flown()
    assert all_lines(flown) and served(flown, APART) == [1] and flown.nearest_m >= KEEP_M


def test_what_a_dead_one_of_three_was_to_serve_is_served_by_another() -> None:
    sky = Sky(3, AREA, [APART], 0.0, seed=6)
    assert sky.fly(LIMIT_S, then=lambda it: it.tells(0, "phase", phase="engaging"))
    engaged = next(by for _, by, event in sky.events if event.data.get("phase") == "engaging")
    sky.dead.add(engaged)
    assert sky.fly(LIMIT_S)
    flown = sky.flown()
    assert [by for by, *_ in flown.parcels] != [engaged] and served(flown, APART) == [1]
    assert flown.nearest_m >= KEEP_M


@pytest.mark.parametrize(("ponds", "parcels"), [([FIRST, APART], [1, 1]), ([BENT], [0])])
def test_two_whose_radio_dies_serve_on_their_own_sides_alone(ponds: list[Polygon], parcels: list[int]) -> None:
    sky = Sky(2, AREA, ponds, 0.0, seed=7)
    sky.fly(10.0)
    sky.mute |= {1, 2}
    assert sky.fly(LIMIT_S)
    flown = sky.flown()
    assert all_lines(flown) and served(flown, *ponds) == parcels
    told = set(flown.outcomes.values())
    assert told == {"success"} if all(parcels) else all(one.startswith("aborted: out of touch") for one in told), told


def test_who_is_brought_home_by_a_failsafe_is_kept_clear_of_and_its_lines_are_flown() -> None:
    sky = Sky(3, AREA, [APART], 0.1, seed=9)
    sky.fly(40.0)
    assert sky.tells(3, "phase", phase="scanning") and not sky.tells(3, "released")
    sky.quads[3].enter_failsafe(sky.now_us, RETURN, 3)
    assert sky.fly(LIMIT_S)
    flown = sky.flown()
    assert all_lines(flown) and served(flown, APART) == [1] and flown.nearest_m >= KEEP_M
    assert flown.lines[3] == [] and flown.outcomes[1] == flown.outcomes[2] == "success"


def test_who_is_ready_first_waits_on_the_ground_for_those_who_are_switched_on_later() -> None:
    sky = Sky(3, AREA, [], 0.1, seed=4)
    sky.quads[2].ready_us = sky.quads[3].ready_us = 40_000_000
    assert not sky.fly(39.0, then=lambda it: it.quads[1].armed)
    assert sky.tells(1, "phase", phase="waiting for peers") and not sky.companions[1].status.done
    assert sky.fly(LIMIT_S, then=lambda it: all(it.tells(system, "line_scanned") for system in it.systems))
    assert not sky.tells(0, "scan_aborted") and not sky.tells(0, "delivery_aborted")


def test_who_is_never_heard_is_waited_for_no_longer_than_was_said() -> None:
    sky = Sky(3, AREA, [], 0.1, seed=4, gather_timeout_s=20.0)
    sky.dead.add(3)
    assert sky.fly(LIMIT_S, then=lambda it: it.quads[1].armed and it.quads[2].armed)
    assert 20.0 < sky.now_us / 1e6 < 35.0
    said = [(by, event.text) for _, by, event in sky.events if "Goes on" in event.text]
    assert said == [(system, "Goes on without system 3, not heard yet") for system in (1, 2)]


def test_who_hears_too_few_stays_on_the_ground() -> None:
    sky = Sky(3, AREA, [], 0.0, seed=4, gather_timeout_s=15.0)
    sky.dead |= {2, 3}
    assert not sky.fly(30.0, then=lambda it: it.quads[1].armed)
    sky = Sky(3, AREA, [], 0.0, seed=4)
    assert sky.fly(30.0, then=lambda it: it.tells(1, "phase", phase="taking off"))
    sky.dead |= {2, 3}
    assert not sky.fly(30.0, then=lambda it: it.quads[1].armed) and not sky.companions[1].status.done


def test_a_companion_that_is_started_again_tells_of_other_sightings_than_before() -> None:
    """Else what it sees now would be of what the others know already, as far as that reached and this does."""
    sky = Sky(2, AREA, [APART], 0.0, seed=5)
    flight = sky.companions[1].flight

    def places() -> list[Point]:
        assert flight.together is not None
        sharing = flight.together.swarm.sharing
        told = [sharing.sighting(key) for one in sharing.targets() for key in one.keys if key[0] == 2]
        return [Point(*to_metres(one.lat_deg, one.lon_deg, *ORIGIN)) for one in told if one.confidence > 0.0]

    assert sky.fly(LIMIT_S, then=lambda it: it.tells(0, "phase", phase="scanning") and bool(places()))
    assert APART.distance(places()[0]) < 8.0
    other = sky.ponds = box(5, 60, 17, 75)
    sky.quads[2].land()
    sky.restart(2)
    assert sky.fly(150.0, then=lambda it: any(other.distance(place) < 8.0 for place in places()))
    assert any(APART.distance(place) < 8.0 for place in places())


def test_a_companion_that_is_started_in_the_air_begins_nothing_and_leaves_the_vehicle_alone() -> None:
    sky = Sky(1, AREA, [], 0.0, seed=5)
    assert sky.fly(LIMIT_S, then=lambda it: it.tells(1, "phase", phase="scanning"))
    sky.restart(1)
    asked = len(sky.quads[1].commands)
    sky.fly(sky.now_us / 1e6 + 5.0)
    assert sky.companions[1].status.outcome.startswith("the vehicle is armed, and may have let its parcel go; land")
    assert sky.quads[1].armed and len(sky.quads[1].commands) == asked


def test_who_is_not_among_the_members_is_told_so_and_flies_nowhere() -> None:
    sky = Sky(2, AREA, [], 0.0, seed=5)
    flight = sky.companions[1].flight
    assert flight.settings.team is not None
    flight.settings = flight.settings._replace(team=flight.settings.team._replace(members=(2, 3)))
    sky.dead.add(2)
    assert sky.fly(10.0) and not sky.quads[1].armed
    assert (
        sky.companions[1].status.outcome == "option members: 2 3: without system 1, the vehicle's; name all MAV_SYS_ID"
    )


@pytest.mark.parametrize("count", [1, 2])
def test_lines_that_can_not_be_laid_end_the_mission_on_the_ground(count: int) -> None:
    sky = Sky(count, AREA, [], 0.0, seed=5)
    flight = sky.companions[1].flight
    flight.settings = flight.settings._replace(margin_m=60.0)
    sky.dead |= set(sky.systems) - {1}
    assert sky.fly(10.0) and not sky.quads[1].armed
    assert sky.companions[1].status.outcome.startswith("margin 60 m; must be 0 or more")


class KnowsTwo:
    """A detector of two classes that is never asked."""

    labels = ("fire_region", "water_body")

    def detect(self, image: Any, gsd_m: float | None = None) -> Any:
        raise AssertionError("no pictures here")


@pytest.mark.parametrize(("label", "found", "unknown"), [(0, ["fire_region"], 0), (1, ["water_body"], 0), (2, [], 1)])
def test_who_looks_for_fewer_classes_takes_others_at_their_word(label: int, found: list[str], unknown: int) -> None:
    """Each aircraft's card may have a selection of its own; what its detector does not know it leaves to others."""
    sky = Sky(2, AREA, [], 0.0, seed=5)
    sky.dead.add(2)
    flight = sky.companions[1].flight
    eyes = Perception(Selected(KnowsTwo(), {"water_body": Wanted()}), CONFIRMING)
    flight.settings = flight.settings._replace(perception=eyes)
    assert sky.fly(30.0, then=lambda it: it.tells(1, "phase", phase="uploading"))
    assert flight.together is not None
    key, place = (2, 0), (*ORIGIN, AMSL_M)
    told = Sighting(key, 0, label, 0.9, *place, 1.0, 1.0, 0.0)
    out, all_flown = State(Doing.OUT, *place, 0.0, 0.0, 0.0), Covered(0, (1 << LINES_OF_A_RECORD) - 1)
    flight.together.swarm.sharing.hear(sky.now_us, 2, 1, [out, all_flown, told, *tiles_of(key, [(0, 0)])])
    flight.together._look()
    assert [each.label for each in flight.together._places.values()] == found
    assert flight.together.counts.get("sightings of unknown labels", 0) == unknown


def test_alone_nothing_is_said_to_peers() -> None:
    sky = Sky(1, AREA, [APART], 0.0, seed=8)
    settings: Settings = sky.companions[1].settings
    assert sky.fly(LIMIT_S) and settings.team is None and sky.companions[1].flight.together is None
    assert served(sky.flown(), APART) == [1] and not sky.said


def test_all_that_is_said_to_peers_is_sealed() -> None:
    sky = Sky(2, AREA, [], 0.0, seed=8)
    assert sky.fly(LIMIT_S, then=lambda it: it.tells(2, "phase", phase="scanning"))
    assert sky.said == {"TUNNEL"}
