"""Sealed broadcasts: what peers seal is opened once, whatever else comes is refused, counted, and never raises."""

import random
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.telemetry import Telemetry
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.swarm import key as keys
from sitl_emu.missions.companion.swarm import seal as seals
from sitl_emu.missions.companion.swarm.key import SwarmKey, key_of
from sitl_emu.missions.companion.swarm.seal import CONTENT_BYTES, TUNNEL_BYTES, WINDOW_US, Refusal, Seal
from tests.unit.companion_px4 import on_the_wire

NOW_US = 1_781_514_000_000_000
MEMBERS = frozenset({1, 2, 3})
KEY = key_of(Options({"swarm_seed": 7}))


def heard(msg: Any, system: int = 1) -> Any:
    return on_the_wire(msg, system, 191)


def tunnel(packet: bytes, length: int | None = None, payload_type: int = seals.PAYLOAD_TYPE) -> Any:
    payload = list(packet[:TUNNEL_BYTES].ljust(TUNNEL_BYTES, b"\0"))
    length = len(packet) if length is None else length
    return mavlink.MAVLink_tunnel_message(0, 0, payload_type, length, payload)


@given(st.binary(max_size=CONTENT_BYTES))
def test_what_one_seals_the_others_open_once(content: bytes) -> None:
    one, other = Seal(KEY, MEMBERS), Seal(KEY, MEMBERS)
    msg = heard(one.seal(NOW_US, 1, content))
    assert seals.is_sealed(msg)
    assert other.open(NOW_US + 20_000, 2, msg) == (1, NOW_US, content)
    assert other.open(NOW_US + 40_000, 2, msg) is None
    assert other.refused == {Refusal.REPLAY: 1} and other.taken == 1


def test_more_than_a_tunnel_holds_is_an_error_of_the_sender() -> None:
    with pytest.raises(ValueError, match="97 bytes; a sealed broadcast holds 96"):
        Seal(KEY, MEMBERS).seal(NOW_US, 1, bytes(CONTENT_BYTES + 1))


@given(st.lists(st.integers(0, 3), min_size=1, max_size=50))
def test_no_nonce_is_used_twice_also_when_time_stands_still_or_goes_back(steps: list[int]) -> None:
    seal, nonces, now_us = Seal(KEY, MEMBERS), set[bytes](), NOW_US
    for step in steps:
        now_us += step - 2
        nonces.add(bytes(seal.seal(now_us, 1, b"").payload[: seals.HEADER.size]))
    assert len(nonces) == len(steps)


def test_two_boots_of_one_aircraft_seal_in_two_sessions(tmp_path: Path) -> None:
    (tmp_path / "swarm.key").write_text("0f" * 32 + "\n")
    one, other = (key_of(Options({"swarm_key": str(tmp_path / "swarm.key")})) for _ in range(2))
    assert one.secret == other.secret == b"\x0f" * 32 and one.session != other.session


def test_reordered_within_the_window_all_are_taken() -> None:
    one, other, dice = Seal(KEY, MEMBERS), Seal(KEY, MEMBERS), random.Random(1)
    sent = [heard(one.seal(NOW_US + 1000 * n, 1, bytes([n]))) for n in range(200)]
    dice.shuffle(sent)
    assert all(other.open(NOW_US + 200_000, 2, msg) is not None for msg in sent)


def test_nothing_of_an_earlier_flight_is_taken_by_who_has_just_been_switched_on() -> None:
    msg = heard(Seal(KEY, MEMBERS).seal(NOW_US, 1, b"claims"))
    fresh = Seal(KEY, MEMBERS)
    assert fresh.open(0, 2, msg) is None and fresh.open(NOW_US + WINDOW_US + 1, 2, msg) is None
    assert fresh.refused == {Refusal.NO_TIME: 1, Refusal.STALE: 1}


def test_a_clock_that_goes_back_makes_nothing_new_again() -> None:
    one, other = Seal(KEY, MEMBERS), Seal(KEY, MEMBERS)
    old = heard(one.seal(NOW_US, 1, b"old"))
    assert other.open(NOW_US, 2, old) is not None
    assert other.open(NOW_US + 30_000_000, 2, heard(one.seal(NOW_US + 30_000_000, 1, b"new"))) is not None
    assert other.open(NOW_US, 2, old) is None


def spoilt(dice: random.Random, sealed: list[Any]) -> tuple[Any, Refusal | None]:
    """A packet that must not be taken, and why where that is sure."""
    good = dice.choice(sealed)
    packet = bytearray(good.payload[: good.payload_length])
    match dice.randrange(9):
        case 0:
            return good, Refusal.REPLAY
        case 1:
            packet[dice.randrange(len(packet))] ^= 1 << dice.randrange(8)
            return heard(tunnel(bytes(packet)), good.get_srcSystem()), None
        case 2:
            packet[dice.randrange(seals.HEADER.size, len(packet))] ^= 1 << dice.randrange(8)
            return heard(tunnel(bytes(packet)), good.get_srcSystem()), Refusal.REPLAY
        case 3:
            cut = dice.randrange(seals.OVERHEAD_BYTES)
            return heard(tunnel(bytes(packet), cut), 1), Refusal.LENGTH
        case 4:
            return heard(tunnel(bytes(packet), dice.randrange(TUNNEL_BYTES + 1, 256)), 1), Refusal.LENGTH
        case 5:
            packet[0] = dice.choice((0, 2, 255))
            return heard(tunnel(bytes(packet)), 1), Refusal.VERSION
        case 6:
            strange = Seal(SwarmKey(dice.randbytes(32), 1), MEMBERS)
            return heard(strange.seal(NOW_US, 1, b"give way")), Refusal.KEY
        case 7:
            system = dice.choice((0, 4, 255))
            return heard(Seal(KEY, MEMBERS).seal(NOW_US, system, b"hello"), system), Refusal.SENDER
        case _:
            return heard(tunnel(dice.randbytes(dice.randrange(TUNNEL_BYTES + 1))), dice.choice((1, 3))), None


def test_of_10000_tampered_replayed_and_foreign_packets_none_is_taken_and_all_are_counted() -> None:
    dice, us = random.Random(12), Seal(KEY, MEMBERS)
    senders = {system: Seal(KEY, MEMBERS) for system in (1, 3)}
    sealed = [
        heard(
            senders[1 + 2 * (n % 2)].seal(NOW_US + n, 1 + 2 * (n % 2), dice.randbytes(dice.randrange(97))),
            1 + 2 * (n % 2),
        )
        for n in range(100)
    ]
    assert all(us.open(NOW_US, 2, msg) is not None for msg in sealed)
    sure = Counter[Refusal]()
    for _ in range(10_000):
        msg, why = spoilt(dice, sealed)
        before = us.refused.copy()
        assert us.open(NOW_US, 2, msg) is None
        told = us.refused - before
        assert told.total() == 1 and (why is None or told == {why: 1})
        sure.update([why] if why is not None else [])
    assert us.taken == 100 and us.refused.total() == 10_000
    assert set(us.refused) == set(Refusal) - {Refusal.CONTENT, Refusal.ECHO, Refusal.NO_TIME}
    assert all(us.refused[why] >= count for why, count in sure.items())


@given(st.integers(0, TUNNEL_BYTES - 1), st.integers(0, 7), st.binary(max_size=CONTENT_BYTES))
def test_every_bit_of_a_packet_is_under_the_seal(byte: int, bit: int, content: bytes) -> None:
    good = Seal(KEY, MEMBERS).seal(NOW_US, 1, content)
    packet = bytearray(good.payload[: good.payload_length])
    packet[byte % len(packet)] ^= 1 << bit
    assert Seal(KEY, MEMBERS).open(NOW_US, 2, heard(tunnel(bytes(packet)))) is None


@given(st.binary(max_size=TUNNEL_BYTES), st.integers(0, 255), st.integers(0, 255), st.integers(0, 2**63))
def test_whatever_a_packet_holds_it_is_counted_and_does_not_raise(
    packet: bytes, length: int, system: int, unix_us: int
) -> None:
    us = Seal(KEY, MEMBERS)
    assert us.open(unix_us, 2, heard(tunnel(packet, length), system)) is None
    assert us.refused.total() == 1


def test_a_peer_can_not_speak_for_another_and_what_we_said_ourselves_is_no_peer() -> None:
    msg, us = Seal(KEY, MEMBERS).seal(NOW_US, 1, b"mine"), Seal(KEY, MEMBERS)
    assert us.open(NOW_US, 2, heard(msg, 3)) is None and us.open(NOW_US, 1, heard(msg)) is None
    assert us.refused == {Refusal.SENDER: 1, Refusal.ECHO: 1}


def test_a_run_without_a_key_makes_one_of_its_seed_and_says_so() -> None:
    one, again, other = (key_of(Options(keys.for_a_run({}, seed))) for seed in (7, 7, 8))
    assert one == again and one.secret != other.secret
    assert one.said == f"swarm key {one.mark:04x}, made of the run's seed, for simulation alone"


def test_what_a_simulation_seals_with_a_key_file_does_not_open_with_that_file(tmp_path: Path) -> None:
    (tmp_path / "swarm.key").write_text("0f" * 32)
    options = {"swarm_key": str(tmp_path / "swarm.key")}
    simulated, real = key_of(Options(keys.for_a_run(options, 7))), key_of(Options(options))
    aboard = Seal(real, MEMBERS)
    assert simulated.simulated and not real.simulated and real.said.endswith("from its file")
    assert aboard.open(NOW_US, 2, heard(Seal(simulated, MEMBERS).seal(NOW_US, 1, b""))) is None
    assert "0f0f" not in repr(real)


@pytest.mark.parametrize("text", ["", "0f" * 31, "0f" * 33, "zz" * 32, "not a key"])
def test_a_file_that_holds_no_key_is_told_in_one_line(text: str, tmp_path: Path) -> None:
    (tmp_path / "swarm.key").write_text(text)
    with pytest.raises(
        ValueError, match=r"^option swarm_key: '.*swarm.key': holds no key; allowed: a file with 64 hex"
    ):
        key_of(Options({"swarm_key": str(tmp_path / "swarm.key")}))


def test_an_aircraft_without_a_key_does_not_start(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"^option swarm_key: missing; allowed: a file with 64 hexadecimal digits"):
        key_of(Options({}))
    with pytest.raises(ValueError, match="No such file or directory; allowed: a file"):
        key_of(Options({"swarm_key": str(tmp_path / "none")}))
    (tmp_path / "binary").write_bytes(b"\xff" * 32)
    with pytest.raises(ValueError, match="holds no key"):
        key_of(Options({"swarm_key": str(tmp_path / "binary")}))


def test_the_time_of_a_seal_is_the_autopilots_and_unknown_before_it_says_it() -> None:
    telemetry = Telemetry(1)
    for unix_us, known_us in ((0, 0), (NOW_US, NOW_US + 500)):
        telemetry.on_message(1000, on_the_wire(mavlink.MAVLink_system_time_message(unix_us, 1), 1, 1))
        assert telemetry.unix_us(1500) == known_us
