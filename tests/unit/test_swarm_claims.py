"""Claims as one order: what all have heard in the end is the same, in whatever order, however often."""

import random

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.missions.companion.swarm.claims import LASTS_US, Claims
from sitl_emu.missions.companion.swarm.records import Claim, Stage

KEY = (1, 0)
CLAIMS = st.lists(
    st.builds(
        Claim, st.sampled_from([(1, 0), (2, 3)]), st.integers(0, 3), st.sampled_from(Stage), st.integers(0, 4),
        st.floats(0.0, 100.0),
    ),
    max_size=12,
)  # fmt: skip


@given(CLAIMS, st.randoms(use_true_random=False))
def test_order_and_repetition_make_no_difference(said: list[Claim], dice: random.Random) -> None:
    one, other = Claims(9), Claims(9)
    again = said + dice.sample(said, len(said) // 2)
    dice.shuffle(again)
    for now_us, claim in enumerate(said):
        one.hear(now_us, 5, claim)
    for now_us, claim in enumerate(again):
        other.hear(now_us, 5, claim)
    assert one.known == other.known


def test_lower_costs_count_then_the_lower_system() -> None:
    first, second = Claims(1), Claims(2)
    first.bid(0, [KEY], 10.0)
    claim = first.join(0, [KEY])
    assert second.may_bid(claim, 9.9) and not second.may_bid(claim, 10.0) and not second.may_bid(claim, 11.0)
    second.bid(0, [KEY], 9.0)
    assert not first.may_bid(second.join(0, [KEY]), 9.0 + 0.1) and first.may_bid(second.join(0, [KEY]), 9.0)


def test_nobody_is_engaged_before_all_others_have_told_it_back() -> None:
    us, them = Claims(1), {other: Claims(other) for other in (2, 3)}
    us.bid(0, [KEY], 10.0)
    for other, theirs in them.items():
        assert not us.engage(0, [KEY], [2, 3])
        theirs.hear(0, 1, us.known[KEY])
        us.hear(0, other, theirs.known[KEY])
    assert us.engage(0, [KEY], [2, 3]) and us.known[KEY].stage == Stage.ENGAGED


def test_who_is_engaged_is_not_outbid_and_what_is_served_stays_so() -> None:
    us = Claims(1)
    us.bid(0, [KEY], 10.0)
    assert us.engage(0, [KEY], [])
    us.hear(0, 2, Claim(KEY, 0, Stage.BID, 2, 1.0))
    assert us.known[KEY].owner == 1
    us.serve(0, [KEY])
    us.hear(0, 2, Claim(KEY, 7, Stage.ENGAGED, 2, 1.0))
    us.release(0, 1)
    us.expire(LASTS_US * 2)
    assert us.known[KEY] == Claim(KEY, 0, Stage.SERVED, 1, 10.0)


def test_a_lost_owners_claim_is_free_in_the_next_round_and_it_learns_so() -> None:
    lost, us = Claims(1), Claims(2)
    lost.bid(0, [KEY], 10.0)
    us.hear(0, 1, lost.known[KEY])
    assert lost.engage(0, [KEY], [2]) is False
    us.release(0, 1)
    assert us.known[KEY] == Claim(KEY, 1, Stage.FREE, 0, 0.0) and us.may_bid(us.known[KEY], 50.0)
    us.bid(0, [KEY], 50.0)
    lost.hear(0, 2, us.known[KEY])
    assert lost.known[KEY].owner == 2 and not lost.engage(0, [KEY], [2])


def test_a_claim_that_stands_too_long_is_free() -> None:
    us = Claims(1)
    us.bid(5, [KEY], 10.0)
    us.expire(5 + LASTS_US)
    assert us.known[KEY].stage == Stage.BID
    us.expire(6 + LASTS_US)
    assert us.known[KEY].stage == Stage.FREE and us.known[KEY].round == 1


def test_what_is_claimed_of_one_sighting_is_claimed_of_all_of_its_target() -> None:
    us = Claims(1)
    us.hear(0, 2, Claim((2, 3), 0, Stage.ENGAGED, 2, 4.0))
    assert us.join(0, [(1, 0), (2, 3)]).owner == 2 and us.known[1, 0].owner == 2
