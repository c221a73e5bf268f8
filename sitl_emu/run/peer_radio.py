"""The radio between the companions of a run: what each hands it, and what reaches whom by where the vehicles are."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

from sitl_emu.core.air import air_of
from sitl_emu.core.radio import RadioSettings
from sitl_emu.vehicles.dynamics import Vector3

Sees = Callable[[Vector3, Vector3, float], bool]
"""Whether nothing of the world is between two places (NED, m) at a time (s)."""


class PeerSocket(Protocol):
    """The radio's socket for one companion."""

    def receive(self, exactly: int | None) -> list[bytes]: ...  # noqa: D102
    def send(self, data: bytes) -> None: ...  # noqa: D102


class Station(Protocol):
    """A vehicle with a radio."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def peer(self) -> PeerSocket | None: ...  # noqa: D102
    @property
    def simulator(self) -> Any: ...  # noqa: D102


class PeerRadio:
    """Carries datagrams between companions."""

    def __init__(self, stations: Sequence[Station], settings: RadioSettings, seed: int, sees: Sees | None) -> None:
        """`sees` None: nothing is ever in between."""
        self._stations = {station.name: station for station in stations}
        self.air = air_of(settings, seed, list(self._stations))
        self._obstructed_range_m, self._sees = settings.obstructed_range_m, sees

    def carry(self, now_us: int, sent: Mapping[str, int | None]) -> dict[str, int]:
        """Read so many datagrams of each companion (None: what is there); how many each of them has to read now."""
        for name, station in self._stations.items():
            assert station.peer is not None
            for data in station.peer.receive(sent[name]):
                self.air.send(now_us, name, data, partial(self._reach_m, now_us, name))
        delivered: dict[str, int] = {}
        for name, station in self._stations.items():
            assert station.peer is not None
            arrived = self.air.due(now_us, name)
            for data in arrived:
                station.peer.send(data)
            delivered[name] = len(arrived)
        return delivered

    def _reach_m(self, now_us: int, one: str, other: str) -> float:
        """How far it is from one radio to another; inf where what is between lets nothing through."""
        a, b = self._place(one), self._place(other)
        distance_m, limit_m = math.dist(a, b), self._obstructed_range_m
        if self._sees is None or limit_m is None or distance_m <= limit_m or self._sees(a, b, now_us * 1e-6):
            return distance_m
        return math.inf

    def _place(self, name: str) -> Vector3:
        pose = self._stations[name].simulator.pose()
        return pose.north_m, pose.east_m, pose.down_m
