"""A companion of one's own: a mission in forty lines, on simulated or real hardware.

    sitl-emu launch iris                # in one terminal
    python examples/own_companion.py    # in another

It takes off to 5 m, waits ten seconds and lands; a pilot who chooses another mode takes over at any time. The mission
is a state machine that is told the time: `Onboard` brings telemetry, services, heartbeats and yielding, a script says
what comes after what. Whatever runs the machine gives it sockets and a clock; here that is `fly`.
"""

import sys
from collections.abc import Sequence

from sitl_emu.companion import (
    AUTOPILOT_LINK,
    Event,
    LinkError,
    Onboard,
    Outgoing,
    Script,
    Status,
    advanced,
    arm,
    fly,
    mavlink,
    set_mode,
)

WAIT_US = 10_000_000


class UpAndDown:
    """Takes off, waits, lands."""

    def __init__(self) -> None:
        self.onboard = Onboard()
        self.now_us = 0
        self.phase = "connecting"
        self.script: Script | None = self.mission()

    def mission(self) -> Script:
        """What happens, in order."""
        telemetry = self.onboard.telemetry
        while not telemetry.ready:
            yield
        for self.phase, command in (
            ("mode takeoff", set_mode(telemetry.system, "takeoff")),
            ("arming", arm(telemetry.system)),
        ):
            yield from self.onboard.do(AUTOPILOT_LINK, command)
            if command.outcome is None or not command.outcome.accepted:
                return
        self.onboard.yielding.expect({"takeoff", "hold"})
        self.phase = "climbing"
        while telemetry.mode != "hold":
            yield
        self.phase, since_us = "waiting", self.now_us
        while self.now_us - since_us < WAIT_US:
            yield
        self.phase = "landing"
        yield from self.onboard.do(AUTOPILOT_LINK, set_mode(telemetry.system, "land"))
        self.onboard.yielding.expect({"land", "hold"})
        while telemetry.armed:
            yield
        self.phase = "landed"

    # What a runner calls

    @property
    def system_id(self) -> int:
        """MAVLink system of the vehicle."""
        return self.onboard.system_id

    @property
    def status(self) -> Status:
        """Where it stands."""
        done = self.script is None
        return Status(self.phase, float(done), done, "success" if self.phase == "landed" else "", "")

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """A message came in."""
        return self.onboard.on_message(now_us, link, msg)[1]

    def on_time(self, now_us: int) -> Outgoing:
        """Goes on, unless a pilot has the vehicle."""
        self.now_us = now_us
        if not self.onboard.watch_pilot(now_us):
            self.script = advanced(self.script)
        return self.onboard.on_time(now_us)

    def wants_frame(self, frame_time_us: int) -> float | None:
        """No camera."""
        return None

    def detect(self, image: object, gsd_m: float) -> tuple[()]:
        """No detector."""
        return ()

    def on_detections(self, now_us: int, frame_time_us: int, detections: Sequence[object]) -> Outgoing:
        """Never called."""
        return []

    def events(self) -> list[Event]:
        """Said aloud by the runner."""
        return self.onboard.events()


if __name__ == "__main__":
    try:
        print(fly(UpAndDown(), sys.argv[1] if len(sys.argv) > 1 else "udpin:0.0.0.0:14540").phase)
    except LinkError as error:
        sys.exit(str(error))
