"""Links that are lost and regained, as people are told: sticks, ground station, components (PX4's Commander, v1.18)."""

from sitl_emu.autopilot.commander.component_links import ComponentLinks
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics


class LinkWatch:
    """Compares failsafe_flags with what was told last."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send_event: SendEvent) -> None:
        self._topics, self._say, self._send_event = topics, say, send_event
        self._component_links = ComponentLinks(parameters, say)
        self._sticks_lost = True
        self._sticks_seen_us = 0
        self._gcs_ever_lost = self._gcs_lost = False
        self.gcs_losses = 0
        """How often the ground station was lost."""

    def update(self, now_us: int) -> None:
        """After the checks have looked."""
        self._watch_sticks(now_us)
        self._watch_ground_station()
        self._component_links.update(now_us, self._topics.gcs_heartbeats)

    def _watch_sticks(self, now_us: int) -> None:
        lost = self._topics.failsafe_flags.manual_control_signal_lost
        if lost is not self._sticks_lost:
            self._sticks_lost = lost
            if lost:
                self._send_event("commander_rc_lost", Severity.INFO)
            elif self._sticks_seen_us:
                self._send_event("commander_rc_regained", Severity.INFO, (now_us - self._sticks_seen_us) * 1e-6)
        if not lost:
            self._sticks_seen_us = now_us

    def _watch_ground_station(self) -> None:
        lost = self._topics.failsafe_flags.gcs_connection_lost
        if lost is self._gcs_lost:
            return
        self._gcs_lost = lost
        heard_before = self._topics.gcs_heartbeats.gcs_us > 0
        if not lost and self._gcs_ever_lost:
            self._say(Severity.INFO, "GCS connection regained\t", "commander_dl_regained")
        if lost and heard_before:
            self.gcs_losses += 1
            self._say(Severity.INFO, "Connection to ground station lost\t", "commander_gcs_lost")
        self._gcs_ever_lost = heard_before
