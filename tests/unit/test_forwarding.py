"""Which messages pass from one link to the others: by who they are for, wherever a message says so."""

import struct
from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer, only

COMPANION, STRANGER = 245, 77


class Told(mavlink.MAVLink_timesync_message):
    """A TIMESYNC with its extension, the system and component that asked, which pymavlink leaves out."""

    def __init__(self, system: int, component: int) -> None:
        super().__init__(5, 7)
        self.target = (system, component)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        """As MAVLink 2."""
        payload = struct.pack("<qqBB", self.tc1, self.ts1, *self.target)
        return bytes(self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1))


def sticks(system: int) -> Any:
    return mavlink.MAVLink_manual_control_message(system, 100, 0, 500, 0, 0)


def passes(message: Any) -> bool:
    """Whether it comes out on the onboard link, on which a companion of system 245 was heard."""
    peer = Peer()
    companion = mavlink.MAVLink(None, COMPANION, 191)
    peer.send_bytes(bytes(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3).pack(companion)), ONBOARD)
    peer.send(message, GCS)
    return bool(only(peer.received(ONBOARD), message.get_type()))


@pytest.mark.parametrize(("system", "expected"), [(0, True), (COMPANION, True), (1, False), (STRANGER, False)])
def test_sticks_go_where_their_system_was_heard(system: int, expected: bool) -> None:
    """MANUAL_CONTROL calls its target system `target`."""
    assert passes(sticks(system)) is expected


@pytest.mark.parametrize(
    ("system", "component", "expected"),
    [(0, 0, True), (COMPANION, 191, True), (COMPANION, 0, True), (1, 1, False), (STRANGER, 1, False)],
)
def test_an_answer_to_a_question_for_the_time_goes_to_who_asked(system: int, component: int, expected: bool) -> None:
    assert passes(Told(system, component)) is expected
