"""Events interface: arming and disarming as EVENTs, and asking for one again.

pymavlink's packaged dialects do not know these messages: their bytes are read and written here.
"""

import struct
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

ARM_DISARM = 400
EVENT, REQUEST_EVENT = "UNKNOWN_410", 412
REQUEST_EVENT_CRC_EXTRA = 33
HEADER_BYTES = 10
ARMED, DISARMED = 26266355, 32794487
LOG_LEVELS = 102
PAGE = "https://mavlink.io/en/services/events.html"


class RequestEvent(common.MAVLink_message):  # type: ignore[misc]
    """REQUEST_EVENT of one sequence number."""

    def __init__(self, system: int, sequence: int) -> None:
        super().__init__(REQUEST_EVENT, "REQUEST_EVENT")
        self._payload = struct.pack("<HHBB", sequence, sequence, system, 1)

    def pack(self, mav: Any, force_mavlink1: bool = False) -> bytes:
        return bytes(self._pack(mav, REQUEST_EVENT_CRC_EXTRA, self._payload, force_mavlink1))


def fields(message: Any) -> tuple[int, int, int]:
    """Id, sequence and log levels."""
    payload = bytes(message.get_msgbuf())[HEADER_BYTES:-2].ljust(53, b"\0")
    number, _, sequence, _, _, levels = struct.unpack("<IIHBBB", payload[:13])
    return number, sequence, levels


@pytest.mark.covers("EVENT", "REQUEST_EVENT", source=PAGE)
@pytest.mark.covers("EVENT", source="measured: ids and log levels of the two events")
def test_arming_and_disarming_are_events_and_can_be_asked_for_again(station: Any) -> None:
    found = {}
    for param, number in ((1, ARMED), (0, DISARMED)):
        station.mav.command_long_send(station.system, 1, ARM_DISARM, 0, param, *(0.0,) * 6)
        while (message := station.receive(EVENT)) is not None:
            event, sequence, levels = fields(message)
            if event == number:
                found[number] = sequence
                assert levels == LOG_LEVELS
                break
    assert set(found) == {ARMED, DISARMED}
    station.mav.send(RequestEvent(station.system, found[ARMED]))
    assert fields(station.receive(EVENT))[:2] == (ARMED, found[ARMED])
