"""A swarm on the wire: sealed broadcasts over a bad radio, with somebody who replays, spoils and forges them."""

import random
from typing import Any

from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.missions.companion.coverage import Footprint, lawnmower, polygon
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.swarm.key import SwarmKey, key_of
from sitl_emu.missions.companion.swarm.records import Column, Doing, Sighting, Stage, State
from sitl_emu.missions.companion.swarm.seal import Seal
from sitl_emu.missions.companion.swarm.swarm import Swarm
from tests.unit.companion_px4 import on_the_wire
from tests.unit.lossy_air import Air

HOME = (47.397742, 8.545594)
UNIX_US = 1_781_514_000_000_000
KEY = key_of(Options({"swarm_seed": 3}))
AREA = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
LINES = lawnmower(polygon(AREA), Footprint(20.0, 20.0))
MEMBERS = [1, 2, 3]


def state_of(system: int, doing: Doing = Doing.SCANNING) -> State:
    return State(doing, *from_metres(40.0 * system, 0.0, *HOME), 500.0, 0.0, 0.0, 0.0)


class Sky:
    """Three aircraft that stand in the air, and an attacker."""

    def __init__(self, loss: float, attacked: bool) -> None:
        self.swarms = {system: Swarm(0, KEY, system, MEMBERS, HOME, LINES) for system in MEMBERS}
        self._air, self._attacked, self._dice = Air[Any](loss, 4), attacked, random.Random(9)
        self._stolen = list[Any]()
        self.attacks = self.now_us = 0

    def step(self) -> None:
        self.now_us += 50_000
        for receiver, _, _, msg in self._air.due(self.now_us):
            self.swarms[receiver].on_message(self.now_us, UNIX_US + self.now_us, msg)
        for system, swarm in self.swarms.items():
            for msg in swarm.on_time(self.now_us, UNIX_US + self.now_us, state_of(system), parked=True):
                sent = on_the_wire(msg, system, 191)
                self._stolen.append(sent)
                self._air.send(self.now_us, system, [other for other in MEMBERS if other != system], sent)
        if self._attacked and self._stolen:
            self.swarms[1].on_message(self.now_us, UNIX_US + self.now_us, self._spoilt())
            self.attacks += 1

    def _spoilt(self) -> Any:
        taken = on_the_wire(self._dice.choice(self._stolen), 2, 191)
        kind = self._dice.randrange(3)
        if kind == 0:
            return on_the_wire(Seal(SwarmKey(bytes(32), 1), frozenset(MEMBERS)).seal(UNIX_US, 2, b"\x03" * 10), 2, 191)
        payload = list(taken.payload)
        if kind == 1:
            payload[self._dice.randrange(taken.payload_length)] ^= 1
        taken.payload = payload
        return on_the_wire(taken, 1, 191) if kind == 2 else on_the_wire(taken, 2, 191)


def common(sky: Sky) -> list[Any]:
    """What all should agree on."""
    views = []
    for swarm in sky.swarms.values():
        sharing = swarm.sharing
        claims = [sharing.claim(sky.now_us, target) for target in sharing.targets()]
        views.append(([target.keys for target in sharing.targets()], claims, sharing._scanned))
    return views


def work_together(sky: Sky) -> None:
    for system, swarm in sky.swarms.items():
        place = from_metres(50.0, 50.0 + 0.3 * system, *HOME)
        swarm.sharing.see(0, Sighting((0, 0), 0, 4, 0.9, *place, 490.0, 0.6, 0.6, 0.1))
        swarm.sharing.scanned(system)
    owners = set[int]()
    for _ in range(600):
        sky.step()
        for system, swarm in sky.swarms.items():
            target = swarm.sharing.want(sky.now_us, {one.key: 30.0 / system for one in swarm.sharing.targets()})
            owners |= {system} if target is not None else set()
        if owners:
            break
    assert owners == {3}, "the lowest cost"
    sky.swarms[3].sharing.serve(sky.now_us)
    sky.swarms[3].airspace.ask()
    for _ in range(200):
        sky.step()


def test_all_come_to_know_the_same_over_a_bad_radio_and_under_attack() -> None:
    sky = Sky(loss=0.3, attacked=True)
    work_together(sky)
    first, *others = common(sky)
    assert all(other == first for other in others)
    keys, claims, scanned = first
    assert keys == [((1, 0), (2, 0), (3, 0))] and scanned == 0b1110
    assert [(claim.stage, claim.owner) for claim in claims] == [(Stage.SERVED, 3)]
    assert sky.swarms[3].airspace.column == Column.TAKEN
    attacked = sky.swarms[1]
    others_refused = sum(sky.swarms[system].seal.refused.total() for system in (2, 3))
    assert attacked.seal.refused.total() >= sky.attacks > 200
    assert attacked.counts["sealed taken"] == attacked.seal.taken > 50 and others_refused > 0, "doubles are replays"


def test_the_same_seeds_say_the_same_bytes() -> None:
    said = []
    for _ in range(2):
        sky = Sky(loss=0.3, attacked=False)
        work_together(sky)
        said.append([bytes(msg.payload) for msg in sky._stolen])
    assert said[0] == said[1] and len(set(said[0])) == len(said[0])


def test_nothing_is_said_before_the_time_is_known() -> None:
    swarm = Swarm(0, KEY, 1, MEMBERS, HOME)
    assert swarm.on_time(1_000_000, 0, state_of(1), parked=True) == []
    assert len(swarm.on_time(1_100_000, UNIX_US, state_of(1), parked=True)) == 1


def test_what_a_member_seals_without_sense_is_counted() -> None:
    swarm = Swarm(0, KEY, 1, MEMBERS, HOME)
    odd = Seal(KEY, frozenset(MEMBERS)).seal(UNIX_US, 2, b"\x09")
    swarm.on_message(0, UNIX_US, on_the_wire(odd, 2, 191))
    assert swarm.counts == {"sealed taken": 1, "sealed refused: content without sense": 1}
    assert swarm.sharing.states == {}
