"""An autopilot's shell without MAVLink."""

from pathlib import Path

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.parameters import Value
from sitl_emu.autopilot.shell.commands import COMMANDS
from sitl_emu.autopilot.shell.pxh import Pxh

TICK_US = 4_000


class Console:
    """An autopilot that stands, and its shell without MAVLink."""

    def __init__(self, model: str = "iris", root: Path | None = None, **parameters: Value) -> None:
        """`parameters` are others than the airframe's."""
        self.autopilot = Autopilot({**vehicles.load(model).airframe, **parameters}, 0, root)
        self.pxh = Pxh(COMMANDS, self.autopilot)

    def type(self, text: str) -> str:
        """What is printed for a line, echo and prompt included; time passes as long as the command runs."""
        self.pxh.write(text.encode())
        printed = ""
        for _ in range(2000):
            self.pxh.run()
            printed += self.pxh.read(1 << 20).decode()
            if printed.endswith("pxh> "):
                break
            self.autopilot.now_us += TICK_US
        return printed

    def output(self, line: str) -> str:
        """The same without echo and prompt."""
        printed = self.type(line + "\n")
        assert printed.startswith(line + "\n") and printed.endswith("pxh> "), printed
        return printed[len(line) + 1 : -len("pxh> ")]
