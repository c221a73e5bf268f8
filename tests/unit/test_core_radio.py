"""The radio between vehicles: latency, order, loss by pattern of the seed, range, bandwidth, outages."""

import dataclasses

from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.radio import Outage, RadioLink, RadioSettings

FAST = RadioSettings(range_m=100.0, latency_s=0.05, bandwidth_bit_s=1e9)


def arrivals(settings: RadioSettings, sends: list[tuple[int, bytes]], seed: int = 1) -> list[tuple[int, bytes]]:
    """(time, datagram) of what arrives, asked for every 10 ms."""
    link, came = RadioLink(settings, seed, "a>b"), list[tuple[int, bytes]]()
    for now_us in range(0, 5_000_000, 10_000):
        for data in (data for at, data in sends if at == now_us):
            link.send(now_us, data, 10.0)
        came += [(now_us, data) for data in link.due(now_us)]
    return came


def test_a_datagram_arrives_after_its_latency() -> None:
    assert arrivals(FAST, [(0, b"x")]) == [(50_000, b"x")]


def test_bandwidth_makes_datagrams_wait_for_each_other() -> None:
    slow = dataclasses.replace(FAST, bandwidth_bit_s=8000.0, latency_s=0.0)  # 100 bytes take 0.1 s
    assert [at for at, _ in arrivals(slow, [(0, bytes(100))] * 3)] == [100_000, 200_000, 300_000]


def test_a_full_queue_drops_what_comes_last() -> None:
    slow = dataclasses.replace(FAST, bandwidth_bit_s=8000.0, latency_s=0.0, queue_bytes=250)
    came = arrivals(slow, [(0, bytes([n]) * 100) for n in range(10)])
    assert [data[0] for _, data in came] == [0, 1, 2]


def test_beyond_its_range_nothing_is_heard() -> None:
    link = RadioLink(FAST, 1, "a>b")
    link.send(0, b"near", 100.0)
    link.send(0, b"far", 100.1)
    assert link.due(1_000_000) == [b"near"] and (link.sent, link.lost) == (2, 1)


def test_an_outage_cuts_the_link_and_no_longer() -> None:
    cut = dataclasses.replace(FAST, outages=(Outage(1.0, 2.0),))
    sends = [(0, b"before"), (1_000_000, b"in"), (1_990_000, b"in"), (2_000_000, b"after")]
    assert [data for _, data in arrivals(cut, sends)] == [b"before", b"after"]


def test_loss_is_what_was_asked_for_and_the_seed_decides_which() -> None:
    lossy = dataclasses.replace(FAST, loss=0.3)
    sends = [(10_000 * n, bytes([n % 256])) for n in range(400)]
    one, again, other = (arrivals(lossy, sends, seed) for seed in (1, 1, 2))
    assert one == again != other
    assert 240 <= len(one) <= 320


@given(st.lists(st.integers(1, 300), max_size=30), st.floats(0.0, 0.9), st.floats(1e4, 1e6))
def test_datagrams_keep_their_order_and_are_never_doubled(sizes: list[int], loss: float, bandwidth: float) -> None:
    link = RadioLink(RadioSettings(loss=loss, bandwidth_bit_s=bandwidth, queue_bytes=1 << 20), 1, "a>b")
    for number, size in enumerate(sizes):
        link.send(number * 1000, bytes([number]) * size, 0.0)
    came = [data[0] for data in link.due(10**9)]
    assert came == sorted(set(came)) and len(came) == link.sent - link.lost
