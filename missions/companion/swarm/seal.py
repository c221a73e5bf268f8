"""Sealed broadcasts: NaCl's secret box in MAVLink TUNNEL, for all who hold the key.

    version u8 · sender u8 · mark of the key u16 · session u32 · stamp u64     16 bytes in the clear, little-endian
    content, 96 bytes at most, sealed (XSalsa20-Poly1305)                      and 16 bytes of its tag

The nonce is the clear part, followed by zeros: who changes a bit of it breaks the seal. The stamp is the time in µs
since 1970 that the autopilots have from their GNSS receivers (SYSTEM_TIME), and counts on where that stands still or
goes back; with the session, which is another after each boot, no nonce is used twice.

A packet is taken once, and within `WINDOW_US` of its stamp. So nothing of an earlier flight is ever taken, also by who
has just been switched on; reordering within the window does no harm. Who does not know the time yet takes nothing, and
who has another time than its peers (a receiver that is deceived) does not hear them, which is as if they were lost.

Source: https://nacl.cr.yp.to/secretbox.html, https://mavlink.io/en/messages/common.html#TUNNEL. Traffic analysis and
jamming are not prevented: that somebody speaks, who, and when, can be seen by anybody.
"""

import struct
from collections import Counter
from enum import StrEnum
from typing import NamedTuple

from nacl.exceptions import CryptoError
from nacl.secret import SecretBox

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.swarm.key import SwarmKey

VERSION = 1
PAYLOAD_TYPE = 0x8E53
"""Ours, from the range that MAVLink leaves to experiments (above 32767): it is not registered."""
TUNNEL_BYTES = 128
HEADER = struct.Struct("<BBHIQ")
OVERHEAD_BYTES: int = HEADER.size + SecretBox.MACBYTES
CONTENT_BYTES = TUNNEL_BYTES - OVERHEAD_BYTES
WINDOW_US = 10_000_000
"""How far the times of two aircraft may be apart, with what a radio delays; ours."""


class Refusal(StrEnum):
    """Why a packet was not taken."""

    LENGTH = "length"
    VERSION = "version"
    KEY = "another key"
    SENDER = "unknown sender"
    ECHO = "our own"
    NO_TIME = "time not known yet"
    STALE = "not of now"
    REPLAY = "taken before"
    SEAL = "seal broken"
    CONTENT = "content without sense"


class Opened(NamedTuple):
    """What a peer has sealed."""

    sender: int
    stamp_us: int
    content: bytes


class Seal:
    """Seals what one aircraft says, opens what others have sealed, and counts what it refuses."""

    def __init__(self, key: SwarmKey, members: frozenset[int]) -> None:
        """`members`: the MAVLink systems of the swarm, ours among them; who is not one of them is not heard."""
        self._key, self._members = key, members
        self._box = SecretBox(key.secret)
        self._stamp_us = 0
        self._horizon_us = 0
        self._taken = dict[int, set[int]]()
        self.taken = 0
        self.refused = Counter[Refusal]()

    def seal(self, unix_us: int, system: int, content: bytes) -> mavlink.MAVLink_message:
        """A broadcast of ours. Raises ValueError for more than `CONTENT_BYTES`."""
        if len(content) > CONTENT_BYTES:
            raise ValueError(f"{len(content)} bytes; a sealed broadcast holds {CONTENT_BYTES}")
        self._stamp_us = max(unix_us, self._stamp_us + 1)
        clear = HEADER.pack(VERSION, system, self._key.mark, self._key.session, self._stamp_us)
        packet = clear + self._box.encrypt(content, _nonce(clear)).ciphertext
        payload = list(packet.ljust(TUNNEL_BYTES, b"\0"))
        return mavlink.MAVLink_tunnel_message(0, 0, PAYLOAD_TYPE, len(packet), payload)

    def open(self, unix_us: int, system: int, msg: mavlink.MAVLink_message) -> Opened | None:
        """What a TUNNEL of our type says, at a time (0: not known yet); None, counted, where it is refused.

        `system`: ours.
        """
        opened = self._opened(unix_us, system, msg)
        if isinstance(opened, Refusal):
            self.refused[opened] += 1
            return None
        self._horizon_us = max(self._horizon_us, unix_us - WINDOW_US)
        kept = self._taken.setdefault(opened.sender, set())
        kept.add(opened.stamp_us)
        kept.difference_update([stamp_us for stamp_us in kept if stamp_us < self._horizon_us])
        self.taken += 1
        return opened

    def _opened(self, unix_us: int, system: int, msg: mavlink.MAVLink_message) -> Opened | Refusal:
        packet = bytes(msg.payload[: msg.payload_length])
        if not OVERHEAD_BYTES <= msg.payload_length <= TUNNEL_BYTES or len(packet) != msg.payload_length:
            return Refusal.LENGTH
        clear = packet[: HEADER.size]
        version, sender, mark, _, stamp_us = HEADER.unpack(clear)
        if version != VERSION:
            return Refusal.VERSION
        if mark != self._key.mark:
            return Refusal.KEY
        if sender not in self._members or sender != msg.get_srcSystem():
            return Refusal.SENDER
        if sender == system:
            return Refusal.ECHO
        if not unix_us:
            return Refusal.NO_TIME
        if abs(stamp_us - unix_us) > WINDOW_US or stamp_us < self._horizon_us:
            return Refusal.STALE
        if stamp_us in self._taken.get(sender, ()):
            return Refusal.REPLAY
        try:
            return Opened(sender, stamp_us, self._box.decrypt(packet[HEADER.size :], _nonce(clear)))
        except CryptoError:
            return Refusal.SEAL


def is_sealed(msg: mavlink.MAVLink_message) -> bool:
    """Whether it is a TUNNEL of our type."""
    return bool(msg.get_type() == "TUNNEL" and msg.payload_type == PAYLOAD_TYPE)


def _nonce(clear: bytes) -> bytes:
    return clear.ljust(SecretBox.NONCE_SIZE, b"\0")
