"""MAVSDK log_files: the list, a download byte for byte, erasing."""

import queue
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.log_files import LogFiles, LogFilesError, LogFilesResult
from pyulog import ULog

from tests.launched import launched

INSTANCE = 23
LIMIT_S = 60.0


class Vehicle(NamedTuple):
    """The plugin, and the folder where the vehicle keeps its logs."""

    log_files: LogFiles
    folder: Path


@pytest.fixture
def vehicle(tmp_path: Path) -> Iterator[Vehicle]:
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    state = tmp_path / "state"
    with launched("iris", "--instance", str(INSTANCE), "--state", str(state)), Mavsdk(station) as mavsdk:
        mavsdk.add_any_connection(f"udpout://127.0.0.1:{18570 + INSTANCE}")
        system = mavsdk.first_autopilot(timeout_s=30.0)
        assert system is not None
        plugin = LogFiles(system)
        yield Vehicle(plugin, state / f"iris-{INSTANCE}" / "log")
        plugin.destroy()


def test_a_log_is_listed_downloaded_and_erased(vehicle: Vehicle, tmp_path: Path) -> None:
    (entry,) = vehicle.log_files.get_entries()
    (onboard,) = vehicle.folder.rglob("*.ulg")
    assert 0 < entry.size_bytes <= onboard.stat().st_size
    results: queue.Queue[LogFilesResult] = queue.Queue()
    fetched = tmp_path / "fetched.ulg"
    vehicle.log_files.download_log_file_async(entry, str(fetched), lambda result, _progress, _: results.put(result))
    while (result := results.get(timeout=LIMIT_S)) == LogFilesResult.NEXT:
        pass
    assert result == LogFilesResult.SUCCESS
    data = fetched.read_bytes()
    assert len(data) == entry.size_bytes
    assert data == onboard.read_bytes()[: len(data)]
    assert ULog(str(fetched)).initial_parameters["MAV_SYS_ID"] == INSTANCE + 1
    vehicle.log_files.erase_all_log_files()
    with pytest.raises(LogFilesError):
        vehicle.log_files.get_entries()
    assert not list(vehicle.folder.rglob("*.ulg"))
