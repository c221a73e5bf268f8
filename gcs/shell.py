"""MAVLink shell, the ground station's half: one command line, and what it prints.

Source: https://mavlink.io/en/messages/common.html#SERIAL_CONTROL: device SHELL; 70 bytes a message; the flag RESPOND
opens a shell, a message without it closes the shell. Nothing is acknowledged: what is lost stays lost, and a
command whose prompt does not come ends by time-out.
"""

from sitl_emu.core import dialect as mavlink

DEVICE_SHELL = 10
REPLY, RESPOND, EXCLUSIVE, MULTI = 1, 2, 4, 16
DATA_BYTES = 70
PROMPT = "pxh> "
QUIET_LIMIT_US = 5_000_000
"""Without output for so long, a command counts as failed."""


def typed(text: str) -> list[mavlink.MAVLink_message]:
    """The messages that type a text (line feed ends a line); empty for an empty text."""
    data = text.encode()
    return [_message(data[at : at + DATA_BYTES], RESPOND | EXCLUSIVE | MULTI) for at in range(0, len(data), DATA_BYTES)]


def closing() -> mavlink.MAVLink_message:
    """The message that closes the shell."""
    return _message(b"", 0)


def printed(msg: mavlink.MAVLink_message) -> str:
    """What the shell printed with this message; "" for any other message."""
    if msg.get_type() != "SERIAL_CONTROL" or msg.device != DEVICE_SHELL or not msg.flags & REPLY:
        return ""
    return bytes(msg.data[: min(msg.count, DATA_BYTES)]).decode(errors="replace")


class ShellCommand:
    """Runs one line in the autopilot's shell; `output` is what it printed, without echo and prompt."""

    def __init__(self, line: str) -> None:
        """`line` without its end."""
        self.done = False
        self.failed = False
        """The prompt did not come."""
        self.output = ""
        self._line = line
        self._heard = ""
        self._heard_us = -1

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Collects what is printed until the prompt comes back."""
        text = printed(msg)
        if text and not self.done and self._heard_us >= 0:
            self._heard += text
            self._heard_us = now_us
            if self._heard.endswith("\n" + PROMPT):
                self._end()
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Types the line on the first call."""
        if self._heard_us < 0:
            self._heard_us = now_us
            return typed(self._line + "\n")
        if not self.done and now_us - self._heard_us > QUIET_LIMIT_US:
            self.failed = True
            self._end()
        return []

    def _end(self) -> None:
        self.done = True
        self.output = self._heard.partition("\n")[2].removesuffix(PROMPT)


def _message(data: bytes, flags: int) -> mavlink.MAVLink_message:
    return mavlink.MAVLink_serial_control_message(
        DEVICE_SHELL, flags, 0, 0, len(data), list(data.ljust(DATA_BYTES, b"\0"))
    )
