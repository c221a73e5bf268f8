"""To a place, and to a standstill there: on wheels or in the air."""

import math
from collections.abc import Callable

from sitl_emu.gcs.command import reposition
from sitl_emu.gcs.geodesy import distance_m
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.steps.commanding import StepFailed, command

STILL_M_S = 0.15
STILL_S = 1.5
"""So slow for so long is standing: a GNSS receiver's velocity is that noisy, and a turn on the way is shorter."""

STUCK_S, STUCK_M = 20.0, 2.0
"""Who is under way and comes no farther in so long does not fly: no waypoint is approached at 0.1 m/s, and what a
receiver's place drifts by in that time is less (0.3 m of one sigma of ours). Ours."""

LatLon = tuple[float, float]
"""Degrees."""


class Motion:
    """Whether who is under way moves: one that has crashed may talk on, armed and in its mode."""

    def __init__(self) -> None:
        self._from_m: tuple[float, ...] = ()
        self._since_us = 0

    def is_stuck(self, now_us: int, place_m: tuple[float, float, float]) -> bool:
        """Whether it has been there for long, by its place of now."""
        if not self._from_m or math.dist(place_m, self._from_m) > STUCK_M:
            self._from_m, self._since_us = place_m, now_us
        return now_us - self._since_us > STUCK_S * 1e6


def pause(onboard: Onboard, duration_s: float, until: Callable[[], bool] = lambda: False) -> Script:
    """For a while, or until something is so."""
    since_us = onboard.own_us
    while onboard.own_us - since_us < duration_s * 1e6 and not until():
        yield


def until_standing(
    onboard: Onboard,
    lat_deg: float,
    lon_deg: float,
    within_m: float,
    timeout_s: float,
    still_m_s: float = STILL_M_S,
    last_item: int = 0,
) -> Script:
    """Until the vehicle has stood for a while near a place.

    Where it drives there by a mission, it holds by itself when it has reached the `last_item`: Hold is then expected.
    """
    telemetry = onboard.telemetry
    began_us = still_since_us = onboard.own_us
    while onboard.own_us - still_since_us < STILL_S * 1e6:
        place = telemetry.place
        away_m = distance_m(place.lat_deg, place.lon_deg, lat_deg, lon_deg) if place is not None else math.inf
        if telemetry.speed_m_s > still_m_s or away_m > within_m:
            still_since_us = onboard.own_us
        if onboard.own_us - began_us > timeout_s * 1e6:
            raise StepFailed(f"{away_m:.1f} m from the waypoint after {timeout_s:.0f} s")
        if not telemetry.armed:
            raise StepFailed("disarmed on the way")
        reached = telemetry.mission_reached
        if reached is not None and reached >= last_item and "mission" in onboard.yielding.expected:
            onboard.yielding.expect({"mission", "hold"})
        yield


def go_to(
    onboard: Onboard,
    lat_deg: float,
    lon_deg: float,
    alt_amsl_m: float,
    within_m: float,
    timeout_s: float,
    still_m_s: float = STILL_M_S,
) -> Script:
    """To a place in Hold (MAV_CMD_DO_REPOSITION), until the vehicle stands there.

    Who gives the vehicle back does so by Hold, in which it stays where that was chosen: it is sent there once more.
    """
    given_back = None
    while given_back != onboard.given_back:
        given_back = onboard.given_back
        yield from command(onboard, reposition(onboard.system_id, lat_deg, lon_deg, alt_amsl_m), "reposition")
        onboard.yielding.expect({"hold"})
        for _ in until_standing(onboard, lat_deg, lon_deg, within_m, timeout_s, still_m_s):
            yield
            if onboard.given_back != given_back:
                break


def centre(
    onboard: Onboard,
    target: Callable[[], LatLon | None],
    alt_amsl_m: float,
    within_m: float,
    timeout_s: float,
    still_m_s: float = STILL_M_S,
) -> Script:
    """Over a target whose place is known better with every look: until the vehicle stands over its latest estimate.

    `target` gives that estimate, None when it is lost. The vehicle is sent on when the estimate has moved by half of
    `within_m` since it was sent last.
    """
    began_us = still_since_us = onboard.own_us
    sent: LatLon | None = None
    given_back = onboard.given_back
    while sent is None or onboard.own_us - still_since_us < STILL_S * 1e6:
        wanted = target()
        if wanted is None:
            raise StepFailed("the target is lost")
        if sent is None or onboard.given_back != given_back or distance_m(*sent, *wanted) > within_m / 2.0:
            given_back = onboard.given_back
            onboard.yielding.expect(())
            yield from command(onboard, reposition(onboard.system_id, *wanted, alt_amsl_m), "reposition")
            onboard.yielding.expect({"hold"})
            sent, still_since_us = wanted, onboard.own_us
        place = onboard.telemetry.place
        away_m = distance_m(place.lat_deg, place.lon_deg, *wanted) if place is not None else math.inf
        if onboard.telemetry.speed_m_s > still_m_s or away_m > within_m:
            still_since_us = onboard.own_us
        if onboard.own_us - began_us > timeout_s * 1e6:
            raise StepFailed(f"{away_m:.1f} m from the target after {timeout_s:.0f} s")
        if not onboard.telemetry.armed:
            raise StepFailed("disarmed on the way")
        yield
