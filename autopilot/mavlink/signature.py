"""Signatures of MAVLink 2 frames: one link's key, the clock of what it signs, and whom it believes.

Source: https://mavlink.io/en/guide/message_signing.html, as the MAVLink C library keeps it: a signature is the start of
SHA-256 over key, frame, link id and timestamp; timestamps count 10 µs, rise with every message that a link sends or
believes, and may never fall within one stream (sender and link id).
"""

from hashlib import sha256
from typing import Final, NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing

KEY_BYTES: Final = 32
HASH_BYTES: Final = 6
TIMESTAMP_BYTES: Final = 6
TIMESTAMP_MASK = (1 << 48) - 1
MAX_STREAMS: Final = 16
"""Streams that are kept apart (MAVLINK_MAX_SIGNING_STREAMS); messages of a further one are refused."""
OLDEST_NEW_STREAM: Final = 6_000_000
"""A new stream may lag by one minute."""
ACCEPTED_UNSIGNED = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT,
        mavlink.MAVLINK_MSG_ID_RADIO_STATUS,
        mavlink.MAVLINK_MSG_ID_ADSB_VEHICLE,
        mavlink.MAVLINK_MSG_ID_COLLISION,
    }
)
"""What PX4 takes without a signature, or with a wrong one (mavlink_sign_control.cpp)."""

SigningStreams = dict[tuple[int, int, int], int]
"""Last timestamp by system, component and link id of the sender; shared by all links of a vehicle, as in PX4."""


class SigningKey(NamedTuple):
    """A secret of 32 bytes and the timestamp to go on from, in 10 µs since 2015-01-01; all zero is no key."""

    secret: bytes = bytes(KEY_BYTES)
    timestamp: int = 0

    @property
    def enabled(self) -> bool:
        """Whether this key makes a vehicle sign."""
        return self.timestamp != 0 or any(self.secret)


NO_KEY = SigningKey()


class LinkSigning:
    """Signing on one link."""

    def __init__(self, link_id: int, streams: SigningStreams) -> None:
        """Without a key nothing is signed and everything is believed."""
        self._link_id = bytes((link_id,))
        self._streams = streams
        self.active = False
        self._secret = NO_KEY.secret
        self.timestamp = 0

    def use(self, key: SigningKey) -> None:
        """Sign with a key and from its time on, or with none; the same key again may turn the time back, as in PX4."""
        self._secret, self.timestamp = key.secret, key.timestamp
        self.active = key.enabled

    def signed(self, frame: bytes) -> bytes:
        """A frame made with the flag framing.SIGNED, with its signature."""
        timestamp = (self.timestamp & TIMESTAMP_MASK).to_bytes(TIMESTAMP_BYTES, "little")
        self.timestamp += 1
        frame += self._link_id + timestamp
        return frame + sha256(self._secret + frame).digest()[:HASH_BYTES]

    def believes(self, frame: bytes) -> bool:
        """Whether a whole frame, of which the CRC is right, may be acted upon."""
        if not self.active:
            return True
        if framing.is_signed(frame) and self._is_genuine(frame):
            return True
        return framing.message_id(frame) in ACCEPTED_UNSIGNED

    def _is_genuine(self, frame: bytes) -> bool:
        if sha256(self._secret + frame[:-HASH_BYTES]).digest()[:HASH_BYTES] != frame[-HASH_BYTES:]:
            return False
        signature = frame[-framing.SIGNATURE_BYTES :]
        timestamp = int.from_bytes(signature[1 : 1 + TIMESTAMP_BYTES], "little")
        stream = (*framing.sender(frame), signature[0])
        last = self._streams.get(stream)
        if last is None:
            if len(self._streams) >= MAX_STREAMS or timestamp + OLDEST_NEW_STREAM < self.timestamp:
                return False
        elif timestamp <= last:
            return False
        self._streams[stream] = timestamp
        self.timestamp = max(self.timestamp, timestamp)
        return True
