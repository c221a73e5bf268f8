"""What aircraft of a swarm tell each other: the same after every journey, and no nonsense is understood."""

import math

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.companion.swarm.records import (
    Claim,
    Column,
    Covered,
    Doing,
    Record,
    Sighting,
    Stage,
    State,
    as_sent,
    filled,
    packed,
    parsed,
)
from sitl_emu.missions.companion.swarm.seal import CONTENT_BYTES

BYTE, WORD = st.integers(0, 255), st.integers(0, 65535)
KEYS = st.tuples(BYTE, WORD)
PLACE = (st.floats(-90.0, 90.0), st.floats(-180.0, 180.0), st.floats(-400.0, 9000.0))
SPEED = st.floats(-60.0, 60.0)
SIGMA = st.floats(0.01, 1000.0)
STATES = st.builds(State, st.sampled_from(Doing), *PLACE, SPEED, SPEED, SPEED, st.sampled_from(Column), WORD, WORD)
SIGHTINGS = st.builds(Sighting, KEYS, WORD, BYTE, st.floats(0.0, 1.0), *PLACE, SIGMA, SIGMA, st.floats(-0.99, 0.99))
CLAIMS = st.builds(Claim, KEYS, WORD, st.sampled_from(Stage), BYTE, st.floats(0.0, 6553.0))
COVERED = st.builds(Covered, WORD, st.integers(0, 2**64 - 1))
RECORDS: st.SearchStrategy[Record] = st.one_of(STATES, SIGHTINGS, CLAIMS, COVERED)


@given(st.lists(RECORDS, max_size=4))
def test_what_arrives_is_what_was_sent(records: list[Record]) -> None:
    sent = [as_sent(record) for record in records]
    assert parsed(b"".join(map(packed, records))) == sent
    assert [as_sent(record) for record in sent] == sent, "a second journey changes nothing more"


@given(SIGHTINGS)
def test_the_wire_costs_a_centimetre_and_a_thousandth_of_a_sigma(sighting: Sighting) -> None:
    came = as_sent(sighting)
    assert abs(came.lat_deg - sighting.lat_deg) < 1e-7 and abs(came.alt_amsl_m - sighting.alt_amsl_m) <= 0.0051
    assert math.isclose(came.sigma_north_m, sighting.sigma_north_m, rel_tol=1e-3)
    assert abs(came.correlation - sighting.correlation) < 0.005 and abs(came.correlation) < 1.0


@given(st.binary(max_size=CONTENT_BYTES))
def test_whatever_bytes_come_they_are_understood_wholly_or_refused(content: bytes) -> None:
    records = parsed(content)
    if records is not None:
        for record in records:
            if isinstance(record, Sighting):
                assert 0.0 < record.sigma_north_m < math.inf and 0.0 < record.sigma_east_m < math.inf
            if isinstance(record, Sighting | State):
                assert abs(record.lat_deg) <= 90.0 and abs(record.lon_deg) <= 180.0


@given(RECORDS, st.integers(1, 30))
def test_a_record_that_is_cut_off_is_refused(record: Record, less: int) -> None:
    whole = packed(record)
    assert parsed(whole[: max(1, len(whole) - less)]) is None


@given(st.lists(RECORDS, max_size=30))
def test_a_broadcast_is_filled_and_never_too_long(records: list[Record]) -> None:
    content, taken = filled(records)
    assert len(content) <= CONTENT_BYTES and parsed(content) == [as_sent(record) for record in taken]
    left = [packed(record) for record in records if record not in taken]
    assert all(len(content) + len(one) > CONTENT_BYTES or one in map(packed, taken) for one in left[:1])


def test_a_state_with_three_claims_and_a_sighting_fit_one_broadcast() -> None:
    state = State(Doing.SCANNING, 47.4, 8.5, 500.0, 1.0, 2.0, 0.0)
    claims = [Claim((1, n), 0, Stage.BID, 1, 10.0) for n in range(3)]
    sighting = Sighting((1, 1), 0, 2, 0.9, 47.4, 8.5, 490.0, 0.6, 0.5, 0.1)
    assert len(filled([state, *claims, sighting])[1]) == 5


def test_a_kind_that_is_not_known_makes_the_whole_content_none() -> None:
    assert parsed(packed(Covered(0, 5)) + b"\x09") is None
