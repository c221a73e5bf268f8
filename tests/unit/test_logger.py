"""The logger on simulated time: when it logs, what, and what it does without room. Logs are read back by pyulog."""

import errno
import io
import os
import re
from pathlib import Path

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.logger import log_files
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.topics import (
    BatteryStatus,
    ManualControlSetpoint,
    VehicleRoi,
)
from tests.unit.logger_rig import FIRST, Rig, duration_s

# --- when --------------------------------------------------------------------------------------------------


def test_mode_0_logs_from_arming_until_a_second_after_disarming(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.run(10.0)
    assert rig.names() == []
    rig.arm()
    rig.run(5.0)
    rig.arm(False)
    rig.run(10.0)
    assert rig.names() == ["2026-01-01/00_00_10.ulg"]
    log = rig.read("2026-01-01/00_00_10.ulg")
    assert log.start_timestamp * 1e-6 == pytest.approx(10.0, abs=0.05)
    assert duration_s(log) == pytest.approx(6.0, abs=0.1)
    assert rig.said() == ["[logger] ./log/2026-01-01/00_00_10.ulg\t"]


def test_who_is_disarmed_at_once_is_logged_for_a_second_from_arming_on(tmp_path: Path) -> None:
    """Logger::initialize_load_output: what was begun at the start ends, and the file with it."""
    rig = Rig(tmp_path)
    rig.run(0.5)
    rig.arm()
    rig.run(0.4)
    rig.arm(False)
    rig.run(0.5)
    assert rig.logger.file is not None
    rig.run(0.2)
    assert rig.logger.file is None


def test_mode_1_logs_from_boot_to_the_first_disarming_and_then_each_flight(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=1)
    rig.run(3.0)
    for _ in range(2):
        rig.arm()
        rig.run(3.0)
        rig.arm(False)
        rig.run(4.0)
    assert rig.names() == [FIRST, "2026-01-01/00_00_10.ulg"]
    assert [round(duration_s(rig.read(name))) for name in rig.names()] == [7, 4]


def test_modes_2_and_4_log_until_shutdown(tmp_path: Path) -> None:
    for mode, name in ((2, FIRST), (4, "2026-01-01/00_00_02.ulg")):
        rig = Rig(tmp_path / str(mode), SDLOG_MODE=mode)
        rig.run(2.0)
        rig.arm()
        rig.run(2.0)
        rig.arm(False)
        rig.run(6.0)
        rig.logger.shut_down()
        assert rig.names() == [name]
        assert rig.read(name).last_timestamp * 1e-6 == pytest.approx(10.0, abs=0.1)


def test_mode_3_logs_while_the_first_auxiliary_stick_is_up(tmp_path: Path) -> None:
    """Logger::start_stop_logging (logger.cpp:1113): above 0.3, armed or not, and only by sticks that are heard."""
    rig = Rig(tmp_path, SDLOG_MODE=3)
    rig.arm()
    rig.logger.on()
    rig.run(2.0)
    assert rig.names() == [], "no stick has told anything"
    rig.logger.off()
    for aux1, seconds in ((0.3, 2.0), (0.31, 4.0), (0.0, 2.0)):
        for _ in range(round(seconds / 0.2)):
            rig.topics.manual_control_setpoint = ManualControlSetpoint(rig.now_us, aux=(aux1, *(1.0,) * 5))
            rig.run(0.2)
    assert rig.names() == ["2026-01-01/00_00_04.ulg"]
    assert duration_s(rig.read(rig.names()[0])) == pytest.approx(5.0, abs=0.1)


def test_arming_again_within_the_second_begins_a_new_log(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.arm()
    rig.run(2.0)
    rig.arm(False)
    rig.run(0.5)
    rig.arm()
    rig.run(2.0)
    assert rig.names() == [FIRST, "2026-01-01/00_00_02.ulg"]


def test_shell_turns_logging_on_and_off(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    assert rig.logger.status()[-1] == "Not logging"
    rig.logger.on()
    rig.run(2.0)
    lines = rig.logger.status()
    assert "Log file: ./log/2026-01-01/00_00_00.ulg" in lines
    told = re.fullmatch(
        r"Since last status: dropouts: 0 \(max len: 0.000 s\), max used buffer: (\d+) / 1024000 B", lines[-1]
    )
    assert told is not None and int(told[1]) > 0
    assert "max used buffer: 0 /" in rig.logger.status()[-1]
    rig.logger.off()
    rig.run(2.0)
    assert rig.logger.status()[-1] == "Not logging"
    rig.arm()
    rig.run(1.0)
    assert rig.names() == [FIRST, "2026-01-01/00_00_04.ulg"]


def test_without_a_battery_boots_are_not_logged_where_that_is_wanted(tmp_path: Path) -> None:
    """A battery of which nobody has heard yet counts as one (get_disable_boot_logging)."""
    for name, battery in (("none", BatteryStatus(1, connected=False)), ("unknown", BatteryStatus())):
        rig = Rig(tmp_path / name, SDLOG_MODE=1, SDLOG_BOOT_BAT=1)
        rig.topics.battery_status = battery
        rig.run(1.0)
        assert (rig.logger.file is not None) == (name == "unknown")


def test_logger_off_ends_no_log_that_was_not_begun_by_on(tmp_path: Path) -> None:
    for mode in (1, 2):
        rig = Rig(tmp_path / str(mode), SDLOG_MODE=mode)
        rig.run(1.0)
        rig.logger.off()
        rig.run(3.0)
        assert rig.logger.file is not None, "of the boot"
    rig = Rig(tmp_path / "armed")
    rig.arm()
    rig.logger.on()
    rig.run(1.0)
    rig.logger.off()
    rig.run(3.0)
    assert rig.logger.file is not None
    rig = Rig(tmp_path / "boot", SDLOG_MODE=1)
    rig.logger.on()
    rig.run(1.0)
    rig.logger.off()
    rig.run(3.0)
    assert rig.logger.file is None, "on made the log of the boot its own"
    assert duration_s(rig.read(FIRST)) == pytest.approx(2.0, abs=0.1)


def test_backend_0_and_no_storage_log_nothing(tmp_path: Path) -> None:
    for rig in (Rig(tmp_path, SDLOG_BACKEND=2), Rig(None)):
        rig.arm()
        rig.run(2.0)
        assert rig.logger.file is None
        assert rig.said() == []


# --- names and room ----------------------------------------------------------------------------------------


def test_names_follow_the_utc_offset_and_never_overwrite(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2, SDLOG_UTC_OFFSET=-90)
    folder = tmp_path / "log" / "2025-12-31"
    folder.mkdir()
    (folder / "22_30_00.ulg").write_text("of an earlier flight")
    rig.run(2.0)
    rig.logger.shut_down()
    assert (folder / "22_30_00.ulg").read_text() == "of an earlier flight"
    assert rig.names()[-1] == "2025-12-31/22_30_01.ulg"
    assert rig.read("2025-12-31/22_30_01.ulg").msg_info_dict["time_ref_utc"] == -5400


def test_the_oldest_days_go(tmp_path: Path) -> None:
    storage.prepare(tmp_path)
    for day in range(1, 6):
        (tmp_path / "log" / f"2025-12-0{day}").mkdir()
    (tmp_path / "log" / "mine").mkdir()
    rig = Rig(tmp_path, SDLOG_DIRS_MAX=3)
    rig.arm()
    rig.run(1.0)
    left = sorted(path.name for path in (tmp_path / "log").iterdir())
    assert left == ["2025-12-03", "2025-12-04", "2025-12-05", "2026-01-01", "mine"]


def test_a_full_disk_is_told_at_every_log_and_flying_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_files, "free_bytes", lambda root: (1 << 20) - 1)
    rig = Rig(tmp_path)
    for _ in range(2):
        rig.arm()
        rig.run(2.0)
        rig.arm(False)
        rig.run(2.0)
    assert rig.said() == ["[logger] Storage full: 0 MiB free\t"] * 2
    assert rig.texts.recent[0].severity == Severity.CRITICAL
    assert rig.texts.events.recent[0].log_levels == Severity.ERROR << 4 | Severity.ERROR
    assert rig.names() == []
    monkeypatch.setattr(log_files, "free_bytes", lambda root: 1 << 20)
    rig.arm()
    rig.run(1.0)
    assert len(rig.names()) == 1


def test_a_folder_that_cannot_be_written_is_told_once(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    (tmp_path / "log").rmdir()
    (tmp_path / "log").write_text("not a folder")
    for _ in range(2):
        rig.arm()
        rig.run(2.0)
        rig.arm(False)
        rig.run(2.0)
    assert rig.said() == ["[logger] Not logging to ./log/2026-01-01/00_00_00.ulg: Not a directory\t"]


def test_a_disk_that_fills_up_in_flight_ends_the_log_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Filling(io.FileIO):
        def write(self, data: object, /) -> int:
            if self.tell() > 100_000:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return super().write(data)  # type: ignore[arg-type]  # a memoryview

    monkeypatch.setattr(log_files, "FileIO", Filling)
    rig = Rig(tmp_path)
    rig.arm()
    rig.run(20.0)
    assert rig.said()[1:] == ["[logger] Not logging to ./log/2026-01-01/00_00_00.ulg: No space left on device\t"]
    assert duration_s(rig.read(FIRST)) > 0.5


def test_a_log_of_the_greatest_size_is_followed_by_another(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MAX_SIZE=1)
    rig.arm()
    while len(rig.names()) < 2 and rig.now_us < 200_000_000:
        rig.run(1.0)
    rig.run(1.0)
    rig.logger.shut_down()
    first, second = rig.names()
    size = (tmp_path / "log" / first).stat().st_size
    assert 1 << 20 <= size < 1.1 * (1 << 20)
    gap_us = rig.read(second).start_timestamp - rig.read(first).last_timestamp
    assert 0 <= gap_us < 1_000_000


def test_a_log_that_is_removed_ends_quietly(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.arm()
    rig.run(2.0)
    (tmp_path / "log" / FIRST).unlink()
    rig.run(2.0)
    assert rig.logger.file is None
    assert len(rig.said()) == 1


def test_a_flight_after_the_boot_log_was_erased_is_logged(tmp_path: Path) -> None:
    """On purpose otherwise than in PX4, which writes on in the erased file (Logger::start_log_file)."""
    rig = Rig(tmp_path, SDLOG_MODE=1)
    rig.run(2.0)
    (tmp_path / "log" / FIRST).unlink()
    rig.run(2.0)
    rig.arm()
    rig.run(2.0)
    assert rig.names() == ["2026-01-01/00_00_04.ulg"]


def test_what_is_not_told_again_is_in_no_later_log(tmp_path: Path) -> None:
    """PX4's subscriptions outlive a log: only states that it publishes again and again begin each."""
    rig = Rig(tmp_path)
    for number in range(3):
        if number != 1:
            rig.topics.vehicle_roi = VehicleRoi(number + 1, timestamp=rig.now_us + 1)
        rig.arm()
        rig.run(1.0)
        rig.arm(False)
        rig.run(4.0)
    logs = [rig.read(name) for name in rig.names()]
    rois = [[list(data.data["mode"]) for data in log.data_list if data.name == "vehicle_roi"] for log in logs]
    assert rois == [[[1]], [], [[3]]]
    assert all(len(log.get_dataset("vehicle_control_mode").data["timestamp"]) > 1 for log in logs)
