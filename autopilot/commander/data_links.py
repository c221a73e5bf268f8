"""Ground station and components whose heartbeats the commander follows: who has gone, and who is back.

PX4's Commander::dataLinkCheck (v1.18), before the arming checks. Its links tell of a heartbeat for a while
(`HEARTBEAT_TOLD_US`); from the last time on COM_DL_LOSS_T counts for a ground station, 5 s for a mission computer and 3
s for others. Who never was there is not missed, and traffic avoidance only with COM_ARM_TRAFF.
"""

from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import HEARTBEAT_TOLD_US, Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import GcsHeartbeats, Topics

MISSION_COMPUTER_US: Final = 5_000_000
OTHERS_US: Final = 3_000_000


class Component(NamedTuple):
    """What is said of one; where there is no event, there is none in PX4."""

    heard: str
    """Its field of GcsHeartbeats."""
    timeout_us: int
    lost: tuple[str, str]
    regained: tuple[str, str]
    wanted: str = ""
    """The parameter that has it missed; "" is always."""


COMPONENTS = (
    Component(
        "onboard_us",
        MISSION_COMPUTER_US,
        ("Connection to mission computer lost\t", "commander_mission_comp_lost"),
        ("Onboard controller regained\t", "commander_onboard_ctrl_regained"),
    ),
    Component(
        "parachute_us",
        OTHERS_US,
        ("Parachute system lost\t", ""),
        ("Parachute system regained\t", "commander_parachute_regained"),
    ),
    Component(
        "open_drone_id_us",
        OTHERS_US,
        ("Remote ID system lost\t", "commander_remote_id_lost"),
        ("Remote ID system regained\t", "commander_open_drone_id_regained"),
    ),
    Component(
        "adsb_us",
        OTHERS_US,
        ("Traffic avoidance system lost\t", "commander_traffic_avoidance_lost"),
        ("Traffic avoidance system regained\t", "commander_traffic_avoidance_regained"),
        wanted="COM_ARM_TRAFF",
    ),
)


class DataLinks:
    """Tells losses and returns, each once."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say) -> None:
        """`say` tells the ground."""
        self._topics, self._parameters, self._say = topics, parameters, say
        self._gcs_lost, self._gcs_heard_us = True, 0
        self.gcs_losses = 0
        """How often the ground station was lost."""
        self._lost: set[str] = set()

    def update(self, now_us: int) -> bool:
        """Every cycle; whether somebody has gone or come back, which the checks are to see at once."""
        heartbeats = self._topics.gcs_heartbeats
        changed = self._watch_ground_station(now_us, heartbeats.gcs_us)
        for component in COMPONENTS:
            heard_us = getattr(heartbeats, component.heard)
            lost = heard_us > 0 and now_us - heard_us > component.timeout_us + HEARTBEAT_TOLD_US
            if lost is (component.heard in self._lost):
                continue
            if lost and component.wanted and not self._parameters[component.wanted]:
                continue
            self._lost ^= {component.heard}
            changed = True
            if lost:
                self._say(Severity.CRITICAL, *component.lost)
            else:
                self._say(Severity.INFO, *component.regained)
        return changed

    def _watch_ground_station(self, now_us: int, heard_us: int) -> bool:
        lost = gcs_is_lost(now_us, heard_us, int(self._parameters["COM_DL_LOSS_T"] * 1e6))
        heard_before, self._gcs_heard_us = self._gcs_heard_us > 0, heard_us
        if lost is self._gcs_lost:
            return False
        self._gcs_lost = lost
        if lost:
            self.gcs_losses += 1
            self._say(Severity.INFO, "Connection to ground station lost\t", "commander_gcs_lost")
        elif heard_before:
            self._say(Severity.INFO, "GCS connection regained\t", "commander_dl_regained")
        return True


def gcs_is_lost(now_us: int, heard_us: int, timeout_us: int) -> bool:
    """Whether a ground station counts as lost, as one does that was never there."""
    return heard_us == 0 or now_us - heard_us > timeout_us + HEARTBEAT_TOLD_US


def present(now_us: int, heard_us: int) -> bool:
    """Whether a component other than a mission computer is there."""
    return heard_us > 0 and now_us - heard_us <= OTHERS_US + HEARTBEAT_TOLD_US


def present_and_healthy(now_us: int, heard: GcsHeartbeats) -> tuple[bool, bool, bool, bool, bool]:
    """Remote ID is there, and well; a parachute is there, and well; traffic avoidance is there."""
    remote_id, parachute = present(now_us, heard.open_drone_id_us), present(now_us, heard.parachute_us)
    return (
        remote_id,
        remote_id and heard.open_drone_id_healthy,
        parachute,
        parachute and heard.parachute_healthy,
        present(now_us, heard.adsb_us),
    )
