"""Sightings of several aircraft merged by covariance, whatever came first."""

import math
import random

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.gcs.geodesy import from_metres, to_metres
from sitl_emu.missions.companion.swarm.records import Key, Sighting
from sitl_emu.missions.companion.swarm.targets import merged

HOME = (47.397742, 8.545594)
METRES = st.floats(-200.0, 200.0)
SIGHTINGS = st.lists(
    st.tuples(
        st.tuples(st.integers(1, 4), st.integers(0, 5)), METRES, METRES, st.floats(0.1, 4.0), st.floats(0.1, 4.0)
    ),
    unique_by=lambda one: one[0],
    max_size=16,
)


def sighting(
    key: Key, north: float, east: float, sigma_n: float = 0.6, sigma_e: float = 0.6, **more: float
) -> Sighting:
    label, confidence = int(more.get("label", 1)), more.get("confidence", 0.9)
    place = from_metres(north, east, *HOME)
    return Sighting(key, 0, label, confidence, *place, 490.0, sigma_n, sigma_e, more.get("correlation", 0.0))


@given(SIGHTINGS, st.randoms(use_true_random=False))
def test_who_has_heard_the_same_sees_the_same(
    given_: list[tuple[Key, float, float, float, float]], dice: random.Random
) -> None:
    seen = [sighting(*one) for one in given_]
    targets = merged(seen)
    dice.shuffle(seen)
    assert merged(seen) == targets
    assert sorted(key for target in targets for key in target.keys) == sorted(one.key for one in seen)
    for target in targets:
        assert len({system for system, _ in target.keys}) == len(target.keys), "an aircraft's own are told apart"
        assert target.nn > 0.0 < target.ee and target.nn * target.ee > target.ne**2


def test_two_of_one_place_are_one_target_between_them_and_surer_than_each() -> None:
    (target,) = merged([sighting((1, 0), 10.0, 0.0, 1.0, 1.0), sighting((2, 4), 12.0, 0.0, 0.5, 0.5)])
    north, east = to_metres(target.lat_deg, target.lon_deg, *HOME)
    assert math.isclose(north, 11.6, abs_tol=1e-3) and math.isclose(east, 0.0, abs_tol=1e-3)
    assert math.isclose(target.nn, 1.0 / (1.0 + 4.0), rel_tol=1e-9) and target.key == (1, 0)


def test_what_is_known_well_across_and_badly_along_is_weighed_so() -> None:
    north_bad, east_bad = sighting((1, 0), 3.0, 0.0, 5.0, 0.1), sighting((2, 0), 0.0, 3.0, 0.1, 5.0)
    (target,) = merged([north_bad, east_bad])
    north, east = to_metres(target.lat_deg, target.lon_deg, *HOME)
    assert abs(north) < 0.01 and abs(east) < 0.01 and target.sigma_m < 0.2


def test_places_farther_apart_than_their_covariances_say_are_two() -> None:
    near, far = sighting((1, 0), 0.0, 0.0, 0.3, 0.3), sighting((2, 0), 4.0, 0.0, 0.3, 0.3)
    assert len(merged([near, far])) == 2
    vague = sighting((2, 0), 4.0, 0.0, 2.0, 2.0)
    assert len(merged([near, vague])) == 1
    assert len(merged([near, sighting((2, 0), 16.0, 0.0, 20.0, 20.0)])) == 2


def test_labels_are_voted_for() -> None:
    votes = [(1, 2, 0.6), (2, 5, 0.5), (3, 5, 0.4)]
    (target,) = merged([sighting((system, 0), 0.0, 0.0, label=label, confidence=c) for system, label, c in votes])
    assert (target.label, target.confidence) == (5, 0.5)


def test_of_1000_pairs_of_sightings_of_one_place_none_stays_two() -> None:
    dice, two = random.Random(3), 0
    for _ in range(1000):
        pair = [sighting((system, 0), dice.gauss(0.0, 0.6), dice.gauss(0.0, 0.6)) for system in (1, 2)]
        two += len(merged(pair)) == 2
    assert two <= 1
