"""MAVSDK ftp: folders, files there and back, by reads and by bursts, and what is refused."""

import queue
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from mavsdk.plugins.ftp import Ftp, FtpError, FtpResult

from tests.interop.mavsdk_vehicle import Vehicle

TRANSFER_LIMIT_S = 30.0
FOLDER = "mavsdk"
CONTENT = random.Random(7).randbytes(60_000)


def ended(start: Callable[..., None], *arguments: Any) -> FtpResult:
    """How a transfer ends."""
    results: queue.Queue[FtpResult] = queue.Queue()
    start(*arguments, lambda result, _progress, _user_data: results.put(result))
    while (result := results.get(timeout=TRANSFER_LIMIT_S)) == FtpResult.NEXT:
        pass
    return result


@pytest.fixture
def ftp(vehicle: Vehicle) -> Iterator[Ftp]:
    """The plugin, with a folder to work in."""
    plugin = Ftp(vehicle.system)
    plugin.create_directory(FOLDER)
    yield plugin
    for entry in plugin.list_directory(FOLDER).entries:
        plugin.remove_file(f"{FOLDER}/{entry.name}")
    plugin.remove_directory(FOLDER)
    plugin.destroy()


@pytest.mark.parametrize("by_bursts", [False, True])
def test_a_file_goes_up_and_comes_down(ftp: Ftp, tmp_path: Path, by_bursts: bool) -> None:
    (tmp_path / "up").mkdir()
    (tmp_path / "up" / "file.bin").write_bytes(CONTENT)
    assert ended(ftp.upload_async, str(tmp_path / "up" / "file.bin"), FOLDER) == FtpResult.SUCCESS
    assert [(entry.name, entry.size_bytes) for entry in ftp.list_directory(FOLDER).entries] == [
        ("file.bin", len(CONTENT))
    ]
    assert ftp.are_files_identical(str(tmp_path / "up" / "file.bin"), f"{FOLDER}/file.bin")
    assert ended(ftp.download_async, f"{FOLDER}/file.bin", str(tmp_path), by_bursts) == FtpResult.SUCCESS
    assert (tmp_path / "file.bin").read_bytes() == CONTENT
    ftp.rename(f"{FOLDER}/file.bin", f"{FOLDER}/other.bin")
    assert [entry.name for entry in ftp.list_directory(FOLDER).entries] == ["other.bin"]


def test_the_metadata_is_where_px4_has_it(ftp: Ftp, tmp_path: Path) -> None:
    names = {entry.name for entry in ftp.list_directory("/etc/extras").entries}
    assert names == {"actuators.json.xz", "all_events.json.xz", "component_general.json.xz", "parameters.json.xz"}
    assert ended(ftp.download_async, "/etc/extras/parameters.json.xz", str(tmp_path), True) == FtpResult.SUCCESS
    assert (tmp_path / "parameters.json.xz").read_bytes()[:6] == bytes.fromhex("fd377a585a00")


def test_a_refusal_is_the_error_that_it_says(ftp: Ftp, tmp_path: Path) -> None:
    refusals: list[tuple[Callable[[], object], FtpResult]] = [
        (lambda: ftp.create_directory(FOLDER), FtpResult.FILE_EXISTS),
        (lambda: ftp.remove_file(f"{FOLDER}/none"), FtpResult.FILE_DOES_NOT_EXIST),
        (lambda: ftp.list_directory("no_such_folder"), FtpResult.FILE_DOES_NOT_EXIST),
        (lambda: ftp.list_directory("../.."), FtpResult.FILE_PROTECTED),
    ]
    for call, result in refusals:
        with pytest.raises(FtpError) as refusal:
            call()
        assert refusal.value.result == result
    assert ended(ftp.download_async, "no_such_file", str(tmp_path), True) == FtpResult.FILE_DOES_NOT_EXIST
