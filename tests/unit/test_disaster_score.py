"""The disaster mission's score: what truth it is held against, and what counts as delivered, found, and false."""

import math
from typing import Any

import pytest

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.disaster.evaluation import rows
from sitl_emu.missions.disaster.heights import scan_height
from sitl_emu.missions.disaster.outlines import as_text, rings_of
from sitl_emu.missions.disaster.page import page
from sitl_emu.missions.disaster.score import score
from sitl_emu.missions.disaster.truth import targets
from sitl_emu.missions.scoring import RunRecord, Track, TrueArea, TrueObject

HOME = (47.0, 8.0)
POND = TrueArea("water", "pond", "water", ((10.0, 10.0), (20.0, 10.0), (20.0, 20.0), (10.0, 20.0)))
AREA = [(0.0, 0.0), (0.0, 40.0), (40.0, 40.0), (40.0, 0.0)]


def deg(place_m: tuple[float, float]) -> tuple[float, float]:
    return from_metres(*place_m, *HOME)


def text(*rings: list[tuple[float, float]]) -> str:
    return as_text([[deg(corner) for corner in ring] for ring in rings])


def plan() -> dict[str, Any]:
    return {"event": "plan", "time_s": 5.0, "vehicle": "uas", "area": text(AREA), "lines": text([(0, 5), (40, 5)])}


def confirmed(
    edge_m: tuple[float, float] = (10.0, 15.0), label: str = "water_body", located: str = "edge"
) -> dict[str, Any]:
    lat, lon = deg(edge_m)
    return {"event": "target_confirmed", "time_s": 20.0, "vehicle": "uas", "label": label, "located": located,
            "lat_deg": lat, "lon_deg": lon, "sigma_m": 1.0}  # fmt: skip


def released(place_m: tuple[float, float]) -> dict[str, Any]:
    lat, lon = deg(place_m)
    return {"event": "released", "time_s": 30.0, "vehicle": "uas", "place_lat_deg": lat, "place_lon_deg": lon}


def rests(north_m: float, east_m: float) -> dict[str, Any]:
    return {"event": "parcel at rest", "time_s": 33.0, "vehicle": "uas", "name": "parcel of uas", "north_m": north_m,
            "east_m": east_m, "down_m": 0.0}  # fmt: skip


def region(*corners: tuple[float, float], label: str = "water_body") -> dict[str, Any]:
    return {"event": "region", "time_s": 60.0, "vehicle": "uas", "label": label, "outlines": text(list(corners))}


SCANNED = {"event": "line_scanned", "time_s": 50.0, "vehicle": "uas", "line": 1}
LANDED = {"event": "phase", "time_s": 80.0, "vehicle": "uas", "phase": "landed"}
MAPPED = region((10.5, 10.5), (10.5, 19.5), (19.5, 19.5), (19.5, 10.5))


def scored(
    *events: dict[str, Any], objects: tuple[TrueObject, ...] = (), areas: tuple[TrueArea, ...] = (POND,)
) -> dict[str, Any]:
    record = RunRecord(
        [plan(), SCANNED, *events, LANDED], objects, {}, lambda lat, lon: to_metres(lat, lon, *HOME), areas
    )
    made = score(record)
    return made.figures | {"shortfalls": made.shortfalls, "lines_told": made.lines}


def test_a_parcel_at_the_edge_is_delivered() -> None:
    got = scored(confirmed(), released((7.0, 15.0)), rests(7.5, 15.0), MAPPED)
    assert got["ending"] == "delivered" and got["shortfalls"] == []
    (parcel,) = got["deliveries"]
    assert (parcel["to_target_m"], parcel["to_place_m"]) == (2.5, pytest.approx(0.5, abs=0.01))
    assert (got["targets_found"], got["targets_total"], got["regions_false"]) == (1, 1, 0)
    assert got["targets"][0]["iou"] == pytest.approx(1.0, abs=0.02)
    assert got["geolocation_rmse_m"] == pytest.approx(0.0, abs=0.01)
    assert page(got).sections and all(row.good for row in rows([got]))


def sighting(place_m: tuple[float, float], label: str = "water_body") -> dict[str, Any]:
    lat, lon = deg(place_m)
    return {"event": "sighting", "time_s": 18.0, "vehicle": "uas", "label": label, "lat_deg": lat, "lon_deg": lon}


def test_the_first_sighting_of_a_target_is_held_against_its_middle() -> None:
    got = scored(sighting((18.0, 19.0)), sighting((15.0, 15.0)), sighting((18.0, 19.0), "fire_region"), MAPPED)
    (one,) = got["sightings"]
    assert one["error_m"] == pytest.approx(5.0, abs=0.01) == got["sighting_rmse_m"]
    (mark,) = page(got).marks
    assert (mark.north_m, mark.east_m) == pytest.approx((18.0, 19.0), abs=0.01)
    assert scored(MAPPED)["sightings"] == [] and scored(MAPPED)["sighting_rmse_m"] is None


def test_what_frames_alone_would_have_called_it_to_is_held_against_the_truth_of_that_time() -> None:
    def alarms(frames: int, times_s: str, *places_m: tuple[float, float], label: str = "water_body") -> dict[str, Any]:
        return {"event": "alarms", "time_s": 80.0, "vehicle": "uas", "frames": frames, "label": label,
                "times_s": times_s, "places": text(list(places_m))}  # fmt: skip

    once = alarms(1, "10.0 11.0 12.0", (15.0, 15.0), (24.5, 15.0), (26.0, 15.0))
    got = scored(MAPPED, once, alarms(1, "9.0", (15.0, 15.0), label="fire_region"), alarms(3, "12.0", (15.0, 15.0)))
    assert got["alarms"] == {"1": {"total": 4, "false": 2}, "3": {"total": 1, "false": 0}}
    assert scored(MAPPED)["alarms"] == {}
    square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    fire = TrueArea("fire", "fire", "fire", square, front_m_s=(0.0, 1.0))
    early, late = (alarms(1, time_s, (5.0, 30.0), label="fire_region") for time_s in ("1.0", "20.0"))
    assert [scored(one, areas=(fire,))["alarms"]["1"]["false"] for one in (early, late)] == [1, 0]


def test_nobody_sees_water_under_a_house() -> None:
    house = TrueArea("solid", "house", "house", ((10.0, 10.0), (15.0, 10.0), (15.0, 20.0), (10.0, 20.0)))
    beside = region((15.5, 10.5), (15.5, 19.5), (19.5, 19.5), (19.5, 10.5))
    (target,) = scored(beside, areas=(POND, house))["targets"]
    assert target["iou"] == pytest.approx(1.0, abs=0.02) and target["area_m2"] == 50.0
    assert scored(beside)["targets"][0]["iou"] == pytest.approx(0.5, abs=0.02)


def test_where_the_camera_saw_the_parcel_is_held_against_where_it_lies() -> None:
    lat, lon = deg((7.5, 16.2))
    seen = {"event": "parcel_seen", "time_s": 34.0, "vehicle": "uas", "lat_deg": lat, "lon_deg": lon}
    unseen = {"event": "parcel_unseen", "time_s": 34.0, "vehicle": "uas"}
    for told, wanted in ((seen, pytest.approx(1.2, abs=0.01)), (unseen, None), (seen | {"vehicle": "uas2"}, None)):
        got = scored(confirmed(), released((7.0, 15.0)), rests(7.5, 15.0), told, MAPPED)
        assert got["deliveries"][0]["to_seen_m"] == wanted and page(got).sections


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ((15.0, 15.0), "in the area"),
        ((4.0, 15.0), ""),
        ((7.0, 15.4), "on a person"),
        ((7.5, 15.0), "0.4 m from a person"),
    ],
)
def test_a_parcel_too_far_off_in_the_water_or_on_somebody_is_not(where: tuple[float, float], said: str) -> None:
    person = TrueObject("person", 7.0, 15.5, 0.3, target=False)
    got = scored(confirmed(), rests(*where), MAPPED, objects=(person,))
    assert got["ending"] == "misdelivered" and got["deliveries"][0]["unsafe"] == said
    assert got["shortfalls"] == ["parcel not delivered (misdelivered)"]


def test_a_second_parcel_for_one_target_is_one_too_many() -> None:
    first, second = released((7.0, 15.0)), {**released((15.0, 23.0)), "vehicle": "uas2"}
    got = scored(confirmed(), first, rests(7.5, 15.0), second, {**rests(15.0, 23.0), "vehicle": "uas2"}, MAPPED)
    assert (got["delivered"], got["served_twice"], got["separation_m"]) == (2, 1, None)
    assert got["shortfalls"] == ["1 parcels for a target that had one"]


def test_what_two_have_mapped_of_one_area_is_one_region() -> None:
    parts = (
        region((10.5, 10.5), (10.5, 15.5), (19.5, 15.5), (19.5, 10.5)),
        region((10.5, 14.5), (10.5, 19.5), (19.5, 19.5), (19.5, 14.5)),
    )
    got = scored(parts[0], {**parts[1], "vehicle": "uas2"})
    assert (got["regions_total"], got["regions_false"], got["targets_found"]) == (1, 0, 1)
    assert got["targets"][0]["iou"] == pytest.approx(1.0, abs=0.02)


def test_an_abort_is_told_with_its_reason() -> None:
    stays = {"event": "delivery_aborted", "time_s": 25.0, "vehicle": "uas", "reason": "drift"}
    got = scored(confirmed(), stays, MAPPED)
    assert (got["ending"], got["abort_reason"]) == ("aborted", "drift")
    assert got["shortfalls"] == ["parcel not delivered: drift"]
    lies_off = scored(confirmed(), stays, rests(7.0, 30.0), MAPPED)
    assert lies_off["shortfalls"] == ["parcel not delivered (misdelivered)"], "it went elsewhere after all"


def test_a_middle_is_held_against_the_middle_of_the_true_area() -> None:
    figures = scored(
        plan(), confirmed((15.0, 18.0), located="middle"), released((15.0, 18.0)), rests(15.5, 19.0), LANDED
    )
    assert figures["geolocation_rmse_m"] == pytest.approx(3.0, abs=0.01)
    (parcel,) = figures["deliveries"]
    assert parcel["to_middle_m"] == pytest.approx(math.hypot(0.5, 4.0), abs=0.01)
    assert not parcel["safe"] and parcel["unsafe"] == "in the area"
    (none,) = scored(plan(), released((15.0, 18.0)), rests(15.5, 19.0), areas=())["deliveries"]
    assert none["to_middle_m"] is None


def test_an_edge_far_from_any_true_one_or_of_another_label_is_a_false_diversion() -> None:
    for one in (confirmed((30.0, 30.0)), confirmed(label="fire_region")):
        got = scored(one, MAPPED)
        assert (got["diversions"], got["diversions_false"], got["geolocation_rmse_m"]) == (1, 1, None)
    far = region((30, 30), (30, 35), (35, 35), label="fire_region")
    got = scored(far)
    assert (got["regions_false"], got["targets_found"]) == (1, 0)


def test_a_fire_moves_on_and_burns_out() -> None:
    fire = TrueArea("fire", "front", "fire", ((0.0, 0.0), (0.0, 30.0), (5.0, 30.0), (5.0, 0.0)), (), (0.1, 0.0), 30.0)
    (begun,), (later,) = targets([fire], 0.0), targets([fire], 100.0)
    assert begun.shape.bounds[::2] == (0.0, 5.0)
    assert later.shape.bounds[::2] == pytest.approx((5.0 + 0.1 * 60.0, 15.0))


def test_pieces_of_one_ruin_are_one_target_and_rubble_is_none() -> None:
    def piece(north_m: float, label: str = "debris slab") -> TrueArea:
        n = north_m
        return TrueArea("solid", f"{label} {n}", label, ((n, 0.0), (n + 3.0, 0.0), (n + 3.0, 3.0), (n, 3.0)))

    areas = [piece(0.0), piece(5.0), piece(20.0, "debris wall"), piece(30.0, "debris rubble"), piece(40.0, "building")]
    assert [round(one.shape.area) for one in targets(areas, 0.0)] == [18, 9]


def test_outlines_come_back_from_their_text() -> None:
    rings = [[(47.1234567, 8.0), (47.2, -8.1), (-1.0, 0.5)], [(0.0, 0.0)]]
    assert rings_of(as_text(rings)) == rings and rings_of("") == []
    assert math.isclose(rings_of(as_text([[(1e-7, 2e-7)]]))[0][0][0], 1e-7)


def test_the_height_over_ground_is_that_of_lines_alone() -> None:
    """Ground that rises from 0 to 4 m; a path that takes off, flies a line at 20 m over home, and comes down."""
    times = [float(t) for t in range(41)]
    up = [2.0 * t for t in range(10)] + [20.0] * 21 + [2.0 * (10 - t) for t in range(10)]
    track = Track(times, list(times), [0.0] * 41, up)
    phases = [("taking off", 0.0), ("scanning", 10.0), ("returning", 31.0)]
    events = [plan() | {"scan_altitude_m": 20.0}]
    events += [{"event": "phase", "vehicle": "uas", "phase": name, "time_s": at} for name, at in phases]

    def ground_m(north_m: float, _east_m: float) -> float:
        return 0.1 * north_m

    record = RunRecord(events, [], {"uas": track}, lambda *_: (0.0, 0.0), ground_m=ground_m)
    off = [0.1 * t for t in range(10, 31)]
    wanted = math.sqrt(sum(one * one for one in off) / len(off))
    got = scan_height(record)
    assert got == {"wanted_m": 20.0, "mean_m": pytest.approx(18.0), "rms_m": pytest.approx(wanted, abs=1e-3)}


def test_a_height_over_no_ground_is_not_known() -> None:
    assert scan_height(RunRecord([plan()], [], {}, lambda *_: (0.0, 0.0))) is None
