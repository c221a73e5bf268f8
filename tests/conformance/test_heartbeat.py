"""HEARTBEAT of a vehicle that stands ready in Hold and hears a ground station."""

from typing import Any

import pytest


@pytest.mark.covers("HEARTBEAT", source="https://mavlink.io/en/services/heartbeat.html")
@pytest.mark.covers("HEARTBEAT", source="measured identity/heartbeat/gcs/*: ready in Hold")
def test_heartbeat(station: Any) -> None:
    heartbeat = station.heartbeat()
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.base_mode) == (station.vehicle_type, 12, 29)
    assert (heartbeat.custom_mode, heartbeat.system_status, heartbeat.mavlink_version) == (50593792, 3, 3)
