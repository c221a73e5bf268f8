"""Hostile bytes: nothing that comes on a link crashes an autopilot, makes it tell or do nonsense, or fill memory.

20 000 datagrams a link, on simulated time and without sockets; tools/fuzz.py does the same with millions.
"""

import copy
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.autopilot.mavlink.signature import SigningKey
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.topics import topic_names
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from tests import hostile
from tests.unit.mavlink_peer import GCS, ONBOARD, PAYLOAD, Peer, command_long, only

DATAGRAMS_PER_LINK = {"sihsim_hex": 20_000, "sihsim_rover_ackermann": 5_000}
PER_TICK = 40
TICKS_PER_VALUE = 10
GROWTH_LIMIT = 3_000
"""Objects by which a vehicle may differ after as much traffic again: a plan or a file that somebody sent."""


def assault(victim: hostile.Victim, seed: int, datagrams: int, seeds: list[bytes]) -> None:
    """Nonsense and spoiled traffic on all links in turn, a tick in between now and then."""
    chance = random.Random(seed)
    nonsense = hostile.Nonsense(chance, victim.heard, victim.autopilot.parameters.announced)
    for number in range(datagrams):
        data = nonsense.frame() if chance.random() < 0.5 else hostile.mutated(chance, seeds)
        victim.hear(number % hostile.LINKS, data)
        if number % PER_TICK == 0:
            victim.keep_open()
            victim.tick()
            victim.check_topics()


@pytest.mark.slow
@pytest.mark.parametrize("model", DATAGRAMS_PER_LINK)
def test_a_flying_vehicle_bears_nonsense_and_spoiled_traffic(model: str, tmp_path: Path) -> None:
    storage.prepare(tmp_path)
    victim = hostile.Victim(model, tmp_path)
    seeds = victim.record()
    half = DATAGRAMS_PER_LINK[model] * hostile.LINKS // 2
    assault(victim, 1, half, seeds)
    before = hostile.objects()
    assault(victim, 2, half, seeds)
    assert hostile.objects() - before < GROWTH_LIMIT
    victim.run(1.0)
    assert victim.answers()


@pytest.mark.slow
@pytest.mark.parametrize("model", DATAGRAMS_PER_LINK)
def test_no_value_of_one_parameter_ends_a_flight(model: str) -> None:
    victim = hostile.Victim(model)
    victim.record()
    parameters = victim.autopilot.parameters
    for name in parameters.announced:
        before = parameters[name]
        for value in (0, -1, 1e9 if parameters.is_float(name) else (1 << 31) - 1):
            parameters.set(name, value)
            for _ in range(TICKS_PER_VALUE):
                victim.tick()
            victim.check_topics()
        parameters.set(name, before)


# --- what is damaged or meant for somebody else changes nothing, and is not answered ------------------------------

STATEFUL = (
    command_long(400, 1.0),
    command_long(511, 30.0, 20_000.0),
    mavlink.MAVLink_param_set_message(1, 1, b"MPC_XY_CRUISE", 7.0, mavlink.MAV_PARAM_TYPE_REAL32),
    mavlink.MAVLink_mission_count_message(1, 1, 3, 0),
    mavlink.MAVLink_mission_clear_all_message(1, 1, 0),
    mavlink.MAVLink_set_mode_message(1, 1, 4 << 16 | 3 << 24),
    mavlink.MAVLink_setup_signing_message(1, 1, [1] * 32, 5),
    mavlink.MAVLink_ping_message(1, 1, 0, 0),
    mavlink.MAVLink_param_request_list_message(1, 1),
    mavlink.MAVLink_manual_control_message(1, 100, 100, 500, 100, 0),
)


class Bystander:
    """An autopilot of which everything that messages can change is looked at before and after."""

    def __init__(self) -> None:
        self.commands: list[int] = []
        self.peer = Peer(self._note)
        self.peer.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        self.before = self.state()

    def _note(self, now_us: int, command: Any) -> None:
        self.commands.append(command.command)

    def state(self) -> Any:
        """Topics, parameters, plans, texts, stream rates, keys."""
        mavlink_, topics = self.peer.mavlink, self.peer.topics
        return (
            {name: getattr(topics, name) for name in topic_names(topics) if name != "gcs_heartbeats"},
            dict(self.peer.parameters._values),
            self.peer.texts.count,
            [{number: link.interval_us(number) for number in mavlink.mavlink_map} for link in mavlink_.links],
            [link.signing.active for link in mavlink_.links],
            list(self.commands),
        )

    def unmoved(self) -> bool:
        """Whether nothing has changed and nothing was said."""
        said = [message for link in range(4) for message in self.peer.received(link)]
        return not said and str(self.state()) == str(self.before)


def packed(message: Any, sequence: int = 0) -> bytes:
    codec: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    codec.seq = sequence
    return bytes(message.pack(codec))


@settings(max_examples=60)
@given(st.sampled_from(STATEFUL), st.integers(1, 30), st.integers(1, 255))
def test_a_frame_with_any_byte_changed_does_nothing(message: Any, place: int, change: int) -> None:
    bystander, frame = Bystander(), bytearray(packed(message))
    place = 1 + place % (len(frame) - 1)
    frame[place] ^= change
    bystander.peer.send_bytes(bytes(frame))
    assert bystander.unmoved()


@settings(max_examples=30)
@given(st.sampled_from(STATEFUL), st.integers(1, 40))
def test_a_frame_cut_short_does_nothing_and_what_follows_is_understood_again(message: Any, cut: int) -> None:
    bystander, frame = Bystander(), packed(message)
    bystander.peer.send_bytes(frame[: max(1, len(frame) - cut)])
    assert bystander.unmoved()
    pings = [bystander.peer.send(mavlink.MAVLink_ping_message(1, n, 0, 0)) for n in range(20)]
    assert only(pings[-1], "PING")


@pytest.mark.parametrize("message", STATEFUL[:7], ids=lambda message: message.get_type())
@pytest.mark.parametrize("target", [(2, 1), (1, 100), (255, 190)])
def test_what_is_for_somebody_else_does_nothing(message: Any, target: tuple[int, int]) -> None:
    if message.get_type() == "SET_MODE" and target[0] == 1:
        pytest.skip("SET_MODE has no target component")
    if message.get_type() == "SETUP_SIGNING":
        pytest.skip("a key is taken whoever it is for (Mavlink::handle_message)")
    message = copy.copy(message)
    message.target_system, message.target_component = target
    bystander = Bystander()
    bystander.peer.send(message)
    assert bystander.unmoved()


@pytest.mark.parametrize("message", STATEFUL, ids=lambda message: message.get_type())
def test_a_wrong_signature_does_nothing(message: Any) -> None:
    bystander = Bystander()
    for link in bystander.peer.mavlink.links:
        link.signing.use(SigningKey(b"k" * 32, 1))
    bystander.before = bystander.state()
    codec: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    codec.signing.secret_key, codec.signing.sign_outgoing = b"x" * 32, True
    bystander.peer.send_bytes(bytes(message.pack(codec)))
    bystander.peer.send_bytes(packed(message))
    assert bystander.unmoved()


# --- many in one, and one in many -----------------------------------------------------------------------------------


def test_the_largest_datagram_of_pings_is_answered_one_by_one() -> None:
    peer = Peer()
    ping = packed(mavlink.MAVLink_ping_message(1, 1, 0, 0))
    count = 65_507 // len(ping)
    assert len(only(peer.send_bytes(ping * count), "PING")) == count


def test_the_largest_datagram_of_nothing_is_read_at_once_and_forgotten() -> None:
    peer = Peer()
    for data in (b"\xfd" * 65_507, b"\xfe\xff" * 32_000, bytes(65_507), random.Random(1).randbytes(65_507)):
        peer.send_bytes(data)
    assert len(peer.mavlink.links[GCS]._splitter._rest) < 300
    peer.send_bytes(bytes(300))
    assert only(peer.send(mavlink.MAVLink_ping_message(1, 1, 0, 0)), "PING")


@settings(max_examples=200)
@given(st.lists(st.binary(max_size=300), max_size=20))
def test_no_bytes_at_all_make_a_link_fail(pieces: list[bytes]) -> None:
    peer = Peer()
    for piece in pieces:
        peer.send_bytes(piece, ONBOARD)
    peer.run(0.1, PAYLOAD)


def test_nonsense_of_one_seed_is_the_same_again() -> None:
    first, second = (hostile.Nonsense(random.Random(7), [0, 76], ["MPC_XY_P"]) for _ in range(2))
    frames = [first.frame() for _ in range(500)]
    assert frames == [second.frame() for _ in range(500)]
    assert len(frames) == len([f for frame in frames for f in framing.split(frame)])
    assert len({framing.message_id(frame) for frame in frames}) > 100
