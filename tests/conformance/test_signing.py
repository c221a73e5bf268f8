"""Signing: a key set over the wire is obeyed on both ways, and its signed removal ends it.

Texts, the four messages that need no signature and the refusal while armed are PX4's (docs/en/mavlink/
message_signing.md of v1.18); what a signature is and which timestamps are believed, MAVLink's.
"""

import time
from collections.abc import Iterator
from typing import Any

import pytest

pytestmark = [
    pytest.mark.covers("SETUP_SIGNING", source="https://docs.px4.io/v1.18/en/mavlink/message_signing"),
    pytest.mark.covers("SETUP_SIGNING", source="https://mavlink.io/en/guide/message_signing.html"),
]

KEY = bytes(range(32))
SIGNED = 0x01
EPOCH_S = 1_420_070_400
RUN_PREARM_CHECKS = 401
GCS = 6
SILENCE_S = 1.0
REPLY_S, TRIES = 3.0, 5
"""Ours: an answer over a slow radio, and how often it may be lost."""
NO_AUTOPILOT = 8


def now() -> int:
    """The time as signatures count it: 10 µs since 2015."""
    return int((time.time() - EPOCH_S) * 100_000)


def text_of(station: Any, start: str = "MAVLink signing") -> str | None:
    """The next text that begins so."""
    while (text := station.receive("STATUSTEXT")) is not None:
        if text.text.startswith(start):
            return str(text.text)
    return None


def sign(station: Any, key: bytes | None) -> None:
    """Sign what we send, or no longer; what comes is taken whatever its signature."""
    signing = station.mav.signing
    signing.secret_key, signing.sign_outgoing = key, key is not None
    signing.timestamp = now()
    signing.allow_unsigned_callback = lambda _mav, _message: True


def set_key(station: Any, key: bytes, timestamp: int) -> str | None:
    station.mav.setup_signing_send(station.system, 1, list(key), timestamp)
    return text_of(station)


def is_signed(station: Any) -> bool:
    """Whether a signed command is answered with a signature, as by who has the key; it is asked until it answers."""
    for _ in range(TRIES):
        station.mav.command_long_send(station.system, 1, RUN_PREARM_CHECKS, 0, 0, 0, 0, 0, 0, 0, 0)
        ack = station.receive("COMMAND_ACK", REPLY_S)
        if ack is not None:
            return bool(ack.get_header().incompat_flags & SIGNED)
    return True


def remove_key(station: Any) -> None:
    """Take the key away, which a vehicle without it could not be spoken to with: again, if that is lost on a radio."""
    try:
        for _ in range(TRIES):
            sign(station, KEY)
            station.mav.setup_signing_send(station.system, 1, [0] * 32, 0)
            text = station.receive("STATUSTEXT", REPLY_S)
            if (text is not None and text.text == "MAVLink signing disabled") or not is_signed(station):
                return
    finally:
        sign(station, None)
    pytest.fail(
        f"the vehicle may still want messages signed with the key {KEY.hex()} (hexadecimal): remove it by a "
        "SETUP_SIGNING of zeros that is signed with it, or delete mavlink/mavlink-signing-key.bin on its card and "
        "restart it"
    )


@pytest.fixture
def key(station: Any) -> Iterator[bytes]:
    """A key that both sides use, and that is gone afterwards."""
    station.heartbeat()
    try:
        assert set_key(station, KEY, now()) == "MAVLink signing key accepted"
        sign(station, KEY)
        yield KEY
    finally:
        remove_key(station)
    assert station.command(RUN_PREARM_CHECKS) == 0


def test_everything_is_signed_once_there_is_a_key(station: Any, key: bytes) -> None:
    assert station.command(RUN_PREARM_CHECKS) == 0
    heard = [station.heartbeat(), *(station.receive(name) for name in ("ATTITUDE", "SYS_STATUS"))]
    assert [bool(message.get_header().incompat_flags & SIGNED) for message in heard] == [True] * 3
    assert all(message.get_signed() for message in heard)


def test_unsigned_and_wrongly_signed_commands_are_not_answered(station: Any, key: bytes) -> None:
    sign(station, None)
    assert station.command(RUN_PREARM_CHECKS, limit_s=SILENCE_S) is None
    sign(station, bytes(reversed(KEY)))
    assert station.command(RUN_PREARM_CHECKS, limit_s=SILENCE_S) is None
    sign(station, KEY)
    assert station.command(RUN_PREARM_CHECKS) == 0


def test_a_message_that_was_heard_before_is_not_answered(station: Any, key: bytes) -> None:
    assert station.command(RUN_PREARM_CHECKS) == 0
    station.mav.signing.timestamp = now() - 1_000_000
    assert station.command(RUN_PREARM_CHECKS, limit_s=SILENCE_S) is None


def test_the_key_can_not_be_removed_without_its_signature(station: Any, key: bytes) -> None:
    sign(station, None)
    station.mav.setup_signing_send(station.system, 1, [0] * 32, 0)
    assert station.command(RUN_PREARM_CHECKS, limit_s=SILENCE_S) is None
    sign(station, KEY)
    assert station.command(RUN_PREARM_CHECKS) == 0


def test_without_a_key_a_signed_command_is_answered_unsigned(station: Any) -> None:
    sign(station, KEY)
    try:
        station.mav.command_long_send(station.system, 1, RUN_PREARM_CHECKS, 0, 0, 0, 0, 0, 0, 0, 0)
        ack = station.receive("COMMAND_ACK")
    finally:
        sign(station, None)
    assert (ack.result, ack.get_header().incompat_flags) == (0, 0)
