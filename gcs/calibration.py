"""Sensor calibration: asks for it and follows what the autopilot tells, side by side, until it is done.

Sources: https://mavlink.io/en/messages/common.html#MAV_CMD_PREFLIGHT_CALIBRATION, and the texts "[cal] …" in which PX4
tells how it goes (the protocol that QGroundControl and MAVSDK follow): started, progress, pending sides, a side
detected and done, and the end: done, failed, cancelled.
"""

import re

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import PREFLIGHT_CALIBRATION, Command
from sitl_emu.gcs.statustext import TextAssembler

PARAMETERS: dict[str, tuple[int, ...]] = {
    "gyro": (1,),
    "mag": (0, 1),
    "baro": (0, 0, 1),
    "accel": (0, 0, 0, 0, 1),
    "level": (0, 0, 0, 0, 2),
    "airspeed": (0, 0, 0, 0, 0, 1),
}
"""param1 on of PREFLIGHT_CALIBRATION, by sensor as PX4 calls it."""
SILENCE_US = 60_000_000
"""A calibration of which nothing is heard for so long has ended badly."""
CANCEL_AGAIN_US = 3_000_000
"""PX4 misses who cancels between two parts of a calibration (calibrate_cancel_check), so it is asked again."""
PROGRESS = re.compile(r"\[cal\] .*progress <(\d+)>")
PENDING = re.compile(r"\[cal\] pending:\s*(.*)")
DETECTED = re.compile(r"\[cal\] (\w+) orientation detected")
FAILED = re.compile(r"\[cal\] calibration failed: (.*)")


class Calibration:
    """One calibration of one autopilot; `instruction` is what to do now, in the autopilot's words."""

    def __init__(self, system: int, sensor: str) -> None:
        """`sensor` is a key of PARAMETERS; raises KeyError for another."""
        self._system = system
        self._command: Command | None = Command(system, 1, PREFLIGHT_CALIBRATION, PARAMETERS[sensor])
        self._texts = TextAssembler()
        self._heard_us: int | None = None
        self._cancelling = False
        self._cancelled_us = 0
        self.sensor = sensor
        self.progress_percent = 0
        self.instruction = ""
        self.pending: tuple[str, ...] = ()
        """Sides on which the vehicle has still to be put: back, front, left, right, up, down."""
        self.side = ""
        """The side that is measured."""
        self.succeeded: bool | None = None
        """None while it runs."""
        self.text = ""
        """How it ended."""

    @property
    def done(self) -> bool:
        """True when it has ended, well or not."""
        return self.succeeded is not None

    def cancel(self) -> None:
        """Ask for its end; it is over when the autopilot says so."""
        if not self.done:
            self._command = Command(self._system, 1, PREFLIGHT_CALIBRATION, (0,))
            self._cancelling = True

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the answer, and the texts of the autopilot."""
        if self.done or msg.get_srcSystem() != self._system:
            return []
        if self._command is not None:
            self._command.on_message(now_us, msg)
            self._look_at_answer(now_us)
        text = self._texts.on_message(msg)
        if text is not None and text.startswith("[cal] "):
            self._heard_us = now_us
            self._follow(text)
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Sends the command, again if nobody answers; gives up on an autopilot that has fallen silent."""
        if self.done:
            return []
        if self._command is not None:
            messages = self._command.on_time(now_us)
            self._look_at_answer(now_us)
            return messages
        if self._cancelling and now_us - self._cancelled_us > CANCEL_AGAIN_US:
            self.cancel()
            return self.on_time(now_us)
        if self._heard_us is not None and now_us - self._heard_us > SILENCE_US:
            self._end(succeeded=False, text="the autopilot says nothing more")
        return []

    def _look_at_answer(self, now_us: int) -> None:
        command = self._command
        if command is None or command.outcome is None:
            return
        self._command, self._heard_us, self._cancelled_us = None, now_us, now_us
        # PX4 rejects the command that cancels, and then the calibration that runs takes it all the same.
        if not command.outcome.accepted and not self._cancelling:
            self._end(succeeded=False, text=command.outcome.text)

    def _follow(self, text: str) -> None:
        if match := PROGRESS.fullmatch(text):
            self.progress_percent = min(100, int(match[1]))
        elif match := PENDING.fullmatch(text):
            self.pending = tuple(match[1].split())
            self.side = ""
        elif match := DETECTED.fullmatch(text):
            self.side = match[1]
        elif text == f"[cal] calibration done: {self.sensor}":
            self.progress_percent = 100
            self._end(succeeded=True, text="done")
        elif match := FAILED.fullmatch(text):
            self._end(succeeded=False, text=match[1])
        elif text == "[cal] calibration cancelled":
            self._end(succeeded=False, text="cancelled")
        elif not text.startswith("[cal] calibration started"):
            self.instruction = text.removeprefix("[cal] ")

    def _end(self, *, succeeded: bool, text: str) -> None:
        self.succeeded, self.text = succeeded, text
