"""Who a vehicle is: its version, what it can, and its flight modes.

Sources: https://mavlink.io/en/messages/common.html#AUTOPILOT_VERSION and
https://mavlink.io/en/services/standard_modes.html: one AVAILABLE_MODES for each mode, all of them sent when index 0 is
asked for; AVAILABLE_MODES_MONITOR counts up when there are others, and then they are asked for anew.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.message_request import MessageRequest

AUTOPILOT_VERSION = 148
AVAILABLE_MODES, AVAILABLE_MODES_MONITOR = 435, 437
NOT_USER_SELECTABLE = 2
"""MAV_MODE_PROPERTY."""


class Mode(NamedTuple):
    """A flight mode as the vehicle names it."""

    name: str
    custom_mode: int
    standard_mode: int
    """MAV_STANDARD_MODE, 0 for none of these."""
    selectable: bool


class Identity:
    """Asks an autopilot who it is; `version` is AUTOPILOT_VERSION, `modes` by custom_mode."""

    def __init__(self, system: int) -> None:
        self.system = system
        self.version: Any = None
        self.modes: dict[int, Mode] = {}
        self._by_index: dict[int, Mode] = {}
        self._count: int | None = None
        self._monitor: int | None = None
        self._request: MessageRequest | None = None
        self._questions = self._introduction()
        self.done = False
        """Whether everything has been asked for; what is not there then was refused, or nobody answered."""

    @property
    def complete(self) -> bool:
        """Whether version and modes are known."""
        return self.version is not None and self._count is not None and len(self._by_index) == self._count

    @property
    def release(self) -> str:
        """As in "1.18.0", "" while it is not known."""
        return "" if self.version is None else ".".join(map(str, self.version.flight_sw_version.to_bytes(4)[:3]))

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Takes what the autopilot says."""
        if (msg.get_srcSystem(), msg.get_srcComponent()) != (self.system, 1):
            return []
        kind = msg.get_msgId()
        if kind == AUTOPILOT_VERSION:
            self.version = msg
        elif kind == AVAILABLE_MODES:
            self._on_mode(msg)
        elif kind == AVAILABLE_MODES_MONITOR:
            if self._monitor not in (None, msg.seq):
                self._count, self.done = None, False
                self._by_index.clear()
                self._questions = self._all_modes()
            self._monitor = msg.seq
        if self._request is not None:
            self._request.on_message(now_us, msg)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks for one message after another."""
        if self.done:
            return []
        if self._request is None or self._request.done:
            self._request = next(self._questions, None)
            if self._request is None:
                self.done = True
                return []
        return self._request.on_time(now_us)

    def _introduction(self) -> Iterator[MessageRequest]:
        yield MessageRequest(self.system, AUTOPILOT_VERSION)
        yield from self._all_modes()

    def _all_modes(self) -> Iterator[MessageRequest]:
        """All at once, and then those that were lost."""
        yield self._mode(0)
        for index in range(1, (self._count or 0) + 1):
            if index not in self._by_index:
                yield self._mode(index)

    def _mode(self, index: int) -> MessageRequest:
        return MessageRequest(self.system, AVAILABLE_MODES, 1, (index,), lambda msg: index in (0, msg.mode_index))

    def _on_mode(self, msg: Any) -> None:
        if self._count != msg.number_modes:
            self._count = msg.number_modes
            self._by_index.clear()
        selectable = not msg.properties & NOT_USER_SELECTABLE
        self._by_index[msg.mode_index] = Mode(msg.mode_name, msg.custom_mode, msg.standard_mode, selectable)
        self.modes = {mode.custom_mode: mode for _, mode in sorted(self._by_index.items())}
