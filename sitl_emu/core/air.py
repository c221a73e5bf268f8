"""The air between all radios of a run: a link for each pair of them, or one air that all share.

In `SharedAir` a datagram is broadcast once and reaches all in range, each of whom may lose it by chance. One speaks at
a time: who wants to waits until what others sent before is over, so that the bandwidth is that of all together. That is
carrier sensing as it should be: no collisions, none hidden from another, no time lost between datagrams; a real channel
carries less. Range is a hard limit, ours, as is the shorter one through obstacles (`RadioSettings`): no fading.
"""

import random
from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

from sitl_emu.core.radio import RadioLink, RadioSettings, is_outage


class Air(Protocol):
    """What carries datagrams from each radio to all others."""

    def send(self, now_us: int, sender: str, data: bytes, distance_m: Callable[[str], float]) -> None:
        """A radio sends; `distance_m` of each other by name, inf where nothing gets through."""
        ...

    def due(self, now_us: int, receiver: str) -> list[bytes]:
        """What has arrived at a radio by now."""
        ...

    def cut(self, name: str, cut: bool) -> None:
        """A radio fails, or works again."""
        ...

    @property
    def counts(self) -> dict[str, tuple[int, int]]:
        """Datagrams (sent, lost) of each direction, as "uas>ugv"."""
        ...


def air_of(settings: RadioSettings, seed: int, names: Sequence[str]) -> Air:
    """The air between the radios of these names."""
    return SharedAir(settings, seed, names) if settings.shared else PairedAir(settings, seed, names)


class PairedAir:
    """A link of its own for each pair, each way."""

    def __init__(self, settings: RadioSettings, seed: int, names: Sequence[str]) -> None:
        self._links = {
            one: {other: RadioLink(settings, seed, f"{one}>{other}") for other in names if other != one}
            for one in names
        }

    def send(self, now_us: int, sender: str, data: bytes, distance_m: Callable[[str], float]) -> None:
        """See Air."""
        for other, link in self._links[sender].items():
            link.send(now_us, data, distance_m(other))

    def due(self, now_us: int, receiver: str) -> list[bytes]:
        """See Air: in the order of who sent it."""
        towards = [links[receiver] for one, links in self._links.items() if one != receiver]
        return [data for link in towards for data in link.due(now_us)]

    def cut(self, name: str, cut: bool) -> None:
        """See Air."""
        for one, links in self._links.items():
            for other, link in links.items():
                if name in (one, other):
                    link.cut = cut

    @property
    def counts(self) -> dict[str, tuple[int, int]]:
        """See Air."""
        return {
            f"{one}>{other}": (link.sent, link.lost)
            for one, links in self._links.items()
            for other, link in links.items()
        }


class SharedAir:
    """One channel for all."""

    def __init__(self, settings: RadioSettings, seed: int, names: Sequence[str]) -> None:
        self._settings = settings
        self._chances = {
            one: {other: random.Random(f"{seed}/radio/{one}>{other}") for other in names if other != one}
            for one in names
        }
        self.counts = {f"{one}>{other}": (0, 0) for one, others in self._chances.items() for other in others}
        """See Air."""
        self._free_us = 0
        self._waiting = {name: deque[tuple[int, int]]() for name in names}
        """Of each sender: when what it has sent is over, and its bytes."""
        self._in_flight = {name: deque[tuple[int, bytes]]() for name in names}
        self._out = set[str]()

    def send(self, now_us: int, sender: str, data: bytes, distance_m: Callable[[str], float]) -> None:
        """See Air. A radio that is out takes no time on the air."""
        settings = self._settings
        start_us = max(now_us, self._free_us)
        carried = sender not in self._out and self._has_room(now_us, sender, len(data))
        if carried:
            self._free_us = start_us + round(len(data) * 8e6 / settings.bandwidth_bit_s)
            self._waiting[sender].append((self._free_us, len(data)))
        carried = carried and not is_outage(settings.outages, start_us)
        for other, dice in self._chances[sender].items():
            lucky = dice.random() >= settings.loss
            heard = carried and lucky and other not in self._out and distance_m(other) <= settings.range_m
            if heard:
                self._in_flight[other].append((self._free_us + round(settings.latency_s * 1e6), data))
            sent, lost = self.counts[f"{sender}>{other}"]
            self.counts[f"{sender}>{other}"] = sent + 1, lost + (not heard)

    def due(self, now_us: int, receiver: str) -> list[bytes]:
        """See Air: in the order in which they were sent."""
        arrived, in_flight = list[bytes](), self._in_flight[receiver]
        while in_flight and in_flight[0][0] <= now_us:
            arrived.append(in_flight.popleft()[1])
        return arrived

    def cut(self, name: str, cut: bool) -> None:
        """See Air."""
        (self._out.add if cut else self._out.discard)(name)

    def _has_room(self, now_us: int, sender: str, size: int) -> bool:
        """Whether a sender's queue takes so many bytes more."""
        waiting = self._waiting[sender]
        while waiting and waiting[0][0] <= now_us:
            waiting.popleft()
        return sum(waits for _, waits in waiting) + size <= self._settings.queue_bytes
