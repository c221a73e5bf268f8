"""Topics of a log that one module of PX4 or one message of a companion alone brings."""

from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog

from sitl_emu.autopilot.topics import (
    NOT_NEW,
    Ekf2Timestamps,
    SensorSelection,
    TelemetryStatus,
    TimesyncStatus,
    VehicleOdometry,
)
from sitl_emu.core import dialect as mavlink
from tests.unit.estimator_feed import Feed
from tests.unit.logger_rig import FIRST, TICK_US, Rig
from tests.unit.mavlink_peer import GCS, ONBOARD, Peer


def column(log: ULog, topic: str, field: str, instance: int = 0) -> list[float]:
    return [float(value) for value in log.get_dataset(topic, instance).data[field]]


def names(log: ULog) -> set[str]:
    return {dataset.name for dataset in log.data_list}


# --- ekf2_timestamps -------------------------------------------------------------------------------------------


def test_a_log_tells_what_the_filter_was_handed_with_each_imu_sample() -> None:
    """EKF2.cpp:781: when it was published, in 0.1 ms from the IMU sample on."""
    feed = Feed()
    feed.run(1.0)
    assert feed.topics.ekf2_timestamps == Ekf2Timestamps(), "no log takes them"
    feed.estimator.records.logged = True
    new = {"vehicle_air_data": 0, "vehicle_magnetometer": 0}
    for _ in range(250):
        before = {name: getattr(feed.topics, name) for name in new}
        feed.step()
        told = feed.topics.ekf2_timestamps
        assert told.timestamp == feed.topics.sensor_combined.timestamp
        for name, last in before.items():
            record, relative = getattr(feed.topics, name), getattr(told, f"{name}_timestamp_rel")
            assert (relative == NOT_NEW) == (record is last), name
            if record is not last:
                new[name] += 1
                assert told.timestamp // 100 + relative == record.timestamp // 100, name
        assert told.distance_sensor_timestamp_rel == told.visual_odometry_timestamp_rel == NOT_NEW
    assert new["vehicle_air_data"] > 15 and new["vehicle_magnetometer"] > 10


def test_a_pose_from_outside_is_told_by_when_it_came_in() -> None:
    """EKF2.cpp:2537 takes the message's timestamp, not its timestamp_sample."""
    feed = Feed()
    feed.run(1.0)
    feed.estimator.records.logged = True
    feed.topics.vehicle_visual_odometry = VehicleOdometry(feed.ticks * 4000 - 90_000, told_us=feed.ticks * 4000)
    feed.step()
    assert feed.topics.ekf2_timestamps.visual_odometry_timestamp_rel == -TICK_US // 100
    feed.step()
    assert feed.topics.ekf2_timestamps.visual_odometry_timestamp_rel == NOT_NEW


@pytest.mark.parametrize(("profile", "logged"), [(131, True), (2, True), (1, False)])
def test_estimator_replay_has_a_row_for_each_imu_sample(tmp_path: Path, profile: int, logged: bool) -> None:
    """add_estimator_replay_topics of logged_topics.cpp: bit 1."""
    rig = Rig(tmp_path, SDLOG_MODE=2, SDLOG_PROFILE=profile)
    for tick in range(250):
        rig.topics.ekf2_timestamps = Ekf2Timestamps(rig.now_us + TICK_US, -40 if tick % 5 else NOT_NEW)
        rig.run(TICK_US * 1e-6)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert ("ekf2_timestamps" in names(log)) == logged
    if logged:
        assert np.array_equal(column(log, "ekf2_timestamps", "timestamp"), column(log, "sensor_combined", "timestamp"))
        assert set(column(log, "ekf2_timestamps", "distance_sensor_timestamp_rel")) == {-40.0, float(NOT_NEW)}
        assert set(column(log, "ekf2_timestamps", "airspeed_timestamp_rel")) == {float(NOT_NEW)}


# --- the log itself, parameters, clocks and links -----------------------------------------------------------------


def test_the_logger_tells_of_itself_once_a_second(tmp_path: Path) -> None:
    """Logger::publish_logger_status (logger.cpp:1042)."""
    rig = Rig(tmp_path, SDLOG_MODE=2, SDLOG_BACKEND=3)
    rig.run(5.0)
    written_kb = rig.topics.logger_status.total_written_kb
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert len(column(log, "logger_status", "timestamp")) in (4, 5)
    assert set(column(log, "logger_status", "is_logging")) == {1.0} and written_kb > 10.0
    assert (
        set(column(log, "logger_status", "backend")) == {3.0} and column(log, "logger_status", "num_messages")[0] > 50
    )


def test_without_a_log_it_says_so(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.run(3.0)
    assert rig.topics.logger_status.timestamp and not rig.topics.logger_status.is_logging


def test_each_change_of_parameters_is_logged(tmp_path: Path) -> None:
    """param_notify_changes: how many differ from the airframe's defaults, too."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(1.0)
    rig.parameters.set("MPC_XY_P", 0.5)
    rig.run(1.0)
    rig.parameters.set("COM_FLIGHT_UUID", 3, notify=False)
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert column(log, "parameter_update", "instance") == [0.0, 1.0]
    assert column(log, "parameter_update", "changed") == [0.0, 1.0]
    assert column(log, "parameter_update", "timestamp")[1] == pytest.approx(1e6, abs=20_000)


def test_instances_of_a_topic_are_told_apart(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2)
    for _ in range(3):
        now_us, topics = rig.now_us + TICK_US, rig.topics
        topics.telemetry_status = TelemetryStatus(now_us, mode=0, streams=60)
        topics.telemetry_status_1 = TelemetryStatus(now_us, mode=2, heartbeat_type_onboard_controller=True)
        topics.timesync_status = TimesyncStatus(now_us, round_trip_time=7, observed_offset=-9)
        if not topics.sensor_selection.timestamp:
            topics.sensor_selection = SensorSelection(now_us)
        rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert {(data.name, data.multi_id) for data in log.data_list} >= {
        ("telemetry_status", 0),
        ("telemetry_status", 1),
        ("timesync_status", 0),
        ("sensor_selection", 0),
    }
    assert column(log, "telemetry_status", "streams") == [60.0] * 3
    assert column(log, "telemetry_status", "heartbeat_type_onboard_controller", 1) == [1.0] * 3
    assert column(log, "timesync_status", "observed_offset") == [-9.0] * 3
    assert column(log, "sensor_selection", "gyro_device_id") == [1310988.0]


def test_links_tell_who_was_heard_and_what_came() -> None:
    """Mavlink::publish_telemetry_status; streams, modes and rates are those of init.d-posix/px4-rc.mavlink."""
    peer = Peer()
    for _ in range(3):
        peer.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3), GCS)
        peer.run(1.0)
    topics = peer.topics
    links = [getattr(topics, f"telemetry_status{n}") for n in ("", "_1", "_2", "_3")]
    assert [link.streams for link in links] == [60, 64, 64, 5]
    assert [link.mode for link in links] == [0, 2, 2, 10]
    assert [link.data_rate for link in links] == [4e6, 4e6, 4e3, 4e5]
    assert [link.heartbeat_type_gcs for link in links] == [True, False, False, False]
    assert links[0].rx_message_count == 3 and links[0].tx_message_count > 10 and links[0].tx_rate_avg > 0.0
    peer.run(4.0)
    assert not topics.telemetry_status.heartbeat_type_gcs


def test_each_answer_to_timesync_is_told_by_link() -> None:
    peer = Peer()
    for link in (ONBOARD, GCS):
        peer.now_us += 100_000
        peer.send(mavlink.MAVLink_timesync_message((peer.now_us + 500) * 1000, (peer.now_us - 2_000) * 1000), link)
    first, second = peer.topics.timesync_status, peer.topics.timesync_status_1
    assert (first.round_trip_time, first.observed_offset, first.estimated_offset) == (2_000, -1_500, -1_500)
    assert second.timestamp == first.timestamp + 100_000
