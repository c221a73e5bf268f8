"""MAVSDK component_metadata: it fetches, unpacks and hands out all three files."""

import json
import queue
from typing import Any

from mavsdk.plugins.component_metadata import ComponentMetadata, MetadataType

from tests.interop.mavsdk_vehicle import Vehicle

FETCH_LIMIT_S = 30.0
AUTOPILOT = 1


def test_parameters_events_and_actuators_are_fetched(vehicle: Vehicle) -> None:
    plugin = ComponentMetadata(vehicle.system)
    updates: queue.Queue[Any] = queue.Queue()
    handle = plugin.subscribe_metadata_available(lambda update, _user_data: updates.put(update))
    plugin.request_autopilot_component()
    found = {}
    while (update := updates.get(timeout=FETCH_LIMIT_S)).type != MetadataType.ALL_COMPLETED:
        found[update.type] = json.loads(update.json_metadata)
    plugin.unsubscribe_metadata_available(handle)
    assert set(found) == {MetadataType.PARAMETER, MetadataType.EVENTS, MetadataType.ACTUATORS}
    names = {entry["name"] for entry in found[MetadataType.PARAMETER]["parameters"]}
    assert {"SYS_AUTOSTART", "MPC_XY_CRUISE"} <= names
    assert found[MetadataType.EVENTS]["components"]["1"]["namespace"] == "px4"
    assert found[MetadataType.ACTUATORS]["functions_v1"]["101"]["label"] == "Motor 1"
    again = plugin.get_metadata(AUTOPILOT, MetadataType.PARAMETER)
    assert json.loads(again.json_metadata) == found[MetadataType.PARAMETER]
