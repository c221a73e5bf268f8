"""Whether a failsafe has the vehicle, and which: how to tell it from a pilot on the wire of a real PX4.

Sources, PX4 v1.18: while a failsafe acts, `vehicle_status.failsafe` is set and HEARTBEAT.system_status of the armed
vehicle is CRITICAL (mavlink/streams/HEARTBEAT.hpp); after a pilot's change of mode it is ACTIVE, also where that ended
a failsafe (user takeover, commander/failsafe/framework.cpp). Why a failsafe acts is in the events
`commander_failsafe_enter…` (FailsafeBase::notifyUser): their first argument is the mode that was asked for, the second
what is done, the last PX4's failsafe_cause_t (src/lib/events/enums.json). A geofence or a lost offboard signal has
cause "generic" there, and is told by an event of the health and arming checks, which PX4 reports again, all of them,
when a failsafe begins (seen on a PX4 v1.18 SIH: a geofence and a silent ground station, 12 ms before the failsafe's
event).

A terminated vehicle is FLIGHT_TERMINATION whoever did it, and goes on to show the mode that was asked for last
(vehicle_status.nav_state_display, Commander.cpp): only where that is no termination, a failsafe did it, and its event
tells so. A kill switch looks alike, and has no such event.
"""

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.event import Event, EventReceiver

CAUSES = {
    1: "manual control lost",
    2: "ground station lost",
    3: "low battery",
    4: "critical battery",
    5: "emergency battery",
    6: "low flight time",
}
"""failsafe_cause_t; 0 is generic."""
ENTERED = {26528394: 5, 30481910: 7, 31382480: None, 21279712: None, 29547634: None}
"""Events of a failsafe that acts, by id: where in their arguments failsafe_cause_t lies, None if they have none.

They are commander_failsafe_enter (mode uint32, action uint8, cause), …_hold (mode uint32, action uint8, delay uint16,
cause), …_generic, …_generic_hold and …_autopilot_disengaged.
"""
FENCE_VIOLATED = frozenset({16920235, 30700832, 20842799})
"""check_gf_violation_custom_gf, …_max_alt, …_max_hor_dist."""
OFFBOARD_LOST = 28241790
"""check_modes_offboard_signal_lost, which is told of every vehicle that nobody steers by setpoints."""
OFFBOARD = 6 << 16
NEAR_MS = 3_000
"""So far apart a failsafe and the check that it is about may be told: PX4 reports its checks right after it told of a
failsafe, or up to 2 s before (HealthAndArmingChecks)."""
UNKNOWN = "cause unknown"
TERMINATE, TERMINATION = 10, 10 << 16
"""failsafe_action_t, and the custom mode of a vehicle that was asked to terminate its flight."""
CRITICAL = mavlink.MAV_STATE_CRITICAL
RESTARTED = frozenset({mavlink.MAV_STATE_UNINIT, mavlink.MAV_STATE_BOOT, mavlink.MAV_STATE_STANDBY})
"""What a terminated autopilot, armed or not, is only after a reboot."""


class FailsafeWatch:
    """Hears an autopilot's HEARTBEAT and events. Hand it what the autopilot sends, and the time."""

    def __init__(self, system: int) -> None:
        self.active = False
        """Whether a failsafe has the vehicle, by its last heartbeat."""
        self.terminated = False
        """Whether one has ended the flight for good: the mode that is shown does not tell."""
        self._events = EventReceiver(system)
        self._source = (system, 1)
        self._entered: Event | None = None
        """The last event of the failsafe that acts."""
        self._cause = ""
        """What its events have said of the cause so far.

        A failsafe that waits in Hold tells its action in a second event, without the checks again: the first counts.
        """
        self._fence_ms: int | None = None
        """When a violated fence was last told, by the autopilot's clock;"""
        self._offboard_ms: int | None = None
        """the same of a missing offboard signal."""

    @property
    def cause(self) -> str:
        """Why, for people; "cause unknown" where the autopilot did not say."""
        return self._cause or UNKNOWN

    def _cause_of(self, event: Event) -> str:
        """What one event says of the cause, "" if nothing."""
        at = ENTERED[event.id]
        if at is not None and event.arguments[at] in CAUSES:
            return CAUSES[event.arguments[at]]
        if _near(self._fence_ms, event):
            return "geofence"
        if _near(self._offboard_ms, event) and int.from_bytes(event.arguments[:4], "little") == OFFBOARD:
            return "offboard signal lost"
        return ""

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Takes a message; returns requests for events that were lost."""
        if (msg.get_srcSystem(), msg.get_srcComponent()) != self._source:
            return []
        if msg.get_type() == "HEARTBEAT":
            self.terminated &= msg.system_status not in RESTARTED
            acts = msg.system_status == CRITICAL or self.terminated
            if self.active and not acts:
                self._entered, self._cause = None, ""
            self.active = acts
        asked = self._events.on_message(now_us, msg)
        for event in self._events.take():
            self._take(event)
        return asked

    def _take(self, event: Event) -> None:
        if event.id in ENTERED:
            self._entered, self._cause = event, self._cause if self.active else ""
            mode, action = int.from_bytes(event.arguments[:4], "little"), event.arguments[4]
            self.terminated |= action == TERMINATE and mode != TERMINATION
        elif event.id in FENCE_VIOLATED:
            self._fence_ms = event.time_boot_ms
        elif event.id == OFFBOARD_LOST:
            self._offboard_ms = event.time_boot_ms
        if self._entered is not None:
            self._cause = self._cause_of(self._entered) or self._cause


def _near(told_ms: int | None, event: Event) -> bool:
    return told_ms is not None and abs(told_ms - event.time_boot_ms) <= NEAR_MS
