"""MAVLink shell: SERIAL_CONTROL of device SHELL (https://mavlink.io/en/messages/common.html#SERIAL_CONTROL).

As PX4's handle_message_serial_control and handleMavlinkShellOutput: every link has a shell of its own, opened by the
first message and closed by one without the flag RESPOND, whose data are typed all the same, unheard. EXCLUSIVE,
BLOCKING, time-out and baud rate are ignored. What the shell prints goes out 70 bytes a tick, so that telemetry does not
starve, addressed to who typed last.
"""

from collections.abc import Callable
from typing import Any, ClassVar, Final, Protocol

from sitl_emu.autopilot.events.texts import Text, Texts
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core import dialect as mavlink

DATA_BYTES: Final = 70
EVERYTHING = 1 << 30
TARGET_OFFSET: Final = 79
"""Where target_system and target_component stand in the payload: extensions that pymavlink's dialect lacks."""
MAVLINK2_MARKER: Final = 0xFD
MAVLINK2_HEADER_BYTES: Final = 10
AUTOPILOT_COMPONENT: Final = 1
CONSOLE_LEVELS = ("ERROR", "ERROR", "WARN", "WARN", "WARN", "INFO", "INFO", "DEBUG")
"""How the console calls the severities of texts."""


class Console(Protocol):
    """One shell: bytes in, bytes out (autopilot/shell/pxh.py)."""

    @property
    def idle(self) -> bool:
        """No command is under way, and nothing was typed."""
        ...

    def write(self, data: bytes) -> None:
        """Somebody typed."""
        ...

    def print(self, text: str) -> None:
        """Something else on the autopilot's console."""
        ...

    def read(self, most: int) -> bytes:
        """Take what was printed, at most so many bytes."""
        ...

    def run(self) -> None:
        """Go on with the command under way and with what was typed, as far as they go now."""
        ...


class Session:
    """A link's shell, and who typed last."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.partner = (0, 0)


class Shell:
    """The shells of all links."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL})
    HAS_TIMER = True

    def __init__(self, texts: Texts, system_id: int, open_shell: Callable[[], Console] | None) -> None:
        """`open_shell` makes one for a link; None: there are no commands, and nothing is answered."""
        self._open_shell = open_shell
        self._system_id = system_id
        self._sessions: dict[Link, Session] = {}
        self._closed: dict[Link, Console] = {}
        """Shells that were closed and still have something to do, one a link."""
        self._texts = texts
        self._said = texts.count

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Hand what was typed to the link's shell, or close it."""
        respond = message.flags & mavlink.SERIAL_CONTROL_FLAG_RESPOND
        if (
            message.device != mavlink.SERIAL_CONTROL_DEV_SHELL
            or message.flags & mavlink.SERIAL_CONTROL_FLAG_REPLY
            or not self._is_for_us(message)
        ):
            return
        session = self._sessions.get(link)
        if session is None:
            if self._open_shell is None:
                return
            session = self._sessions[link] = Session(self._open_shell())
        if 0 < message.count <= DATA_BYTES:
            session.partner = (message.get_srcSystem(), message.get_srcComponent())
            session.console.write(bytes(message.data[: message.count]))
        if not respond:
            del self._sessions[link]
            self._closed[link] = session.console

    def on_time(self, now_us: int) -> None:
        """Let the shells work, and send at most one message of each."""
        if self._texts.count != self._said:
            self._print_new_texts()
        for link, console in list(self._closed.items()):
            console.run()
            console.read(EVERYTHING)
            if console.idle:
                del self._closed[link]
        for link, session in self._sessions.items():
            session.console.run()
            printed = session.console.read(DATA_BYTES)
            if printed:
                link.send_fields(
                    mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL,
                    0,
                    0,
                    mavlink.SERIAL_CONTROL_DEV_SHELL,
                    mavlink.SERIAL_CONTROL_FLAG_REPLY,
                    len(printed),
                    *printed.ljust(DATA_BYTES, b"\0"),
                    *session.partner,
                )

    def _print_new_texts(self) -> None:
        """An open shell shows the autopilot's console, where texts to the ground appear as well."""
        if self._sessions:
            for text in self._texts.recent:
                if text.number >= self._said:
                    for session in self._sessions.values():
                        session.console.print(_console_line(text))
        self._said = self._texts.count

    def _is_for_us(self, message: Any) -> bool:
        frame = message.get_msgbuf()
        if frame[0] != MAVLINK2_MARKER:
            return True
        target = frame[MAVLINK2_HEADER_BYTES + TARGET_OFFSET : MAVLINK2_HEADER_BYTES + frame[1]]
        system, component = (*target[:2], 0, 0)[:2]
        return system in (0, self._system_id) and component in (0, AUTOPILOT_COMPONENT)


def _console_line(text: Text) -> str:
    return f"{CONSOLE_LEVELS[text.severity]:<5} [{text.module}] {text.text}\n"
