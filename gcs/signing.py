"""Signing: give a vehicle its key, change it or take it away, and sign what we send.

Source: https://mavlink.io/en/guide/message_signing.html. The vehicle tells by STATUSTEXT what it thinks of the key, as
PX4 does. SETUP_SIGNING carries the key readably: over a trusted link only. A change is to be signed with the old key,
so `sign` with the new one comes after it.
"""

from hashlib import sha256
from typing import Any

from sitl_emu.core import dialect as mavlink

KEY_BYTES = 32
NO_KEY = bytes(KEY_BYTES)
EPOCH_US = 1_420_070_400_000_000
"""2015-01-01T00:00:00Z, from where timestamps count."""
RETRY_US = 1_000_000
TRIES = 5
TEXT_START = "MAVLink signing"
GOOD_ENDS = ("key accepted", "disabled")


def key_of(passphrase: str) -> bytes:
    """The key of a passphrase, as QGroundControl and MAVProxy make it."""
    return sha256(passphrase.encode()).digest()


def timestamp(unix_us: int) -> int:
    """A date (µs since 1970) as signatures count it, in 10 µs."""
    return max(0, unix_us - EPOCH_US) // 10


def sign(codec: mavlink.MAVLink, key: bytes, now: int, link_id: int = 0) -> None:
    """Let a codec sign what it packs from `timestamp` now on, and check signatures; NO_KEY ends it.

    Unsigned and wrongly signed messages are still decoded: `get_signed()` tells whether one is genuine.
    """
    signing = codec.signing
    signing.secret_key = None if key == NO_KEY else key
    signing.sign_outgoing = key != NO_KEY
    signing.timestamp, signing.link_id = now, link_id
    signing.allow_unsigned_callback = lambda _codec, _message_id: True


class Signing:
    """One SETUP_SIGNING, repeated until the vehicle says yes or no, or nothing to the last."""

    def __init__(self, target_system: int, target_component: int, key: bytes, now: int) -> None:
        """`key`: 32 bytes, NO_KEY to end signing; `now` as `timestamp` gives it."""
        if len(key) != KEY_BYTES:
            raise ValueError(f"a signing key of {len(key)} bytes; allowed: {KEY_BYTES}")
        self._target = (target_system, target_component)
        self._message = mavlink.MAVLink_setup_signing_message(
            target_system, target_component, list(key), 0 if key == NO_KEY else now
        )
        self._tries = 0
        self._due_us: int | None = None
        self.accepted: bool | None = None
        """None until it is known."""
        self.text = ""
        """What the vehicle said, or that it said nothing."""

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not."""
        return bool(self.text)

    def on_message(self, now_us: int, msg: Any) -> list[mavlink.MAVLink_message]:
        """Looks for the vehicle's answer."""
        if (
            not self.done
            and msg.get_type() == "STATUSTEXT"
            and self._target == (msg.get_srcSystem(), msg.get_srcComponent())
        ):
            text = msg.text if isinstance(msg.text, str) else msg.text.decode(errors="replace")
            if text.startswith(TEXT_START):
                self.accepted, self.text = text.rstrip("\0").endswith(GOOD_ENDS), text.rstrip("\0")
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends it, at once and each second."""
        if self.done or (self._due_us is not None and now_us < self._due_us):
            return []
        if self._tries == TRIES:
            self.accepted, self.text = False, "no answer: the vehicle signs with another key, or does not sign"
            return []
        self._tries += 1
        self._due_us = now_us + RETRY_US
        return [self._message]
