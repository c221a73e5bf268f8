"""The simplest companion: one script, gone through to its end, without a camera.

Scripted(lambda onboard: up_and_down(onboard, 5.0))
"""

from collections.abc import Callable, Sequence

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.statustext import CRITICAL, INFO, WARNING
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.companion import Event, Outgoing, Status
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.feeds import Ranges
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced
from sitl_emu.missions.companion.steps import StepFailed


class Scripted:
    """A companion whose outcome is "success" at its script's end, else what the step that failed says.

    The script rests while a pilot or a failsafe has the vehicle; if it is disarmed then, that is the outcome.
    """

    def __init__(self, script: Callable[[Onboard], Script], role: int = 0) -> None:
        """`script` makes the script for an `Onboard`; `role` is told to the peers."""
        self.onboard = Onboard(role=role)
        self._script: Script | None = script(self.onboard)
        self._outcome = ""
        self._flew = False

    @property
    def system_id(self) -> int:
        """MAVLink system of the vehicle."""
        return self.onboard.system_id

    @property
    def status(self) -> Status:
        """Where it stands."""
        done = self._script is None
        return Status(self.onboard.shown_phase, float(done), done, self._outcome, self.onboard.text)

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """A message came in."""
        return self.onboard.on_message(now_us, link, msg)[1]

    def on_ranges(self, now_us: int, ranges: Ranges) -> Outgoing:
        """A depth image or a scan: the script finds it in `Onboard.depth`, `Onboard.cloud`."""
        self.onboard.on_ranges(ranges)
        return []

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on with the script, unless a pilot or a failsafe has the vehicle."""
        taken = self.onboard.watch_pilot(now_us)
        self._flew |= self.onboard.telemetry.armed
        if self._script is not None and not taken:
            try:
                self._script = advanced(self._script)
                if self._script is None:
                    self._end("success")
            except StepFailed as failure:
                self.onboard.say(f"Mission: {failure}", CRITICAL)
                self._end(str(failure))
        elif self._script is not None and self._flew and not self.onboard.telemetry.armed:
            self._end(self.onboard.taken_by)
        return self.onboard.on_time(now_us)

    def wants_frame(self, frame_time_us: int) -> float | None:
        """None: it has no camera."""
        return None

    def detect(self, image: Image, gsd_m: float) -> Sequence[Detection]:
        """Nothing."""
        return ()

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[Detection]) -> Outgoing:
        """Nothing."""
        return []

    def events(self) -> list[Event]:
        """The events since the last call."""
        return self.onboard.events()

    def _end(self, outcome: str) -> None:
        self._script, self._outcome = None, outcome
        self.onboard.enter("done", outcome)
        self.onboard.say(f"Mission ended: {outcome}", INFO if outcome == "success" else WARNING)
