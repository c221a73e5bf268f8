"""The flight as the paper prints it: to the middle of a box that three frames in a row show, and centred over it."""

import pytest
from shapely import Point, box

from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.disaster import aborts, tries
from sitl_emu.missions.disaster.as_printed import Runs
from sitl_emu.missions.disaster.settings import settings_of
from tests.unit.disaster_sky import ORIGIN, Sky

AREA_M = [(0.0, 0.0), (0.0, 60.0), (40.0, 60.0), (40.0, 0.0)]
POND = box(16.0, 27.0, 22.0, 33.0)
LAKE = box(14.0, 24.0, 26.0, 36.0)
"""From 15 m a picture is 14 m high."""
THREE = Confirming(3, confirm_score=0.5)


def at(east_m: float, score: float = 0.8, label: str = "water_body") -> Detection:
    """A box that lies so far east."""
    return Detection(label, score, east_m, 0.0, 1.0, 1.0)


def there(one: Detection) -> Corner | None:
    return (0.0, one.x) if one.x < 100.0 else None


def calls(*frames: list[Detection]) -> list[list[float]]:
    """Where each of some frames calls it to."""
    runs = Runs(THREE)
    return [[place_m[1] for _, place_m in runs.update(boxes, there)] for boxes in frames]


def test_three_frames_in_a_row_call_it_to_where_the_last_places_the_box() -> None:
    assert calls([at(0.0)], [at(1.0)], [at(2.0)], [at(3.0)]) == [[], [], [2.0], [3.0]]


@pytest.mark.parametrize(
    "second",
    [[], [at(1.0, label="fire_region")], [at(7.0)], [at(200.0)]],
    ids=["nothing", "another class", "another place", "nowhere on the ground"],
)
def test_a_frame_that_shows_it_not_breaks_the_row(second: list[Detection]) -> None:
    assert calls([at(0.0)], second, [at(0.0)], [at(0.0)])[2:] == [[], []]


def test_the_mean_score_counts() -> None:
    assert calls([at(0.0, 0.4)], [at(0.0, 0.4)], [at(0.0, 0.6)], [at(0.0, 0.7)]) == [[], [], [], [0.0]]


def test_of_two_boxes_each_has_its_own_row() -> None:
    assert calls([at(0.0), at(4.0)], [at(0.0), at(4.0)], [at(0.5), at(4.5)]) == [[], [], [0.5, 4.5]]


def test_called_by_a_part_it_centres_over_the_middle_of_what_it_sees_from_above() -> None:
    sky = Sky(1, AREA_M, [LAKE], 0.0, 1, engage="detections")
    assert sky.fly(300.0)
    ((_, north_m, east_m),) = sky.parcels
    assert LAKE.centroid.distance(Point(north_m, east_m)) < 1.0
    told = next(event for _, _, event in sky.events if event.kind == "target_confirmed")
    called_m = to_metres(told.data["lat_deg"], told.data["lon_deg"], *ORIGIN)
    assert LAKE.centroid.distance(Point(called_m)) > 2.0
    assert told.data["located"] == "middle" and told.data["lat_deg"] == told.data["place_lat_deg"]
    flown = sky.flown()
    assert flown.outcomes == {1: "success"} and len(flown.lines[1]) == flown.lines_in_all


def test_what_does_not_show_from_above_gets_nothing_and_the_scan_goes_on() -> None:
    sky = Sky(1, AREA_M, [POND], 0.0, 1, engage="detections")
    assert sky.fly(300.0, then=lambda sky: sky.tells(1, "target_confirmed"))
    sky.score = 0.2
    assert sky.fly(300.0)
    flown = sky.flown()
    assert not flown.parcels and flown.aborts == [(1, "detection did not persist")]
    assert len(flown.lines[1]) == flown.lines_in_all and flown.outcomes[1].startswith("aborted: detection did not")


def test_what_is_of_another_class_from_above_is_not_what_called_it() -> None:
    sky = Sky(1, AREA_M, [POND], 0.0, 1, engage="detections")
    assert sky.fly(300.0, then=lambda sky: sky.tells(1, "target_confirmed"))
    sky.label = "debris_field"
    assert sky.fly(300.0)
    assert sky.flown().aborts == [(1, "detection did not persist")]


def test_what_no_row_shows_well_enough_is_passed_by() -> None:
    sky = Sky(1, AREA_M, [POND], 0.0, 1, engage="detections")
    sky.score = 0.2
    assert sky.fly(300.0)
    assert not sky.parcels and not sky.tells(1, "target_confirmed")
    assert sky.tells(1, "region"), "it was seen"


def test_where_its_location_is_too_uncertain_the_parcel_stays_on_board(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aborts, "MOST_SIGMA_M", 0.05)
    sky = Sky(1, AREA_M, [POND], 0.0, 1, engage="detections")
    assert sky.fly(600.0)
    flown = sky.flown()
    assert not flown.parcels and flown.aborts == [(1, "uncertain location")] * tries.TRIES


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"engage": "boxes"}, "option engage: 'boxes'; allowed: places, detections"),
        ({"engage": "detections", "members": "1 2", "datum_amsl_m": 500.0}, "several aircraft share regions"),
    ],
)
def test_it_is_for_one_alone(options: dict[str, str | float], told: str) -> None:
    area = {"corners": [[47.0, 8.0], [47.0, 8.001], [47.001, 8.0]]}
    with pytest.raises(ValueError, match=told):
        settings_of(Options({"area": area, "swarm_seed": 1, **options}))
