"""The autopilot's own end of MAVLink FTP, for tests of clients."""

from pathlib import Path
from typing import Any

from sitl_emu.autopilot.mavlink.encoder import Encoder
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services.ftp import Ftp
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports


class Server:
    """Of system 1, with its files under a folder."""

    def __init__(self, root: Path) -> None:
        self.ftp = Ftp(1, root, lambda: {"etc/extras/one.json.xz": b"1" * 1000})
        self.link = Link("gcs", "normal", ports.gcs(0), Encoder(1))
        self._parser = mavlink.MAVLink(None)
        self.now_us = 0

    def on_message(self, now_us: int, message: Any) -> list[Any]:
        self.ftp.on_message(now_us, message, self.link)
        return self._said()

    def on_time(self, now_us: int) -> list[Any]:
        self.ftp.on_time(now_us)
        return self._said()

    def _said(self) -> list[Any]:
        self.link.flush()
        said = [message for data in self.link.outbox for message in self._parser.parse_buffer(data) or []]
        self.link.outbox.clear()
        return said
