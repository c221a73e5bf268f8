"""Confirmation as transcripts: frames in, targets out."""

import math
from collections.abc import Sequence

import pytest

from sitl_emu.missions.companion.camera_model import NADIR, CameraModel, CameraPose, camera_pose, project
from sitl_emu.missions.companion.confirmation import STANDING, SURVEYING, UNSTEADY, Confirmation, Target, widened_m
from sitl_emu.missions.companion.detector import Detection

CAMERA = CameraModel()
NORTH = (1.0, 0.0, 0.0, 0.0)
FRAME_US = 66_667


def at(north: float, east: float = 0.0) -> CameraPose:
    return camera_pose((north, east, -15.0), NORTH, NADIR)


def sight(pose: CameraPose, north: float, east: float, score: float = 0.9, label: str = "weed") -> list[Detection]:
    pixel = project(CAMERA, pose, (north, east, 0.0))
    assert pixel is not None
    inside = 0 <= pixel[0] <= 639 and 0 <= pixel[1] <= 479
    return [Detection(label, score, *pixel, 20.0, 20.0)] if inside else []


class Flight:
    """A line north at 5 m/s past targets; `fly` returns what was reported."""

    def __init__(self) -> None:
        self.confirmation = Confirmation(CAMERA, 0.0)
        self.time_us = 0

    def fly(
        self,
        start: float,
        stop: float,
        targets: Sequence[tuple[float, float]],
        east: float = 0.0,
        score: float = 0.9,
        labels: str = "weed",
        miss_each: int = 0,
    ) -> list[Target]:
        new: list[Target] = []
        for i in range(int(abs(stop - start) * 3)):
            pose = at(start + math.copysign(i / 3.0, stop - start), east)
            seen = []
            for north, target_east in targets:
                if not miss_each or i % miss_each:
                    label = labels.split()[i % len(labels.split())]
                    seen += sight(pose, north, target_east, score, label)
            new += self.confirmation.update(self.time_us, pose, seen)
            self.time_us += FRAME_US
        return new


def test_a_steady_target_is_reported_once_and_in_its_place() -> None:
    flight = Flight()
    new = flight.fly(0.0, 60.0, [(30.0, 4.0)])
    assert len(new) == 1
    target = new[0]
    assert target.label == "weed"
    assert (target.north_m, target.east_m) == pytest.approx((30.0, 4.0), abs=0.05)
    assert target.score == pytest.approx(0.9) and target.sightings >= 3
    assert target.frame_time_us > 0 and target.detection.label == "weed"
    assert flight.confirmation.finish() == []
    assert [t.id for t in flight.confirmation.targets] == [target.id]


def test_the_neighbouring_line_sees_it_again_and_it_stays_one() -> None:
    flight = Flight()
    assert len(flight.fly(0.0, 60.0, [(30.0, 6.0)])) == 1
    sightings = flight.confirmation.targets[0].sightings
    assert flight.fly(60.0, 0.0, [(30.0, 6.0)], east=12.0) == []
    assert len(flight.confirmation.targets) == 1
    assert flight.confirmation.targets[0].sightings > sightings


def test_two_targets_in_one_picture_are_two() -> None:
    flight = Flight()
    new = flight.fly(0.0, 60.0, [(30.0, 4.0), (33.0, -5.0)])
    assert sorted(round(t.north_m) for t in new) == [30, 33]


def test_two_frames_confirm_nothing() -> None:
    confirmation = Confirmation(CAMERA, 0.0, STANDING)
    for i in range(2):
        assert confirmation.update(i * FRAME_US, at(i / 3), sight(at(i / 3), 5.0, 0.0)) == []
    assert len(confirmation.update(2 * FRAME_US, at(2 / 3), sight(at(2 / 3), 5.0, 0.0))) == 1


def test_a_frame_that_should_see_it_and_does_not_breaks_the_run() -> None:
    flight = Flight()
    # Every third frame misses it: never three in a row.
    assert flight.fly(0.0, 60.0, [(30.0, 4.0)], miss_each=3) == []
    assert flight.confirmation.finish() == []


def test_a_frame_that_looks_elsewhere_does_not() -> None:
    confirmation = Confirmation(CAMERA, 0.0, STANDING)
    time_us = 0
    for north, seen in ((0.0, True), (0.3, True), (40.0, False), (0.9, True)):
        detections = sight(at(north), 5.0, 0.0) if seen else []
        new = confirmation.update(time_us, at(north), detections)
        time_us += FRAME_US
    assert len(new) == 1


def test_faint_or_rare_sightings_are_not_reported() -> None:
    assert Flight().fly(0.0, 60.0, [(30.0, 4.0)], score=0.45) == []
    flight = Flight()
    # Strong from the front for a moment, then never again.
    assert flight.fly(15.0, 22.0, [(30.0, 4.0)]) == []
    assert flight.fly(22.0, 60.0, []) == [] and flight.confirmation.finish() == []


def test_what_looks_like_one_until_it_is_passed_is_none() -> None:
    flight = Flight()
    assert flight.fly(15.0, 33.0, [(30.0, 4.0)]) == []
    assert [one.score for one in flight.confirmation.candidates] == [pytest.approx(0.9)], "till above, and beyond"
    assert flight.fly(33.0, 60.0, []) == [] and flight.confirmation.unreported[UNSTEADY] == 1


def test_what_is_seen_aslant_counts_for_nothing_where_only_the_view_from_above_does() -> None:
    aslant, above = (30.0, 9.0), (30.0, 4.0)
    plain, strict = Flight(), Flight()
    strict.confirmation = Confirmation(CAMERA, 0.0, SURVEYING._replace(within_deg=30.0))
    assert [t.east_m for t in plain.fly(0.0, 60.0, [aslant])] == [pytest.approx(9.0, abs=0.05)]
    assert strict.fly(0.0, 60.0, [aslant]) == [] and not strict.confirmation.candidates  # 31 degrees off at 15 m
    assert [t.score for t in strict.fly(60.0, 0.0, [aslant], east=6.0)] == [pytest.approx(0.9)]
    # What a frame misses aslant is no miss.
    strict = Flight()
    strict.confirmation = Confirmation(CAMERA, 0.0, SURVEYING._replace(within_deg=30.0))
    strict.fly(0.0, 22.0, [])
    (found,) = [*strict.fly(22.0, 38.0, [above]), *strict.fly(38.0, 60.0, [])]
    assert found.score == pytest.approx(0.9)


def test_labels_are_voted_by_score() -> None:
    new = Flight().fly(0.0, 60.0, [(30.0, 4.0)], labels="disease disease weed")
    assert [t.label for t in new] == ["disease"]


def test_what_lies_outside_is_of_no_interest() -> None:
    confirmation = Confirmation(CAMERA, 0.0, STANDING, inside=lambda north, east: east > 0.0)
    new = []
    for i in range(5):
        pose = at(i / 3)
        new += confirmation.update(i * FRAME_US, pose, sight(pose, 5.0, 4.0) + sight(pose, 5.0, -4.0))
    assert [round(t.east_m) for t in new] == [4]


def test_the_end_of_the_scan_reports_what_is_in_the_picture_still() -> None:
    flight = Flight()
    assert flight.fly(20.0, 27.5, [(30.0, 2.0)]) == []
    assert len(flight.confirmation.finish()) == 1


def test_a_target_says_how_well_it_is_placed_and_how_well_its_rays_agree() -> None:
    flight = Flight()
    flight.confirmation.accuracy_m = (0.6, 1.0)
    flight.fly(0.0, 60.0, [(30.0, 4.0)])
    (target,) = flight.confirmation.targets
    assert target.residual_m < 1e-3  # rays without noise
    assert 0.6 < target.covariance_m2.horizontal_sigma_m < 0.65
    flight.confirmation.accuracy_m = (2.1, 3.5)
    (worse,) = flight.confirmation.targets
    assert 2.1 < worse.covariance_m2.horizontal_sigma_m < 2.12
    assert worse.covariance_m2.dd > 3.5**2


def test_gates_grow_with_a_worse_receiver_and_do_not_shrink_with_a_better_one() -> None:
    assert widened_m(1.8, None) == widened_m(1.8, 0.0) == widened_m(1.8, 0.6) == 1.8
    assert widened_m(1.8, 2.1) == pytest.approx(math.sqrt(1.8**2 + 4.0 * (2.1**2 - 0.6**2)))
    assert widened_m(0.0, 5.0) == pytest.approx(10.0, rel=0.01)


def test_what_a_poor_receiver_sees_twice_stays_one_target() -> None:
    """The neighbouring line sees it 3.5 m off: two targets for a receiver of 0.6 m, one for that of 2.1 m."""
    for eph_m, wanted in ((0.6, 2), (2.1, 1)):
        flight = Flight()
        flight.confirmation.accuracy_m = (eph_m, 1.0)
        flight.fly(0.0, 60.0, [(30.0, 6.0)])
        flight.fly(60.0, 0.0, [(33.5, 6.0)], east=12.0)
        assert len(flight.confirmation.targets) == wanted


def test_more_confirmations_ask_for_more_frames() -> None:
    for confirmations, wanted in ((3, 1), (6, 0)):
        confirmation = Confirmation(CAMERA, 0.0, STANDING._replace(confirmations=confirmations))
        new = []
        for i in range(5):
            new += confirmation.update(i * FRAME_US, at(i / 3), sight(at(i / 3), 5.0, 0.0))
        assert len(new) == wanted


def test_tracks_that_die_unreported_are_counted_by_what_they_lacked() -> None:
    flight = Flight()
    flight.fly(0.0, 60.0, [(30.0, 4.0)], miss_each=2)  # never three in a row
    flight.fly(0.0, 60.0, [(30.0, 30.0), (30.0, 4.0)], score=0.6)  # seen well, but never surely
    flight.fly(26.0, 30.0, [(38.0, 4.0)])  # its rays hardly cross
    flight.fly(300.0, 310.0, [])
    assert flight.confirmation.unreported["unconfirmed"] >= 1
    assert flight.confirmation.unreported["unsteady"] >= 1
    assert flight.confirmation.unreported["seen from one side only"] == 1
    assert flight.confirmation.unreported["outside the area"] == flight.confirmation.unreported["too small"] == 0
    assert flight.confirmation.targets == []
    elsewhere = Confirmation(CAMERA, 0.0, SURVEYING, inside=lambda north, east: False)
    flight.confirmation = elsewhere
    flight.fly(0.0, 60.0, [(30.0, 4.0)])
    assert elsewhere.unreported["outside the area"] == 1


def test_what_is_narrower_than_wanted_is_no_target() -> None:
    """A box of 20 pixels from 15 m up is 0.94 m on the ground (focal length 320), from wherever it is seen."""
    for least_width_m, wanted in ((0.9, 1), (1.0, 0)):
        flight = Flight()
        flight.confirmation = Confirmation(CAMERA, 0.0, SURVEYING._replace(least_width_m=least_width_m))
        flight.fly(0.0, 60.0, [(30.0, 4.0)])
        flight.fly(60.0, 0.0, [(30.0, 4.0)], east=9.0)
        assert len(flight.confirmation.targets) == wanted
        flight.fly(300.0, 310.0, [])
        assert (flight.confirmation.unreported["too small"] == 0) == (wanted == 1)
