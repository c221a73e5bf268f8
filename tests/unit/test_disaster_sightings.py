"""What one frame says of where a region is, by rays and by the paper's equations, over ground at and above home's."""

import math

import pytest

from sitl_emu.missions.companion.confirmation import Confirming
from sitl_emu.missions.companion.terrain.terrain_map import Bounds
from sitl_emu.missions.disaster.regions import RegionMap
from sitl_emu.missions.disaster.sightings import Sighting, Sightings
from tests.unit.disaster_boxes import CAMERA, LABELS, POND, UP_M, Box, box_of, pose_at

MIDDLE = (15.0, 14.0)
POOL: Box = (30.0, 11.0, 36.0, 17.0)


def told(
    location: str, tilt_deg: float = 0.0, rise_m: float = 0.0, known_m: float = 0.0, area: Box = POND
) -> list[Sighting]:
    """Of an area on ground `rise_m` above home's, where a map has `known_m`; three frames from 6 m beside it."""
    over = RegionMap(Bounds(-20.0, -20.0, 50.0, 50.0), LABELS, CAMERA, Confirming(3, confirm_score=0.3), location)
    sightings, found = Sightings(CAMERA, location), list[Sighting]()
    true = pose_at(9.0, 14.0, tilt_rad=math.radians(tilt_deg), up_m=UP_M - rise_m)
    told_pose = pose_at(9.0, 14.0, tilt_rad=math.radians(tilt_deg))
    for frame in range(4):
        boxes = box_of(true, area)
        over.update(told_pose, known_m, boxes)
        new = sightings.new(told_pose, boxes, over, known_m)
        assert not new or frame == 2, "once, as soon as it is confirmed"
        found += new
    return found


@pytest.mark.parametrize("location", ["rays", "equations"])
def test_level_ground_whose_height_is_known_puts_a_box_in_its_place(location: str) -> None:
    for rise_m in (0.0, 4.0):
        (one,) = told(location, rise_m=rise_m, known_m=rise_m)
        assert one.label == "water_body" and math.dist(one.place_m, MIDDLE) < 0.3


def test_relief_that_is_not_known_puts_it_farther_off_the_nearer_it_is() -> None:
    """4 m higher than home, which is what a height above home knows: 6 m from below the camera seem 6 · 20 / 16."""
    for location in ("rays", "equations"):
        (one,) = told(location, rise_m=4.0)
        assert math.dist(one.place_m, MIDDLE) == pytest.approx(6.0 * (UP_M / 16.0 - 1.0), abs=0.4)


def test_a_tilted_camera_puts_it_aside_by_the_equations_alone() -> None:
    """20 m tan(8 deg) and more, as it is not in the picture's middle."""
    (by_rays,), (by_equations,) = told("rays", tilt_deg=8.0), told("equations", tilt_deg=8.0)
    assert math.dist(by_rays.place_m, MIDDLE) < 0.5 < 2.5 < math.dist(by_equations.place_m, MIDDLE) < 4.0


def test_nothing_is_told_of_a_box_that_the_picture_cuts() -> None:
    assert told("rays", area=(15.0, 11.0, 40.0, 17.0)) == []


def test_nothing_is_told_of_a_box_of_a_part() -> None:
    over = RegionMap(Bounds(-20.0, -20.0, 50.0, 50.0), LABELS, CAMERA, Confirming(3, confirm_score=0.3))
    sightings, pose = Sightings(CAMERA, "rays"), pose_at(9.0, 14.0)
    (whole,) = box_of(pose, POND)
    for _ in range(3):
        over.update(pose, 0.0, [whole])
    assert sightings.new(pose, [whole._replace(w=0.6 * whole.w, h=0.6 * whole.h)], over, 0.0) == []
    (one,) = sightings.new(pose, [whole._replace(w=0.8 * whole.w, h=0.8 * whole.h)], over, 0.0)
    assert math.dist(one.place_m, MIDDLE) < 0.5


def test_each_region_is_told_once() -> None:
    over = RegionMap(Bounds(-20.0, -20.0, 50.0, 50.0), LABELS, CAMERA, Confirming(3, confirm_score=0.3))
    sightings, found = Sightings(CAMERA, "rays"), list[Sighting]()
    for north_m in range(5, 45):
        pose = pose_at(float(north_m), 14.0)
        boxes = box_of(pose, POND) + box_of(pose, POOL)
        over.update(pose, 0.0, boxes)
        found += sightings.new(pose, boxes, over, 0.0)
    off_m = [math.dist(one.place_m, to) for one, to in zip(found, (MIDDLE, (33.0, 14.0)), strict=True)]
    assert max(off_m) < 0.5
