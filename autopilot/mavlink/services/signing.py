"""Signing: SETUP_SIGNING gives, changes or takes away the key of all links, which outlives a restart.

Source: PX4 v1.18's docs/en/mavlink/message_signing.md and src/modules/mavlink (Mavlink::handle_message,
mavlink_sign_control.cpp): taken on any link, whichever system it is for, never while armed; once there is a key only
with its signature, as a link drops what is not signed (see ../signature.py). An all-zero key ends signing. The key lies
in mavlink/mavlink-signing-key.bin: 32 bytes, and the timestamp that was given with it in 8, little-endian. MAVLink
wants a newer timestamp saved now and then, which PX4 doesn't do: a restart goes back to the first.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.signature import KEY_BYTES, NO_KEY, SigningKey
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink

STAMP_BYTES: Final = 8


class SigningKeyFile:
    """Where the key is kept; without storage it is forgotten at the end."""

    def __init__(self, root: Path | None) -> None:
        """`root` is the instance's folder."""
        self._path = None if root is None else root / storage.SIGNING_KEY

    def load(self) -> SigningKey:
        """The key; NO_KEY if there is no whole one."""
        try:
            data = b"" if self._path is None else self._path.read_bytes()
        except OSError:
            return NO_KEY
        if len(data) < KEY_BYTES + STAMP_BYTES:
            return NO_KEY
        return SigningKey(data[:KEY_BYTES], int.from_bytes(data[KEY_BYTES : KEY_BYTES + STAMP_BYTES], "little"))

    def save(self, key: SigningKey) -> None:
        """Keep a key, for the owner's eyes alone. A disk that refuses it loses it at the next start, as in PX4."""
        if self._path is None:
            return
        new = self._path.with_suffix(".tmp")
        try:
            self._path.parent.mkdir(mode=0o700, exist_ok=True)
            new.touch(mode=0o600)
            new.write_bytes(key.secret + key.timestamp.to_bytes(STAMP_BYTES, "little"))
            new.replace(self._path)
        except OSError:
            return


class Signing:
    """Owner of the key; every link has its LinkSigning with it."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_SETUP_SIGNING})
    HAS_TIMER = False

    def __init__(
        self, links: tuple[Link, ...], topics: Topics, say: Callable[[Severity, str], None], root: Path | None
    ) -> None:
        """Begin with the key of the last flight."""
        self._links, self._topics, self._say = links, topics, say
        self._file = SigningKeyFile(root)
        self._key = self._file.load()
        for link in links:
            link.signing.use(self._key)

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Change the key, and say so; nobody is told the key."""
        if self._topics.actuator_armed.armed:
            self._say(Severity.CRITICAL, "MAVLink signing: rejected while armed")
            return
        key = SigningKey(bytes(message.secret_key), message.initial_timestamp)
        if key.enabled or self._key.enabled:
            for each in self._links:
                each.signing.use(key)
            self._key = key
            self._file.save(key)
        self._say(Severity.INFO, "MAVLink signing key accepted" if key.enabled else "MAVLink signing disabled")

    def on_time(self, now_us: int) -> None:
        """Nothing is due."""
