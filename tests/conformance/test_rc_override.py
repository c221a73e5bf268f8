"""RC_CHANNELS_OVERRIDE: eight channels are shown in RC_CHANNELS."""

import time
from typing import Any

import pytest

CENTRE, UNUSED = 1500, 65535


@pytest.mark.covers(
    "RC_CHANNELS_OVERRIDE", "RC_CHANNELS", source="https://mavlink.io/en/messages/common.html#RC_CHANNELS_OVERRIDE"
)
@pytest.mark.covers(
    "RC_CHANNELS",
    source="measured misc/rc_override/rc_channels: eight channels, full strength, UINT16_MAX for the others",
)
def test_channels_are_shown(station: Any) -> None:
    for _ in range(20):
        station.mav.rc_channels_override_send(station.system, 1, *(CENTRE,) * 8)
        time.sleep(0.05)
    channels = station.receive("RC_CHANNELS")
    assert (channels.chancount, channels.rssi) == (8, 100)
    assert (channels.chan1_raw, channels.chan9_raw) == (CENTRE, UNUSED)
