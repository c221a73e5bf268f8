"""The files that describe a vehicle: which there are, fetched over FTP, checked and unpacked.

Source: https://mavlink.io/en/services/component_information.html: COMPONENT_METADATA names the general file, which
names the others; each has a CRC, by which a ground station knows whether it has the file already: PX4 tells that of the
general file's JSON, and of the others as they are sent, compressed. "mftp://" is a path on the vehicle, ".xz" a
compressed file. Files elsewhere (https://) are named and not fetched: there is no network here.
"""

import json
import lzma
from collections.abc import Mapping
from typing import Any, NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.ftp import FtpGet, crc_of
from sitl_emu.gcs.message_request import MessageRequest

COMPONENT_METADATA = 397
GENERAL, PARAMETER, COMMANDS, PERIPHERALS, EVENTS, ACTUATORS = range(6)
"""COMP_METADATA_TYPE."""
ON_THE_VEHICLE = "mftp://"


class _File(NamedTuple):
    kind: int
    uri: str
    crc: int | None


class ComponentMetadata:
    """Fetches the metadata of one component; `files` has their JSON by COMP_METADATA_TYPE."""

    def __init__(self, system: int, component: int = 1, cache: Mapping[int, bytes] | None = None) -> None:
        """`cache`: files that are there already, unpacked, by their announced CRC; `fetched` is what to add to it."""
        self.target = (system, component)
        self.files: dict[int, Any] = {}
        self.elsewhere: dict[int, str] = {}
        """URIs of files that are not on the vehicle."""
        self.fetched: dict[int, bytes] = {}
        self.errors: list[str] = []
        self.done = False
        self._cache = cache or {}
        self._request = MessageRequest(system, COMPONENT_METADATA, component)
        self._wanted: list[_File] = []
        self._get: FtpGet | None = None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the answers."""
        if self.done:
            return []
        if self._get is not None:
            messages = self._get.on_message(now_us, msg)
            return messages + self._go_on(now_us) if self._get.done else messages
        self._request.on_message(now_us, msg)
        return self._go_on(now_us) if self._request.done else []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks, and asks again."""
        if self.done:
            return []
        step = self._request if self._get is None else self._get
        messages = step.on_time(now_us)
        return messages + self._go_on(now_us) if step.done else messages

    def _go_on(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """What ended is looked at, and the next file asked for."""
        if self._get is None:
            answer = self._request.message
            if answer is None:
                self.errors.append(f"no metadata: {self._request.refusal}")
            else:
                self._want(_File(GENERAL, text(answer.uri), answer.file_crc))
        else:
            self._arrived(self._wanted.pop(0), self._get)
        while self._wanted and self._wanted[0].crc in self._cache:
            file = self._wanted.pop(0)
            self._read(file, self._cache[file.crc or 0])
        if not self._wanted:
            self.done = True
            return []
        self._get = FtpGet(self.target[0], path_of(self._wanted[0].uri), self.target[1])
        return self._get.on_time(now_us)

    def _want(self, file: _File) -> None:
        if file.uri.startswith(ON_THE_VEHICLE):
            self._wanted.append(file)
        else:
            self.elsewhere[file.kind] = file.uri

    def _arrived(self, file: _File, get: FtpGet) -> None:
        if get.error is not None:
            self.errors.append(f"{file.uri}: {get.error}")
            return
        try:
            content = lzma.decompress(get.content) if file.uri.endswith(".xz") else get.content
        except lzma.LZMAError as error:
            self.errors.append(f"{file.uri}: can't be unpacked ({error})")
            return
        crcs = crc_of(content), crc_of(get.content)
        if file.crc not in (None, *crcs):
            self.errors.append(f"{file.uri}: its CRC is not the one that was announced")
            return
        self.fetched[crcs[0] if file.crc is None else file.crc] = content
        self._read(file, content)

    def _read(self, file: _File, content: bytes) -> None:
        try:
            document = json.loads(content)
        except ValueError as error:
            self.errors.append(f"{file.uri}: no JSON ({error})")
            return
        self.files[file.kind] = document
        if file.kind == GENERAL:
            for entry in document.get("metadataTypes", ()):
                self._want(_File(entry["type"], entry["uri"], entry.get("fileCrc")))


def path_of(uri: str) -> str:
    """The path on the vehicle; "[;comp=N]" in front of it names the component, which is asked anyway."""
    path = uri.removeprefix(ON_THE_VEHICLE)
    return path.partition("]")[2] if path.startswith("[;comp=") else path


def text(value: str | bytes) -> str:
    """A char[] field."""
    return (value if isinstance(value, str) else value.decode(errors="replace")).rstrip("\0")
