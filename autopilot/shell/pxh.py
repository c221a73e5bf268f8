"""One shell, as PX4 gives one to each MAVLink link (POSIX: Pxh::run_remote_pxh).

Bytes come in, bytes go out. Every printable byte is echoed; a line feed runs the line and prints the prompt. There is
no line editing and no history here, as there is none in PX4's remote shell: a backspace is a character like any other.
Bytes up to 3 and from 128 on are ignored. While a command runs, input waits.

Bounded where PX4 blocks: input beyond INPUT_BYTES is dropped, a line keeps LINE_CHARACTERS, and no further line is run
while OUTPUT_BYTES wait to be read.
"""

from collections.abc import Iterator, Mapping

from sitl_emu.autopilot.shell.command import WAIT, Command, Output, Vehicle

PROMPT = "pxh> "
LINE_FEED = 10
LAST_IGNORED = 3
FIRST_NEGATIVE = 128
"""C's char is signed on a PC, so that PX4 takes bytes from here on for less than LAST_IGNORED."""
INPUT_BYTES = 65536
OUTPUT_BYTES = 65536
LINE_CHARACTERS = 1024


class Pxh:
    """Reads lines and runs them as commands of the autopilot."""

    def __init__(self, commands: Mapping[str, Command], vehicle: Vehicle) -> None:
        """`commands` by name."""
        self._commands = commands
        self._vehicle = vehicle
        self._input = bytearray()
        self._output = bytearray()
        self._line = ""
        self._name = ""
        self._running: Output | None = None

    def write(self, data: bytes) -> None:
        """Somebody typed."""
        self._input += data[: INPUT_BYTES - len(self._input)]

    def print(self, text: str) -> None:
        """Something else on the autopilot's console."""
        if len(self._output) < OUTPUT_BYTES:
            self._output += text.encode(errors="replace")

    def read(self, most: int) -> bytes:
        """Take what was printed, at most so many bytes."""
        taken = bytes(self._output[:most])
        del self._output[:most]
        return taken

    @property
    def idle(self) -> bool:
        """No command is under way, and nothing was typed."""
        return self._running is None and not self._input

    def run(self) -> None:
        """Go on with the command under way and with what was typed, as far as they go now."""
        while True:
            if self._running is not None and not self._go_on():
                return
            if len(self._output) >= OUTPUT_BYTES or not self._input:
                return
            self._take_input()

    def _take_input(self) -> None:
        """Echo what was typed up to the end of a line, and start what that line says."""
        end = self._input.find(LINE_FEED)
        typed = self._input if end < 0 else self._input[:end]
        text = bytes(c for c in typed if LAST_IGNORED < c < FIRST_NEGATIVE).decode("ascii")
        del self._input[: len(typed) if end < 0 else end + 1]
        self._output += text.encode()
        self._line = (self._line + text)[:LINE_CHARACTERS]
        if end >= 0:
            self._output += b"\n"
            line, self._line = self._line, ""
            self._running = self._start(line.split())

    def _start(self, words: list[str]) -> Output:
        if not words or words[0].startswith("#"):
            return _nothing()
        self._name = words[0]
        if self._name == "help":
            return self._help()
        command = self._commands.get(self._name)
        if command is None:
            return _invalid(self._name)
        return command(self._vehicle, words[1:])

    def _go_on(self) -> bool:
        """Whether the command has ended."""
        assert self._running is not None
        try:
            for text in _until_wait(self._running):
                self._output += text.encode(errors="replace")
        except _Ended as ended:
            self._running = None
            if ended.status:
                self._output += f"Command '{self._name}' failed, returned {ended.status}.\n".encode()
            self._output += PROMPT.encode()
            return True
        return False

    def _help(self) -> Output:
        yield "Builtin Commands:\n"
        for name in sorted(self._commands):
            yield f"  {name}\n"
        return 0


class _Ended(Exception):
    def __init__(self, status: int) -> None:
        self.status = status


def _until_wait(output: Output) -> Iterator[str]:
    """What a command prints before it waits; raises _Ended when it has come to its end."""
    while True:
        try:
            text = next(output)
        except StopIteration as stop:
            raise _Ended(stop.value or 0) from None
        if text == WAIT:
            return
        yield text


def _nothing() -> Output:
    yield from ()
    return 0


def _invalid(name: str) -> Output:
    yield f"Invalid command: {name}\ntype 'help' for a list of commands\n"
    return 0
