"""Regions from boxes: confirmed by frames in a row, carved by those that show a place outside, one within a gap."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import box

from sitl_emu.missions.companion.camera_model import CameraPose, project
from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.detector import Areas, Detections
from sitl_emu.missions.companion.terrain.terrain_map import Bounds
from sitl_emu.missions.disaster import aborts, places
from sitl_emu.missions.disaster.places import Standing
from sitl_emu.missions.disaster.regions import Region, RegionMap
from tests.unit.disaster_boxes import CAMERA, LABELS, POND, UP_M, Box, box_of, pose_at


def a_map(confirmations: int = 3) -> RegionMap:
    return RegionMap(Bounds(-20.0, -20.0, 50.0, 50.0), LABELS, CAMERA, Confirming(confirmations, confirm_score=0.3))


def flown(over: RegionMap, area: Box, east_m: float = 14.0, yaw_rad: float = 0.0) -> None:
    """A line to the north, a frame every half metre."""
    for north_m in np.arange(-15.0, 45.0, 0.5):
        pose = pose_at(float(north_m), east_m, yaw_rad)
        over.update(pose, 0.0, box_of(pose, area))


def a_place() -> tuple[RegionMap, Region, places.Place]:
    """The pond, seen from a line over it, and the place for its parcel."""
    over = a_map()
    flown(over, POND)
    (region,) = over.regions()
    place = places.choose(over, region, (5.0, 14.0))
    assert place is not None
    return over, region, place


def test_a_region_is_what_frames_in_a_row_have_seen() -> None:
    for frames, found in ((2, 0), (3, 1)):
        over, pose = a_map(), pose_at(12.0, 12.0)
        for _ in range(frames):
            over.update(pose, 0.0, box_of(pose, POND))
        assert len(over.regions()) == found


def test_a_frame_that_misses_it_ends_the_run() -> None:
    over, pose = a_map(), pose_at(12.0, 12.0)
    for seen in (True, True, False, True, True):
        over.update(pose, 0.0, box_of(pose, POND) if seen else [])
    assert over.regions() == []


def test_weak_scores_confirm_nothing() -> None:
    over, pose = a_map(), pose_at(12.0, 12.0)
    for _ in range(20):
        over.update(pose, 0.0, box_of(pose, POND, score=0.29))
    assert over.regions() == []


def test_what_is_not_seen_any_more_is_gone() -> None:
    over, pose = a_map(), pose_at(12.0, 12.0)
    for seen in (True,) * 5 + (False,) * 6:
        over.update(pose, 0.0, box_of(pose, POND) if seen else [])
    assert over.regions() == []


@given(
    st.floats(-math.pi, math.pi), st.floats(-0.15, 0.15), st.floats(2.0, 28.0), st.floats(2.0, 28.0),
    st.floats(12.0, 30.0),
)  # fmt: skip
def test_a_cell_is_hit_where_its_place_lies_in_the_box(
    yaw_rad: float, tilt_rad: float, north_m: float, east_m: float, up_m: float
) -> None:
    over, pose = a_map(1), pose_at(north_m, east_m, yaw_rad, tilt_rad, up_m)
    boxes = box_of(pose, POND)
    over.update(pose, 0.0, boxes)
    for n, e in ((15.5, 14.5), (5.5, 5.5), (25.5, 20.5)):
        pixel, cell = project(CAMERA, pose, (n, e, 0.0)), over.cell(n, e)
        assert cell is not None
        shown = pixel is not None and 4.0 <= pixel[0] <= 635.0 and 4.0 <= pixel[1] <= 475.0
        assert bool(over.looks[cell]) is shown
        if shown and pixel is not None:
            inside = any(abs(pixel[0] - b.x) <= b.w / 2 and abs(pixel[1] - b.y) <= b.h / 2 for b in boxes)
            assert bool(over.odds[0][cell] > 0.0) is inside


@pytest.mark.parametrize(("yaw_rad", "within_m"), [(0.0, 2.0), (math.pi / 2, 2.0), (math.radians(200.0), 4.0)])
def test_a_line_carves_a_pond(yaw_rad: float, within_m: float) -> None:
    """Boxes that lie aslant on it, all at one heading, carve less."""
    over = a_map()
    flown(over, POND, yaw_rad=yaw_rad)
    (region,) = over.regions()
    assert region.label == "water_body"
    assert region.middle_m == pytest.approx((15.0, 14.0), abs=1.0)
    south, west, north, east = POND
    rows, columns = np.nonzero(region.cells)
    assert over.north_m[rows, columns].min() > south - within_m and over.north_m[rows, columns].max() < north + within_m
    assert over.east_m[rows, columns].min() > west - within_m and over.east_m[rows, columns].max() < east + within_m


def areas_of(pose: CameraPose, area: Box, share: float = 0.9) -> Detections:
    """What a detector that knows areas says, in parts of 16 pixels, of an area on ground at height 0."""
    shares = np.zeros((2, CAMERA.height // 16, CAMERA.width // 16), np.float32)
    south, west, north, east = area
    for n in np.arange(south, north, 0.1):
        for e in np.arange(west, east, 0.1):
            pixel = project(CAMERA, pose, (float(n), float(e), 0.0))
            if pixel is not None and 0.0 <= pixel[0] < CAMERA.width and 0.0 <= pixel[1] < CAMERA.height:
                shares[0, int(pixel[1]) // 16, int(pixel[0]) // 16] = share
    return Detections([], Areas(LABELS, shares, 16.0, 0.0, 0.0))


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, 200.0])
def test_one_place_shows_where_an_area_lies_that_the_detector_knows(yaw_deg: float) -> None:
    """Within a cell, at any heading, without a box and without carving."""
    over, pose = a_map(), pose_at(14.0, 13.0, math.radians(yaw_deg))
    for _ in range(3):
        over.update(pose, 0.0, areas_of(pose, POND))
    (region,) = over.regions()
    south, west, north, east = POND
    inner = (over.north_m > south) & (over.north_m < north) & (over.east_m > west) & (over.east_m < east)
    outer = (over.north_m > south - 1) & (over.north_m < north + 1)
    outer &= (over.east_m > west - 1) & (over.east_m < east + 1)
    assert region.label == "water_body" and region.score > 0.9
    assert region.cells[inner].all() and not region.cells[~outer].any()
    scattered = RegionMap(
        Bounds(-20, -20, 50, 50), LABELS, CAMERA, Confirming(3, confirm_score=0.3), "rays", LABELS[:1], 15.0
    )
    for _ in range(3):
        scattered.update(pose, 0.0, areas_of(pose, POND))
    (found,) = scattered.regions()
    low = pose_at(14.0, 13.0, math.radians(yaw_deg), up_m=7.0)
    for _ in range(20):
        scattered.update(low, 0.0, areas_of(low, (0.0, 0.0, 0.0, 0.0)))
    assert (scattered.regions()[0].cells == found.cells).all(), "from low it is not told where it is not"
    for _ in range(6):
        scattered.update(low, 0.0, areas_of(low, (9.0, 12.0, 10.0, 15.0)))
    assert (scattered.regions()[0].cells == found.cells).all(), "nor where it is,"
    cell = scattered.cell(9.5, 13.5) or (0, 0)
    assert scattered.low_doubt[cell] > places.LOW_DOUBT, "but that no parcel goes there"
    weak = a_map()
    for _ in range(3):
        weak.update(pose, 0.0, areas_of(pose, POND, share=0.4))
    assert weak.regions() == []


@pytest.mark.parametrize(("gap_m", "count"), [(1.0, 1), (12.0, 2)])
def test_two_sightings_are_one_target_when_no_wide_gap_lies_between(gap_m: float, count: int) -> None:
    over, pose = a_map(), pose_at(18.0, 14.0)
    other = (20.0 + gap_m, 10.0, 28.0 + gap_m, 18.0)
    for _ in range(4):
        over.update(pose, 0.0, [*box_of(pose, POND), *box_of(pose, other)])
    assert len(over.regions()) == count


def test_the_ground_is_reckoned_with_where_it_is_known() -> None:
    over, pose = a_map(1), pose_at(15.0, 0.0)
    high = np.full(over.shape, 5.0)
    over.update(pose, high, [])
    seen_m = over.east_m[over.looks > 0]
    assert seen_m.max() == pytest.approx(15.0 * 319.5 / 320.0, abs=1.0), "from 15 m above it, not from 20"


def test_a_look_from_aslant_that_something_hides_says_little() -> None:
    """As many looks from above that show it as from aslant that do not: it is there."""
    over, pond = a_map(), (14.0, 13.0, 16.0, 15.0)
    for seen, pose in ((True, pose_at(15.0, 14.0)), (False, pose_at(15.0, 14.0 + 0.7 * UP_M))):
        for _ in range(4):
            over.update(pose, 0.0, areas_of(pose, pond) if seen else areas_of(pose, (0.0, 0.0, 0.0, 0.0)))
    assert [region.label for region in over.regions()] == ["water_body"]
    for _ in range(4):
        over.update(pose_at(15.0, 14.0), 0.0, areas_of(pose_at(15.0, 14.0), (0.0, 0.0, 0.0, 0.0)))
    assert over.regions() == [], "from above nothing hides it"


def test_by_the_equations_a_tilted_camera_places_it_beside_itself() -> None:
    """H tan(tilt) from 20 m: 3.5 m for 10 degrees; level, both agree."""
    for tilt_deg, off_m in ((0.0, 0.0), (10.0, 3.5)):
        middles = []
        for location in ("rays", "equations"):
            over = RegionMap(Bounds(-20.0, -20.0, 50.0, 50.0), LABELS, CAMERA, Confirming(1, 0.3), location)
            pose = pose_at(15.0, 14.0, tilt_rad=math.radians(tilt_deg))
            over.update(pose, 0.0, box_of(pose, POND))
            (region,) = over.regions()
            middles.append(region.middle_m)
        assert math.dist(*middles) == pytest.approx(off_m, abs=0.6)


def test_the_parcel_goes_beside_it_on_plain_ground() -> None:
    over, region, place = a_place()
    south, west, north, east = POND
    n, e = place.place_m
    off = math.hypot(max(south - n, 0.0, n - north), max(west - e, 0.0, e - east))
    assert 1.0 <= off <= 5.0
    assert math.dist(place.edge_m, place.place_m) == pytest.approx(off, abs=1.6)
    # somebody stands there: edges in the picture
    row, column = over.cell(n, e) or (0, 0)
    over.rough[row, column] = 0.5
    other = places.choose(over, region, (5.0, 14.0))
    assert other is not None and math.dist(other.place_m, place.place_m) >= places.PLAIN_M
    # a car's roof is mapped there, or that of a house
    over.rough[row, column], there, nowhere = 0.0, np.zeros(over.shape, np.bool_), np.zeros(over.shape, np.bool_)
    there[row, column] = True
    about = (Standing(there, nowhere, ~there), places.PLAIN_M), (Standing(there, there, ~there), places.BESIDE_M)
    for stands, away_m in about:
        other = places.choose(over, region, (5.0, 14.0), stands=stands)
        assert other is not None and away_m <= math.dist(other.place_m, place.place_m) <= away_m + 2.0
        assert places.is_free(over, place.place_m) and not places.is_free(over, place.place_m, stands)
    over.odds[0][row, column] = 1.0
    assert not places.is_free(over, place.place_m), "it was seen to be water after all"
    assert not places.is_free(over, (500.0, 0.0))


def test_best_is_farther_from_what_spreads_meanwhile() -> None:
    over, water, _ = a_place()
    fire = water._replace(label="fire_region")
    beside, ahead = (places.choose(over, one, (5.0, 14.0)) for one in (water, fire))
    assert beside is not None and ahead is not None
    off_m = [POND[0] - place.place_m[0] for place in (beside, ahead)]
    assert off_m == pytest.approx([places.BEST_M, places.BEST_M + places.SPREADS_M], abs=0.5) and off_m[0] < off_m[1]


def test_a_place_that_is_gone_to_is_kept_with_less_room_than_one_is_chosen_with() -> None:
    over, region, place = a_place()
    n, e = place.place_m
    nowhere = np.zeros(over.shape, np.bool_)
    for away_m, is_kept in ((places.HELD * places.PLAIN_M + 1.0, True), (1.0, False)):
        near = np.abs(np.hypot(over.north_m - n, over.east_m - e) - away_m) < 0.6
        stands = Standing(near, nowhere, ~nowhere)
        here = np.hypot(over.north_m - n, over.east_m - e) < 0.1
        assert places.choose(over, region, place.place_m, here, stands) is None, "somebody is less than 2 m away"
        still = places.kept(over, region, place, stands=stands)
        assert (still is not None) == is_kept
        if still is not None:
            assert still.place_m == place.place_m and math.dist(still.edge_m, place.edge_m) < 0.1
    assert places.kept(over, region, place, allowed=nowhere) is None, "beyond the fence"
    assert places.kept(over, region, place._replace(place_m=(500.0, 0.0))) is None
    farther = place._replace(place_m=(n - 2.0, e))
    there = np.hypot(over.north_m - farther.place_m[0], over.east_m - farther.place_m[1]) < 0.1
    assert there.any() and places.choose(over, region, farther.place_m, there) is None, "4.5 m from the edge"
    assert places.choose(over, region, farther.place_m, there, closer=True) is not None, "it is the last there is"
    assert places.kept(over, region, farther) is not None, "edges move while more is seen of them"
    away = place._replace(place_m=(POND[0] - places.HELD_WITHIN_M - 2.0, 14.0))
    assert places.is_free(over, away.place_m) and places.kept(over, region, away) is None, "it is of the region no more"


def test_ground_that_may_be_shallow_water_is_no_place() -> None:
    """Too little is seen of it to be of the region."""
    over, south, shallows = a_map(), POND[0], (4.0, 8.0, 10.0, 20.0)
    for north_m in np.arange(-15.0, 45.0, 0.5):
        pose = pose_at(float(north_m), 14.0)
        seen, faint = areas_of(pose, POND), areas_of(pose, shallows, 0.3)
        assert seen.areas is not None and faint.areas is not None
        over.update(pose, 0.0, Detections([], seen.areas._replace(shares=seen.areas.shares + faint.areas.shares)))
    (region,) = over.regions()
    assert over.north_m[region.cells].min() > south - 1.0, "they are not of the region"
    assert not places.is_free(over, (south - 3.0, 14.0)) and places.is_free(over, (south - 10.0, 14.0))
    place = places.choose(over, region, (0.0, 14.0))
    assert place is not None and not (place.place_m[0] < south and 8.0 < place.place_m[1] < 20.0)


def test_what_is_in_little_doubt_from_low_is_no_place() -> None:
    """From high so much is told of dry ground, too."""
    over, there = a_map(), (POND[0] - 3.0, 14.0)
    shallows = (there[0] - 1.0, there[1] - 1.0, there[0] + 1.0, there[1] + 1.0)
    for up_m, free in ((UP_M, True), (7.0, False)):
        for _ in range(2 * places.LOOKS):
            pose = pose_at(*there, up_m=up_m)
            over.update(pose, 0.0, areas_of(pose, shallows, 0.15))
        assert places.is_free(over, there) == free


def test_what_looks_dry_in_the_midst_of_it_is_no_place() -> None:
    """Water in a house's shade does."""
    over = a_map()
    over.looks[:], over.odds[:], over.steepness[:], over.turned[:] = places.LOOKS, -3.0, 0.0, 0.0
    lake = np.hypot(over.north_m - 15.0, over.east_m - 15.0) < 20.0
    shade = np.hypot(over.north_m - 15.0, over.east_m - 15.0) < 10.0
    over.odds[0][lake & ~shade] = 3.0
    region = Region("water_body", lake & ~shade, 0.9, (15.0, 15.0))
    assert places.is_free(over, (15.0, 15.0))
    place = places.choose(over, region, (15.0, 15.0))
    assert place is not None and math.dist(place.place_m, (15.0, 15.0)) > 20.0
    roof = Standing(lake & shade, lake & shade, ~shade)
    assert places.choose(over, region, (15.0, 15.0), ~lake, roof) is not None
    assert places.choose(over, region, (15.0, 15.0), lake) is None


@pytest.mark.parametrize("tangent", [0.3, 0.7])
@pytest.mark.parametrize("above", [True, False])
def test_what_was_seen_from_above_to_be_none_is_none_from_aslant(above: bool, tangent: float) -> None:
    over, pond = a_map(), (14.0, 13.0, 16.0, 15.0)
    for _ in range(4 if above else 0):
        over.update(pose_at(15.0, 14.0), 0.0, areas_of(pose_at(15.0, 14.0), (0.0, 0.0, 0.0, 0.0)))
    aslant = pose_at(15.0, 14.0 + tangent * UP_M)
    for _ in range(12):
        over.update(aslant, 0.0, areas_of(aslant, pond))
    assert [region.label for region in over.regions()] == ([] if above else ["water_body"])
    for _ in range(12):
        over.update(pose_at(15.0, 14.0), 0.0, areas_of(pose_at(15.0, 14.0), pond))
    assert over.regions(), "it has come since"


def test_the_way_to_a_place_beside_it_leads_past_what_stands() -> None:
    over, _, place = a_place()
    (north_m, east_m), tall = place.place_m, np.zeros(over.shape, np.bool_)
    beyond = north_m, east_m + 6.0
    none = Standing(tall, tall, ~tall)
    assert places.is_way_clear(over, place.place_m, beyond, none) and places.is_way_clear(over, beyond, beyond, None)
    between = np.hypot(over.north_m - north_m - 3.0, over.east_m - east_m - 3.0) < 1.0
    assert not places.is_way_clear(over, place.place_m, beyond, Standing(between, between, ~between))
    assert not places.is_way_clear(over, place.place_m, (500.0, east_m), none), "nobody looked there"


def test_a_place_is_seen_from_above_and_from_both_sides() -> None:
    """Aslant a wall is taken for the ground behind it, and what was seen from one side alone may be a roof."""
    for tangent, line, there in ((0.2, True, True), (0.7, True, False), (0.2, False, False)):
        over, north_m = a_map(), POND[2] + 4.0
        for along_m in np.arange(-14.0, 14.0, 0.5) if line else np.zeros(20):
            pose = pose_at(north_m + UP_M * tangent, 14.0 + float(along_m), math.pi / 2.0)
            over.update(pose, 0.0, box_of(pose, POND))
        (region,) = over.regions()
        beyond = (over.north_m > POND[2]) & (np.abs(over.east_m - 14.0) < 4.0) & (over.north_m < north_m + 1.0)
        place = places.choose(over, region, (north_m, 14.0), beyond)
        assert (place is not None) == there
        assert places.choose(over, region, (north_m, 14.0), beyond, closer=True) is not None, "worth a look from above"


def test_by_the_equations_a_look_from_a_little_aslant_still_counts() -> None:
    """They do not know how far the camera is tilted."""
    above, aslant, pond = pose_at(15.0, 14.0), pose_at(15.0, 14.0 + 0.3 * UP_M), (14.0, 13.0, 16.0, 15.0)
    found = {}
    for location in ("rays", "equations"):
        over = RegionMap(Bounds(-20.0, -20.0, 50.0, 50.0), LABELS, CAMERA, Confirming(3, confirm_score=0.3), location)
        for pose, shown, frames in ((above, (0.0, 0.0, 0.0, 0.0), 4), (aslant, pond, 12)):
            for _ in range(frames):
                over.update(pose, 0.0, areas_of(pose, shown))
        found[location] = len(over.regions())
    assert found == {"rays": 0, "equations": 1}


def test_an_areas_edge_is_where_half_of_a_part_shows_it() -> None:
    """Too little to be sure of, as of a shore's last metre."""
    over, shore = a_map(), (POND[0] - 3.0, *POND[1:])
    for north_m in np.arange(-15.0, 45.0, 0.5):
        pose = pose_at(float(north_m), 14.0)
        sure, half = areas_of(pose, POND), areas_of(pose, shore, 0.55)
        assert sure.areas is not None and half.areas is not None
        over.update(
            pose, 0.0, Detections([], sure.areas._replace(shares=np.maximum(sure.areas.shares, half.areas.shares)))
        )
    (region,) = over.regions()
    assert over.north_m[region.cells].min() > POND[0] - 1.0
    place = places.choose(over, region, (0.0, 14.0), over.north_m < shore[0])
    assert place is not None and place.edge_m[0] == pytest.approx(shore[0], abs=1.0)
    assert places.is_beside(over, region, (shore[0] - 4.0, 14.0))
    assert not places.is_beside(over, region, (shore[0] - 7.0, 14.0))
    assert not places.is_beside(over, region, (500.0, 14.0))


def test_an_edge_is_where_it_is_seen_from_above_and_not_where_more_looks_from_aslant_have_it() -> None:
    """What stands is seen beside its place from aslant."""
    over, behind = a_map(), (POND[0] - 2.0, *POND[1:])
    above, aslant = pose_at(POND[0], 14.0), pose_at(POND[0] + 0.65 * UP_M, 14.0, math.pi / 2.0)
    for pose, shown, frames in ((above, POND, 10), (aslant, behind, 20)):
        for _ in range(frames):
            over.update(pose, 0.0, areas_of(pose, shown, 0.9))
    row, column = over.cell(POND[0] - 1.5, 14.0) or (0, 0)
    assert over.looks[row, column] == 30
    assert 0.2 < over.doubt[row, column] < places.HALF
    within = over.cell(POND[0] + 1.5, 14.0)
    assert within is not None and over.doubt[within] == pytest.approx(0.9, abs=0.05)


def test_a_plain_roof_is_no_place_by_its_mapped_edges() -> None:
    """Its corners are mapped, and the ground beyond them; nothing between."""
    over, _, place = a_place()
    n, e = place.place_m
    roof = np.hypot(over.north_m - n, over.east_m - e) <= places.BESIDE_M + 1.0
    edge = roof & (np.hypot(over.north_m - n, over.east_m - e) > places.BESIDE_M)
    assert not places.is_free(over, place.place_m, Standing(edge, edge, ~roof))
    assert places.is_free(over, place.place_m, Standing(edge, edge, ~edge)), "ground is mapped there"


def test_regions_are_of_the_area_that_is_asked_for() -> None:
    """What is seen of the pond beyond keeps parcels off all the same."""
    south, west, north, east = POND
    half = (south + north) / 2.0
    bounds = Bounds(-20.0, -20.0, 50.0, 50.0)
    over = RegionMap(bounds, LABELS, CAMERA, Confirming(3, confirm_score=0.3), area=box(-20.0, -20.0, half, 50.0))
    flown(over, POND)
    (region,) = over.regions()
    assert over.north_m[region.cells].max() < half
    place = places.choose(over, region, (half + 3.0, (west + east) / 2.0))
    assert place is not None and not (south < place.place_m[0] < north and west < place.place_m[1] < east)


def test_no_place_lies_in_another_area_or_where_nobody_looked() -> None:
    over = a_map()
    flown(over, POND)
    (region,) = over.regions()
    over.odds[1][:] = 2.0
    assert places.choose(over, region, (5.0, 14.0)) is None, "fire all around"
    over.odds[1][:] = -3.0
    over.looks[:] = places.LOOKS - 1
    assert places.choose(over, region, (5.0, 14.0)) is None
    nowhere = np.zeros(over.shape, np.bool_)
    over.looks[:] = places.LOOKS
    assert places.choose(over, region, (5.0, 14.0), nowhere) is None, "beyond the fence"


def test_uncertainty_grows_with_height_angle_and_receiver() -> None:
    place = places.Place("water_body", 0.9, (0.0, 0.0), (1.0, 0.0), 0.2, 20.0)
    least = places.sigma_m(place, 10.0, 2.0)
    assert least < places.sigma_m(place, 30.0, 2.0)
    assert least < places.sigma_m(place._replace(edge_steepness=1.0), 10.0, 2.0)
    assert least < places.sigma_m(place, 10.0, 2.0, eph_m=2.5)
    with pytest.raises(aborts.Aborted, match=r"uncertain location: one sigma is 4\.2 m, more than 2\.9"):
        aborts.check_location(4.2)
    aborts.check_location(least)


@pytest.mark.parametrize(
    ("battery", "eph_m", "has_fix", "glitches", "reason"),
    [
        (24, 0.6, True, 0, "low battery"),
        (80, 6.0, True, 0, "GPS degraded"),
        (80, 0.6, False, 0, "GPS degraded"),
        (80, 0.6, True, 2, "GPS degraded"),
        (80, 0.6, True, 0, "compass silent"),
    ],
)
def test_a_vehicle_that_should_go_home_is_told_why(
    battery: int, eph_m: float, has_fix: bool, glitches: int, reason: str
) -> None:
    with pytest.raises(aborts.Aborted) as told:
        aborts.check_vehicle(battery, eph_m, has_fix, glitches, compass_ok=reason != "compass silent")
    assert told.value.reason == reason and not told.value.reason.of_the_place
    aborts.check_vehicle(None, None)
    aborts.check_vehicle(25, 5.0, gps_glitches=1)


def test_what_stands_under_the_vehicle_a_silent_lidar_and_a_storm_are_told() -> None:
    with pytest.raises(aborts.Aborted, match=r"obstacle: something 6\.0 m higher"):
        aborts.check_below(7.0, 1.0)
    aborts.check_below(2.9, 1.0)
    with pytest.raises(aborts.Aborted, match="range finder silent: nothing heard for inf s"):
        aborts.check_range_finder(math.inf)
    aborts.check_range_finder(0.5)
    with pytest.raises(aborts.Aborted, match=r"wind: 13\.0 m/s"):
        aborts.check_wind(13.0)
    aborts.check_wind(None)
