"""A process of a launch that hangs up and does not end is killed and told of, and the launch goes on."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from sitl_emu.run import children
from sitl_emu.run.children import Child, obituary_of_lost
from tests.unit import test_photographer, test_range_feeds, test_ros_line

Process = subprocess.Popen[bytes]


def started(*arguments: str) -> Process:
    return subprocess.Popen(arguments, start_new_session=True)


@pytest.fixture
def lingering(monkeypatch: pytest.MonkeyPatch) -> Iterator[Process]:
    """It has no time at all to end by itself."""
    monkeypatch.setattr(children, "STOP_S", 0.0)
    process = started("sleep", "600")
    yield process
    process.kill()
    process.wait()


def test_one_that_does_not_end_is_killed_and_that_is_said(lingering: Process, tmp_path: Path) -> None:
    said = obituary_of_lost(Child("camera uas", lingering, tmp_path / "log"))
    assert lingering.returncode == -9
    assert said == (
        f"camera uas (pid {lingering.pid}) hung up, and was killed as it did not end; its log is {tmp_path / 'log'}"
    )


def test_one_that_ends_by_itself_is_not(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(children, "STOP_S", 60.0)
    (tmp_path / "log").write_text("no memory\n")
    said = obituary_of_lost(Child("camera uas", started("sh", "-c", "exit 5"), tmp_path / "log"))
    assert "ended with exit status 5" in said and said.endswith("no memory")


def test_a_camera_that_hangs_up_and_lives_on(
    lingering: Process, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with test_photographer.opened(test_photographer.Bench(tmp_path, monkeypatch, process=lingering)) as bench:
        bench.cameras.pop(0).close()
        assert bench.photographer.taken() == []
        (complaint,) = bench.photographer.complaints
        assert complaint.startswith("camera iris") and "hung up" in complaint


def test_a_depth_camera_that_hangs_up_and_lives_on(
    lingering: Process, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = test_range_feeds.Bench(tmp_path, monkeypatch, lingering)
    bench.theirs[0].close()
    assert bench.feeds.measured() == []
    (complaint,) = bench.feeds.complaints
    assert "depth m600-1" in complaint and "hung up" in complaint
    bench.feeds.close()
    bench.theirs[1].close()


def test_a_ros_process_that_hangs_up_and_lives_on(
    lingering: Process, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = test_ros_line.Bench(tmp_path, monkeypatch, lingering)
    bench.line.begin()
    bench.ros.close()
    bench.tick(10)
    (said,) = bench.said
    assert "ros (pid" in said and "hung up" in said
    bench.line.close()
