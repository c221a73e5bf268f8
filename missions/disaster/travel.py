"""From place to place in Hold (MAV_CMD_DO_REPOSITION): by way of what is found, and over the ground, if so set."""

import math

from sitl_emu.gcs.command import reposition
from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.onboard import Script
from sitl_emu.missions.disaster.flying import HEIGHT_M, Flying

FOLLOW_EVERY_US = 1_000_000
SLOWEST_M_S = 0.5


class Travel:
    """Of one flight."""

    def __init__(self, flight: Flying) -> None:
        self._flight, self._onboard = flight, flight.onboard

    def to(self, to_m: Corner, altitude_m: float, within_m: float, *, aside: bool = False) -> Script:
        """To a place, at an altitude above home; with `altitude: terrain` also clear of what is mapped on the way.

        `aside`: by way of what is found, and over the ground, if so set.
        """
        flight, onboard = self._flight, self._onboard
        sent: tuple[Corner, float] | None = None
        motion, follow_us, wanted = steps.Motion(), 0, (to_m, altitude_m)
        given_back = onboard.given_back
        began_us, limit_s = onboard.now_us, 60.0 + math.dist(flight.here_m, to_m) / SLOWEST_M_S
        while sent is None or not self.is_there(to_m, sent[1], within_m):
            flight.check()
            if onboard.given_back != given_back:  # it holds where it was left, and may be farther away
                given_back, began_us = onboard.given_back, onboard.now_us
                limit_s = 60.0 + math.dist(flight.here_m, to_m) / SLOWEST_M_S
                sent, motion = None, steps.Motion()
            place = flight.due() if aside else None
            if place is not None:
                left_m, left_us = flight.here_m, onboard.now_us
                yield from flight.go_aside(place, left_m)
                began_us += onboard.now_us - left_us
                sent, motion = None, steps.Motion()
            left_us = onboard.now_us
            if (yield from flight.until_clear(to_m)):
                began_us += onboard.now_us - left_us
                sent, motion = None, steps.Motion()
            if flight.settings.altitude == "terrain" and (sent is None or onboard.now_us >= follow_us):
                follow_us = onboard.now_us + FOLLOW_EVERY_US
                yield from flight.clear_return()
                wanted = self._follow(to_m, None if aside else altitude_m)
            if wanted != sent:
                yield from self.send(*wanted)
                sent = wanted
            stuck = motion.is_stuck(onboard.now_us, (*flight.here_m, flight.altitude_m))
            if stuck or onboard.now_us - began_us > limit_s * 1e6:
                why = onboard.silence or "does not move" if stuck else f"under way for {limit_s:.0f} s"
                raise steps.StepFailed(f"{why}, {math.dist(flight.here_m, to_m):.1f} m from a waypoint")
            yield

    def _follow(self, to_m: Corner, hold_m: float | None) -> tuple[Corner, float]:
        """The next waypoint on the way to a place (see `Relief.waypoint`)."""
        flight, speed_m_s = self._flight, self._onboard.telemetry.speed_m_s
        return flight.ground.waypoint(flight.here_m, to_m, speed_m_s, flight.altitude_m, hold_m)

    def send(self, to_m: Corner, altitude_m: float) -> Script:
        """Sends the vehicle on."""
        onboard, home = self._onboard, self._flight.home
        onboard.yielding.expect(())
        speed_m_s = self._flight.settings.scan_speed_m_s
        asked = reposition(onboard.system_id, *self._flight.place_deg(to_m), home[2] + altitude_m, speed_m_s)
        yield from steps.command(onboard, asked, "reposition")
        onboard.yielding.expect({"hold"})

    def is_there(self, to_m: Corner, altitude_m: float, within_m: float) -> bool:
        """Whether the vehicle is at a place, at a height."""
        flight = self._flight
        return math.dist(flight.here_m, to_m) <= within_m and abs(flight.altitude_m - altitude_m) <= HEIGHT_M
