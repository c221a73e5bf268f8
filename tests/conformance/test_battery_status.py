"""BATTERY_STATUS: the autopilot tells its own battery; what batteries of other systems tell is none of its affair."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import common

SMART_BATTERY = 180
"""MAV_COMP_ID_BATTERY."""
NO_CELL = 65535
CELLS_MV = [4101, 4102, 4103, 4104]

pytestmark = pytest.mark.covers("BATTERY_STATUS", source="https://mavlink.io/en/messages/common.html#BATTERY_STATUS")


def test_a_battery_of_another_system_is_not_ours(station: Any) -> None:
    speaker = common.MAVLink(None, srcSystem=station.system + 1, srcComponent=SMART_BATTERY)
    message = common.MAVLink_battery_status_message(0, 1, 1, 32767, CELLS_MV + [NO_CELL] * 6, 150, 12, -1, 5)
    station.link.write(message.pack(speaker))
    heard = [message for message in station.collect("BATTERY_STATUS", 4.5) if message.get_srcComponent() == 1]
    assert heard
    assert all(message.id == 0 and message.voltages[:4] != CELLS_MV for message in heard)
