"""Components of this vehicle whose heartbeats the commander follows: who has gone, and who is back.

PX4's Commander::dataLinkCheck (v1.18): a heartbeat counts for 2.5 s, and a while after that (5 s for a mission
computer, 3 s for others) its component is lost. One that never was there is not missed, and traffic avoidance only with
COM_ARM_TRAFF.
"""

from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import GcsHeartbeats

HEARTBEAT_TIMEOUT_US: Final = 2_500_000
LOST_AFTER_US: Final = 3_000_000


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
        5_000_000,
        ("Connection to mission computer lost\t", "commander_mission_comp_lost"),
        ("Onboard controller regained\t", "commander_onboard_ctrl_regained"),
    ),
    Component(
        "parachute_us",
        HEARTBEAT_TIMEOUT_US + LOST_AFTER_US,
        ("Parachute system lost\t", ""),
        ("Parachute system regained\t", "commander_parachute_regained"),
    ),
    Component(
        "open_drone_id_us",
        HEARTBEAT_TIMEOUT_US + LOST_AFTER_US,
        ("Remote ID system lost\t", "commander_remote_id_lost"),
        ("Remote ID system regained\t", "commander_open_drone_id_regained"),
    ),
    Component(
        "adsb_us",
        HEARTBEAT_TIMEOUT_US + LOST_AFTER_US,
        ("Traffic avoidance system lost\t", "commander_traffic_avoidance_lost"),
        ("Traffic avoidance system regained\t", "commander_traffic_avoidance_regained"),
        wanted="COM_ARM_TRAFF",
    ),
)


class ComponentLinks:
    """Tells losses and returns, each once."""

    def __init__(self, parameters: Parameters, say: Say) -> None:
        """`say` tells the ground."""
        self._parameters, self._say = parameters, say
        self._lost: set[str] = set()

    def update(self, now_us: int, heartbeats: GcsHeartbeats) -> None:
        """As often as the checks run."""
        for component in COMPONENTS:
            heard_us = getattr(heartbeats, component.heard)
            lost = heard_us > 0 and now_us - heard_us > component.timeout_us
            if lost and component.wanted and not self._parameters[component.wanted]:
                continue
            if lost is (component.heard in self._lost):
                continue
            self._lost ^= {component.heard}
            if lost:
                self._say(Severity.CRITICAL, *component.lost)
            else:
                self._say(Severity.INFO, *component.regained)


def present(now_us: int, heard_us: int) -> bool:
    """Whether a component other than a mission computer is there."""
    return heard_us > 0 and now_us - heard_us <= HEARTBEAT_TIMEOUT_US + LOST_AFTER_US


def present_and_healthy(now_us: int, heard: GcsHeartbeats) -> tuple[bool, bool, bool, bool, bool]:
    """Remote ID is there, and well; a parachute is there, and well; traffic avoidance is there."""

    def present(last_us: int) -> bool:
        return last_us > 0 and now_us - last_us < HEARTBEAT_TIMEOUT_US + LOST_AFTER_US

    remote_id, parachute = present(heard.open_drone_id_us), present(heard.parachute_us)
    return (
        remote_id,
        remote_id and heard.open_drone_id_healthy,
        parachute,
        parachute and heard.parachute_healthy,
        present(heard.adsb_us),
    )
