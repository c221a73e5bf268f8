"""One air for all radios of a run, beside a link for each pair: who hears what, when, by the seed."""

import dataclasses
import math
import random

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.air import Air, PairedAir, SharedAir, air_of
from sitl_emu.core.radio import Outage, RadioLink, RadioSettings

NAMES = ["a", "b", "c", "d"]
PLACES = {"a": 0.0, "b": 50.0, "c": 90.0, "d": 150.0}
SLOW = RadioSettings(range_m=100.0, latency_s=0.0, bandwidth_bit_s=8000.0, shared=True)
"""100 bytes take 0.1 s."""
FAST = dataclasses.replace(SLOW, bandwidth_bit_s=1e9, latency_s=0.05)


def send(air: Air, now_us: int, sender: str, data: bytes) -> None:
    air.send(now_us, sender, data, lambda other: abs(PLACES[sender] - PLACES[other]))


def heard(air: Air, now_us: int) -> dict[str, list[bytes]]:
    return {name: data for name in NAMES if (data := air.due(now_us, name))}


def test_what_is_broadcast_once_reaches_all_in_range_after_the_latency() -> None:
    air = SharedAir(FAST, 1, NAMES)
    send(air, 0, "a", b"hello")
    assert heard(air, 49_999) == {}
    assert heard(air, 50_001) == {"b": [b"hello"], "c": [b"hello"]}
    assert air.counts["a>b"] == (1, 0) and air.counts["a>d"] == (1, 1) and air.counts["b>a"] == (0, 0)


def test_the_bandwidth_is_that_of_all_together() -> None:
    shared, paired = SharedAir(SLOW, 1, NAMES), PairedAir(SLOW, 1, NAMES)
    for air in (shared, paired):
        for name in ("a", "b", "c"):
            send(air, 0, name, name.encode() * 100)
    assert heard(paired, 100_000).keys() == {"a", "b", "c", "d"}, "each pair has a link of its own"
    assert heard(shared, 100_000) == {"b": [b"a" * 100], "c": [b"a" * 100]}
    assert heard(shared, 200_000) == {"a": [b"b" * 100], "c": [b"b" * 100], "d": [b"b" * 100]}
    assert heard(shared, 300_000) == {"a": [b"c" * 100], "b": [b"c" * 100], "d": [b"c" * 100]}


def test_a_full_queue_drops_what_its_own_sender_adds_and_not_what_others_say() -> None:
    air = SharedAir(dataclasses.replace(SLOW, queue_bytes=250), 1, NAMES)
    for number in range(4):
        send(air, 0, "a", bytes([number]) * 100)
    send(air, 0, "b", b"b" * 100)
    assert [data[:1] for data in air.due(10**7, "c")] == [b"\0", b"\1", b"b"]
    assert air.counts["a>c"] == (4, 2)
    send(air, 10**7, "a", b"again")
    assert air.due(2 * 10**7, "c") == [b"again"]


def test_each_receiver_loses_for_itself_as_much_as_was_asked_for_and_the_seed_decides_what() -> None:
    lossy = dataclasses.replace(FAST, loss=0.3)
    runs = []
    for seed in (1, 1, 2):
        air = SharedAir(lossy, seed, NAMES)
        for number in range(1000):
            send(air, 1000 * number, "a", number.to_bytes(2))
        runs.append(heard(air, 10**7))
    one, again, other = runs
    assert one == again != other and one["b"] != one["c"]
    assert all(650 <= len(one[name]) <= 750 for name in ("b", "c"))


def test_a_radio_that_is_out_neither_hears_nor_takes_time_on_the_air() -> None:
    air = SharedAir(SLOW, 1, NAMES)
    air.cut("b", True)
    send(air, 0, "b", b"b" * 100)
    send(air, 0, "a", b"a" * 100)
    assert heard(air, 100_000) == {"c": [b"a" * 100]}
    air.cut("b", False)
    send(air, 200_000, "a", b"x")
    assert air.due(300_000, "b") == [b"x"] and air.counts["b>a"] == (1, 1)


def test_an_outage_is_one_for_all_and_what_nothing_gets_through_to_hears_nothing() -> None:
    air = SharedAir(dataclasses.replace(FAST, outages=(Outage(1.0, 2.0),)), 1, NAMES)
    send(air, 1_500_000, "a", b"in")
    air.send(2_000_000, "a", b"after", lambda other: math.inf if other == "b" else 10.0)
    assert heard(air, 3_000_000) == {"c": [b"after"], "d": [b"after"]}


@given(
    st.lists(st.tuples(st.sampled_from(NAMES), st.integers(1, 300), st.integers(0, 50_000)), max_size=30),
    st.floats(0.0, 0.9),
    st.floats(1e4, 1e6),
)
def test_all_hear_in_one_order_and_nothing_twice(
    sends: list[tuple[str, int, int]], loss: float, bandwidth: float
) -> None:
    settings = RadioSettings(loss=loss, bandwidth_bit_s=bandwidth, queue_bytes=1 << 20, shared=True)
    air, now_us, size_bits = SharedAir(settings, 1, NAMES), 0, 0
    for number, (sender, size, wait_us) in enumerate(sends):
        now_us += wait_us
        size_bits += size * 8
        send(air, now_us, sender, bytes([number]) * size)
    came = heard(air, 10**10)
    for data in came.values():
        order = [one[0] for one in data]
        assert order == sorted(set(order))
    assert sum(map(len, came.values())) == sum(sent - lost for sent, lost in air.counts.values())
    send(air, now_us, "a", b"last")
    assert not any(b"last" in data for data in heard(air, int(size_bits / bandwidth * 1e6)).values())


def test_without_a_word_of_it_each_pair_has_its_link_as_ever() -> None:
    settings, dice = RadioSettings(loss=0.2, range_m=100.0), random.Random(5)
    air = air_of(settings, 7, NAMES)
    links = {(a, b): RadioLink(settings, 7, f"{a}>{b}") for a in NAMES for b in NAMES if a != b}
    for now_us in range(0, 5_000_000, 20_000):
        for sender in dice.choices(NAMES, k=3):
            data = dice.randbytes(dice.randrange(1, 280))
            send(air, now_us, sender, data)
            for other in NAMES:
                if other != sender:
                    links[sender, other].send(now_us, data, abs(PLACES[sender] - PLACES[other]))
        for name in NAMES:
            assert air.due(now_us, name) == [d for one in NAMES if one != name for d in links[one, name].due(now_us)]
    assert air.counts == {f"{a}>{b}": (link.sent, link.lost) for (a, b), link in links.items()}
    assert list(air.counts) == [f"{a}>{b}" for a, b in links]
