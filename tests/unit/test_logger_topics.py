"""Topics of a log that one module of PX4 or one message of a companion alone brings."""

from pathlib import Path

import numpy as np
import pytest
from pyulog import ULog

from sitl_emu.autopilot.topics import NOT_NEW, Ekf2Timestamps, VehicleOdometry
from tests.unit.estimator_feed import Feed
from tests.unit.logger_rig import FIRST, TICK_US, Rig


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
