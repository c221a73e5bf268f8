"""A radio link between two vehicles: range, latency, loss and bandwidth, as a state machine on simulated time.

One `RadioLink` is one direction. A datagram waits until those before it are on the air (bandwidth), is lost by chance,
beyond the range or during an outage, and otherwise arrives `latency_s` after its last bit was sent: so datagrams keep
their order. Time on the air is spent on lost datagrams too, as a radio does.
It models no fading, no interference between links and no retransmission below MAVLink: within its range a link loses
evenly, beyond it everything.
"""

import random
from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Outage:
    """The link is cut from `start_s` to `end_s` of simulated time."""

    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class RadioSettings:
    """What a link is capable of; `loss` is the share of datagrams lost each way, 0..1."""

    range_m: float = 1000.0
    latency_s: float = 0.02
    loss: float = 0.0
    bandwidth_bit_s: float = 250_000.0
    queue_bytes: int = 16_384
    """What waits for its turn on the air beyond this is dropped."""
    outages: tuple[Outage, ...] = ()
    shared: bool = False
    """Whether all have one air, and its bandwidth together (`air.py`), rather than a link each pair."""
    obstructed_range_m: float | None = None
    """How far it reaches where ground or something solid is in between; None: as far as in the open."""


class RadioLink:
    """One direction between two radios."""

    def __init__(self, settings: RadioSettings, seed: int, name: str) -> None:
        """`name` (such as "uas>ugv") derives the generator of this direction from the run's seed."""
        self._settings = settings
        self._random = random.Random(f"{seed}/radio/{name}")
        self._free_us = 0
        self._in_flight: deque[tuple[int, bytes]] = deque()
        self.sent = 0
        self.lost = 0
        self.cut = False
        """An outage that nobody announced: a fault."""

    def send(self, now_us: int, data: bytes, distance_m: float) -> None:
        """Hand a datagram to the radio, over a distance between the antennas."""
        settings = self._settings
        self.sent += 1
        chance = self._random.random()
        bits_per_us = settings.bandwidth_bit_s / 1e6
        start_us = max(now_us, self._free_us)
        if (start_us - now_us) * bits_per_us > settings.queue_bytes * 8:
            self.lost += 1
            return
        self._free_us = start_us + round(len(data) * 8 / bits_per_us)
        if chance < settings.loss or distance_m > settings.range_m or self.is_cut(start_us):
            self.lost += 1
            return
        self._in_flight.append((self._free_us + round(settings.latency_s * 1e6), data))

    def due(self, now_us: int) -> list[bytes]:
        """What has arrived by now, in order."""
        arrived, in_flight = list[bytes](), self._in_flight
        while in_flight and in_flight[0][0] <= now_us:
            arrived.append(in_flight.popleft()[1])
        return arrived

    def is_cut(self, now_us: int) -> bool:
        """Whether an outage is on."""
        return self.cut or is_outage(self._settings.outages, now_us)


def is_outage(outages: tuple[Outage, ...], now_us: int) -> bool:
    """Whether one of them is on."""
    return any(outage.start_s * 1e6 <= now_us < outage.end_s * 1e6 for outage in outages)
