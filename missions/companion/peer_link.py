"""The MAVLink link to the other vehicles' companions.

Each companion sends its HEARTBEAT (type ONBOARD_CONTROLLER, component 191, in `custom_mode` its role, a number that its
mission knows) and, for its autopilot, HEARTBEAT and GLOBAL_POSITION_INT once a second, so that a peer knows who is
there, what for, and where. A peer that was silent for
`lost_after_us` (20 s) is taken for lost: with 30 % loss each way and two messages a second, chance makes that silence
once in 10^20. Whatever else peers say is addressed to the other's companion, component 191 (`router.py`).

All that is in the clear. A mission that seals what it says (`swarm/`) sends none of it (`Onboard`, `is_open`).
"""

from typing import NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.companion import COMPONENT_ID, PEER_LINK, Outgoing

LOST_AFTER_US = 20_000_000
SHARE_PERIOD_US = 1_000_000
SHARED = frozenset({"HEARTBEAT", "GLOBAL_POSITION_INT"})
MAV_TYPE_ONBOARD_CONTROLLER = 18


class PeerPlace(NamedTuple):
    """Where a peer's autopilot said it was."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


class Peer:
    """What is known of one other system."""

    def __init__(self, system: int) -> None:
        self.system = system
        self.heard_us = 0
        self.mav_type = 0
        """MAV_TYPE of its autopilot, 0 until that was heard."""
        self.role = 0
        """What its companion says that it is there for; 0: nothing, or it was not heard."""
        self.place: PeerPlace | None = None


class PeerLink:
    """Hears the peers, and tells them of our vehicle."""

    def __init__(self, lost_after_us: int = LOST_AFTER_US) -> None:
        self.lost_after_us = lost_after_us
        self.peers: dict[int, Peer] = {}
        self._shared_us: dict[str, int] = {}

    def heard(self, now_us: int, msg: mavlink.MAVLink_message) -> None:
        """A message came in on the peer link."""
        system = msg.get_srcSystem()
        peer = self.peers.get(system)
        if peer is None:
            peer = self.peers[system] = Peer(system)
        peer.heard_us = now_us
        kind = msg.get_type()
        if msg.get_srcComponent() == COMPONENT_ID:
            if kind == "HEARTBEAT":
                peer.role = msg.custom_mode
        elif kind == "HEARTBEAT":
            peer.mav_type = msg.type
        elif kind == "GLOBAL_POSITION_INT":
            peer.place = PeerPlace(msg.lat * 1e-7, msg.lon * 1e-7, msg.alt * 1e-3)

    def with_role(self, role: int) -> list[Peer]:
        """The peers that were heard to have a role, by system."""
        return [peer for _, peer in sorted(self.peers.items()) if peer.role == role]

    def forget(self, system: int) -> None:
        """What was known of a peer is no longer so: it counts again when it is heard again."""
        self.peers.pop(system, None)

    def lost(self, now_us: int, system: int | None, since_us: int) -> bool:
        """True when a peer that is needed since `since_us` has been silent for too long; None: any."""
        peer = self.peers.get(system) if system is not None else None
        return now_us - max(since_us, peer.heard_us if peer is not None else 0) > self.lost_after_us

    def share(self, now_us: int, msg: mavlink.MAVLink_message) -> Outgoing:
        """What a message of our own autopilot makes us tell the peers: some, once a second each."""
        kind = msg.get_type()
        if kind not in SHARED or now_us - self._shared_us.get(kind, -SHARE_PERIOD_US) < SHARE_PERIOD_US:
            return []
        self._shared_us[kind] = now_us
        return [(PEER_LINK, msg)]
