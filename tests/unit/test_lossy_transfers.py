"""Both ends of the services, ours and the ground side's, over a link that loses 5, 10 or 30 % each way."""

import random
from typing import Any

import pytest

from sitl_emu.gcs.mission import FENCE, MISSION, RALLY, MissionClear, MissionDownload, MissionItem, MissionUpload
from sitl_emu.gcs.parameter import ParameterList, ParameterRead, ParameterSet
from tests.unit.mavlink_peer import TICK_US, Peer

LOSSES = (0.05, 0.1, 0.3)
SEEDS = range(2)
LIMIT_S = 240.0
X, Y = 473977418, 85455939

MISSION_ITEMS = [MissionItem(6, 16, param2=2.5, x=X + 300 * seq, y=Y, z=10.0) for seq in range(60)]
FENCE_ITEMS = [
    MissionItem(5, 5001, param1=4.0, x=X + dx, y=Y + dy, autocontinue=0) for dx, dy in ((0, 0), (0, 9), (9, 9), (9, 0))
]
RALLY_ITEMS = [MissionItem(6, 5100, x=X, y=Y + 900 * seq, z=20.0) for seq in range(3)]
PLANS = {MISSION: MISSION_ITEMS, FENCE: FENCE_ITEMS, RALLY: RALLY_ITEMS}

lossy = pytest.mark.parametrize("loss", LOSSES)
seeded = pytest.mark.parametrize("seed", SEEDS)
of_every_plan = pytest.mark.parametrize("kind", PLANS)


def talk(peer: Peer, service: Any, loss: float, seed: int) -> float:
    """Let an autopilot and a ground side service talk until the latter is done; the seconds that it took."""
    chance = random.Random(seed)

    def arriving(messages: list[Any]) -> list[Any]:
        return [message for message in messages if chance.random() >= loss]

    def heard(messages: list[Any]) -> list[Any]:
        return [reply for message in arriving(messages) for reply in service.on_message(peer.now_us, message)]

    began_us = peer.now_us
    while not service.done:
        to_autopilot = service.on_time(peer.now_us) + heard(peer.run(TICK_US * 1e-6))
        while to_autopilot:
            to_autopilot = heard([answer for message in arriving(to_autopilot) for answer in peer.send(message)])
        assert peer.now_us - began_us < LIMIT_S * 1e6, "not done in time"
    return (peer.now_us - began_us) * 1e-6


@lossy
@seeded
def test_all_parameters_arrive(loss: float, seed: int) -> None:
    peer = Peer()
    loading = ParameterList(1)
    talk(peer, loading, loss, seed)
    assert loading.complete
    assert {name: each.value for name, each in loading.parameters.items()} == {
        name: peer.parameters[name] for name in peer.parameters
    }


@lossy
@seeded
def test_a_parameter_is_read_and_set(loss: float, seed: int) -> None:
    peer = Peer()
    setting = ParameterSet(1, "MPC_XY_CRUISE", 6.5)
    talk(peer, setting, loss, seed)
    assert setting.accepted
    reading = ParameterRead(1, "MPC_XY_CRUISE")
    talk(peer, reading, loss, seed + 100)
    assert reading.parameter is not None
    assert reading.parameter.value == 6.5


@lossy
@seeded
@of_every_plan
def test_a_plan_goes_up_and_comes_down(loss: float, seed: int, kind: int) -> None:
    peer, items = Peer(), PLANS[kind]
    upload = MissionUpload(1, items, kind)
    talk(peer, upload, loss, seed)
    assert upload.outcome is not None
    assert upload.outcome.accepted, upload.outcome
    assert len(peer.dataman.plans[kind].items) == len(items)
    download = MissionDownload(1, kind)
    talk(peer, download, loss, seed + 100)
    assert download.items == items
    clear = MissionClear(1, kind)
    talk(peer, clear, loss, seed + 200)
    assert peer.dataman.plans[kind].items == ()


@lossy
@seeded
def test_a_refused_plan_ends_with_px4s_reason_and_leaves_the_old_one(loss: float, seed: int) -> None:
    peer = Peer()
    talk(peer, MissionUpload(1, RALLY_ITEMS, RALLY), 0.0, seed)
    upload = MissionUpload(1, [*RALLY_ITEMS, MissionItem(6, 5100, param1=1.0, x=X, y=Y)], RALLY)
    talk(peer, upload, loss, seed)
    assert upload.outcome is not None
    assert not upload.outcome.accepted
    assert upload.outcome.result in (6, 1, None), upload.outcome
    assert len(peer.dataman.rally.items) == len(RALLY_ITEMS)


def test_a_thousand_items_go_up_and_down_over_a_bad_link() -> None:
    peer = Peer()
    items = [MissionItem(6, 16, x=X + seq, y=Y, z=10.0) for seq in range(1000)]
    upload = MissionUpload(1, items)
    talk(peer, upload, 0.1, 1)
    assert upload.outcome is not None
    assert upload.outcome.accepted
    download = MissionDownload(1)
    talk(peer, download, 0.1, 2)
    assert download.items == items
