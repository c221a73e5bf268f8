"""Traffic avoidance: which of the aircraft nearby come too close, what is said of them, and what is done.

PX4's AdsbConflict (src/lib/adsb, v1.18) and Navigator::check_traffic. An aircraft is in conflict when the vehicle lies
within NAV_TRAFF_A_HOR of its track and within NAV_TRAFF_A_VER of its height, and both together are fast enough to meet
within NAV_TRAFF_COLL_T. NAV_TRAFF_AVOID says what follows: 0 nothing, 1 a warning, 2 Return, 3 Land; 4 (Hold) is a
command that PX4's commander does not know, so that the warning is all. Ten aircraft are told apart.

Once it has returned because of traffic, every return goes to its height first, also one from above it.
"""

import math

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import SendEvent
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import TransponderReport, VehicleCommand, queue_transponder_report
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import MapProjection, bearing_rad, distance_m, wrap_pi

NEEDED = (
    mavlink.ADSB_FLAGS_VALID_COORDS
    | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    | mavlink.ADSB_FLAGS_VALID_HEADING
    | mavlink.ADSB_FLAGS_VALID_VELOCITY
)
"""A report without these is passed over."""
MOST_CONFLICTS = 10
REMIND_AFTER_US = 60_000_000
FORGET_AFTER_US = 120_000_000
BUFFER_FULL_PAUSE_US = 60_000_000
TRACK_BEYOND_M = 1000.0
"""The track of an aircraft is looked at so far beyond the vehicle."""
SHORTEST_TRACK_M = 0.1
WARNINGS = {
    1: "navigator_traffic",
    2: "navigator_traffic_rtl",
    3: "navigator_traffic_land",
    4: "navigator_traffic_hold",
}
"""By NAV_TRAFF_AVOID."""
RETURNS = 2
ACTIONS = {2: mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, 3: mavlink.MAV_CMD_NAV_LAND, 4: mavlink.MAV_CMD_NAV_LOITER_UNLIM}


EMPTY_REPORT = TransponderReport(0, 0, 0, 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0, b"", 0, 0, 0, 0, retranslate=False)
"""What PX4's traffic avoidance begins with (AdsbConflict.h): nothing of it is valid, as its flags say."""


class Traffic:
    """Reads transponder_reports, one in a cycle as PX4 does."""

    def __init__(self, state: NavigatorState, send_event: SendEvent) -> None:
        """What it does goes to the commander through `state`; `send_event` tells ground stations."""
        self._state = state
        self._send_event = send_event
        queue_transponder_report(state.topics, EMPTY_REPORT)
        self._seen = 0
        self._conflicts: dict[int, int] = {}
        """By ICAO address: when it was last warned of."""
        self._was_full = False
        self._told_full_us = 0

    @property
    def conflicts(self) -> list[int]:
        """ICAO addresses of the aircraft in conflict, the first one first."""
        return list(self._conflicts)

    def update(self) -> None:
        """Every cycle of the navigator; next to nothing while there is no traffic."""
        reports = self._state.topics.transponder_reports
        if not reports:
            return
        report = next((report for report in reports if report.number > self._seen), None)
        if report is not None:
            self._seen = report.number
            if report.flags & NEEDED == NEEDED:
                self._take(report)
        if self._conflicts:
            self._forget()

    def _take(self, report: TransponderReport) -> None:
        now_us, icao_address, conflicts = self._state.now_us, report.icao_address, self._conflicts
        separation_m = self._separation_m(report)
        warned_us = conflicts.get(icao_address)
        full = separation_m is not None and warned_us is None and len(conflicts) >= MOST_CONFLICTS
        if full:
            if not self._was_full and now_us - self._told_full_us > BUFFER_FULL_PAUSE_US:
                self._send_event("buffer_full", Severity.NOTICE)
                self._told_full_us = now_us
        elif separation_m is None:
            if warned_us is not None:
                del conflicts[icao_address]
                self._send_event("navigator_traffic_resolved", Severity.NOTICE, icao_address)
        elif warned_us is None or now_us > warned_us + REMIND_AFTER_US:
            conflicts[icao_address] = now_us
            self._warn(report, separation_m)
        self._was_full = full

    def _separation_m(self, report: TransponderReport) -> float | None:
        """How far from the aircraft's track the vehicle is; None if they do not come too close."""
        state, settings = self._state, self._state.settings
        position, local = state.position, state.topics.vehicle_local_position
        away_m = distance_m(position.lat, position.lon, report.lat, report.lon)
        above_m = abs(position.alt - report.altitude)
        speed_m_s = math.hypot(report.hor_velocity, report.ver_velocity) + math.hypot(local.vx, local.vy, local.vz)
        soon = math.hypot(away_m, above_m) < speed_m_s * settings.nav_traff_coll_t_s
        if not soon or above_m >= settings.nav_traff_a_ver_m:
            return None
        track_m = away_m + TRACK_BEYOND_M
        end = MapProjection(report.lat, report.lon).reproject(
            track_m * math.cos(report.heading), track_m * math.sin(report.heading)
        )
        to_end_m = distance_m(position.lat, position.lon, *end)
        off_rad = wrap_pi(bearing_rad(report.lat, report.lon, *end) - bearing_rad(position.lat, position.lon, *end))
        if to_end_m < SHORTEST_TRACK_M or abs(off_rad) > 0.5 * math.pi:
            return None
        separation_m = abs(to_end_m * math.sin(off_rad))
        return separation_m if separation_m < settings.nav_traff_a_hor_m else None

    def _warn(self, report: TransponderReport, separation_m: float) -> None:
        avoid = self._state.settings.nav_traff_avoid
        if avoid not in WARNINGS:
            return
        heading_deg = math.degrees(report.heading)
        self._send_event(WARNINGS[avoid], Severity.NOTICE, report.icao_address, separation_m, heading_deg)
        if avoid == RETURNS:
            self._state.return_alt_enforced = True
        if avoid in ACTIONS:
            self._state.command(VehicleCommand(ACTIONS[avoid], *(0.0,) * 7))

    def _forget(self) -> None:
        now_us = self._state.now_us
        for icao_address in [address for address, us in self._conflicts.items() if now_us - us > FORGET_AFTER_US]:
            del self._conflicts[icao_address]
            self._send_event("navigator_traffic_expired", Severity.NOTICE, icao_address)
