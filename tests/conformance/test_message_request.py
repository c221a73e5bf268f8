"""REQUEST_MESSAGE: what a ground station asks at connect."""

from typing import Any

import pytest

REQUEST_MESSAGE = 512

pytestmark = pytest.mark.covers(
    "MAV_CMD_REQUEST_MESSAGE", source="https://mavlink.io/en/messages/common.html#MAV_CMD_REQUEST_MESSAGE"
)


@pytest.mark.covers(source="measured: which messages PX4 has without camera and gimbal")
@pytest.mark.parametrize(("number", "result"), [(148, 0), (300, 0), (242, 0), (259, 2), (280, 2)])
def test_request(station: Any, number: int, result: int) -> None:
    assert station.command(REQUEST_MESSAGE, number) == result


@pytest.mark.covers("AUTOPILOT_VERSION", source="measured: capabilities and version of v1.18")
def test_version(station: Any) -> None:
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, 148, *(0.0,) * 6)
    version = station.receive("AUTOPILOT_VERSION")
    assert (version.capabilities, version.flight_sw_version) == (59647, 17957119)
