"""Topics of a log that one module of PX4 or one message of a companion alone brings."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyulog import ULog

from sitl_emu.autopilot.constants import NavState, RequestedAction
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.logger import logged_topics
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.mavlink.context import BOOT_UNIX_US
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.sensors.sensors import Sensors
from sitl_emu.autopilot.sensors.vehicle_acceleration import AccelerationFilter
from sitl_emu.autopilot.storage import storage
from sitl_emu.autopilot.topics import (
    NOT_NEW,
    ActionRequest,
    ActuatorTest,
    AutotuneAttitudeControlStatus,
    CollisionConstraints,
    DebugArray,
    DebugKeyValue,
    DebugValue,
    DebugVect,
    DistanceSensorSample,
    Ekf2Timestamps,
    SensorSelection,
    TelemetryStatus,
    TimesyncStatus,
    VehicleOdometry,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import HilSensor
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
    rig = Rig(tmp_path, SDLOG_MODE=2, MPC_Z_P=1.5)
    rig.run(1.0)
    rig.parameters.set("MPC_XY_P", 0.5)
    rig.run(1.0)
    rig.parameters.set("COM_FLIGHT_UUID", 3, notify=False)
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert column(log, "parameter_update", "instance") == [0.0, 1.0]
    assert column(log, "parameter_update", "changed") == [0.0, 1.0]
    assert column(log, "parameter_update", "custom_default") == [2.0, 2.0], "SDLOG_MODE, MPC_Z_P"
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


# --- what companions tell ----------------------------------------------------------------------------------------

NAN21 = [math.nan] * 21
HEAT = [30, *[127] * 7]
BOARD: Any = (1000, 0, [10, 20, *[0] * 6], [0] * 10, [255] * 4, [255] * 10, 42, HEAT, [0] * 4, 1000, 2000)
LINKS: Any = ([0] * 4, [0] * 4, [0] * 4, *[[0] * 6] * 5)


def told(now_us: int) -> list[mavlink.MAVLink_message]:
    """What was sent to a real v1.18 (sihsim_hex) whose log is what the test below looks for; RADIO_STATUS was not."""
    return [
        mavlink.MAVLink_odometry_message(
            now_us, 20, 8, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0, 0.1, 0.2, 0.3, NAN21, NAN21, 0, 3, 50
        ),
        mavlink.MAVLink_att_pos_mocap_message(now_us, [1, 0, 0, 0], 0.1, 0.2, -0.3),
        mavlink.MAVLink_obstacle_distance_message(now_us, 1, [1500] * 72, 5, 30, 2000, 5.0, 0.0, 12),
        mavlink.MAVLink_optical_flow_rad_message(now_us, 0, 100_000, 0.01, 0.02, 0, 0, 0, 2000, 200, 0, 0.5),
        mavlink.MAVLink_distance_sensor_message(0, 10, 3000, 250, 0, 0, 25, 255, 0.1, 0.1, [0, 0, 0, 0], 80),
        mavlink.MAVLink_onboard_computer_status_message(now_us, *BOARD, *LINKS),
        mavlink.MAVLink_radio_status_message(200, 180, 90, 40, 42, 3, 7),
        mavlink.MAVLink_global_position_sensor_message(
            1, 1, 1, now_us, 0, 1, 0, 473977418, 85455939, 489.0, 490.0, 2.0, 2.0
        ),
    ]


def test_a_log_has_what_a_companion_told(tmp_path: Path) -> None:
    """Values are those of the real log; its device ids are of the onboard link and system 1 (Device.hpp)."""
    peer = Peer(system=1, component=191)
    storage.prepare(tmp_path)
    profile = {"SDLOG_MODE": 2, "SDLOG_PROFILE": 131}
    parameters = Parameters(VehicleKind.MULTICOPTER, profile)
    logger = Logger(peer.topics, parameters, Texts(), tmp_path, lambda: BOOT_UNIX_US)
    logger.update(0)
    for _ in range(260):
        peer.now_us += TICK_US
        if peer.now_us % 100_000 == 0:
            peer.topics.distance_sensor = DistanceSensorSample(peer.now_us, 1.0, 0.0, 100.0)
            for message in told(peer.now_us):
                peer.send(message, ONBOARD)
        logger.update(peer.now_us)
    logger.shut_down()
    log = ULog(str(tmp_path / "log" / FIRST))

    def last(topic: str, instance: int = 0) -> dict[str, float]:
        return {field: float(values[-1]) for field, values in log.get_dataset(topic, instance).data.items()}

    vision, mocap = last("vehicle_visual_odometry"), last("vehicle_mocap_odometry")
    assert (vision["pose_frame"], vision["velocity_frame"], vision["quality"]) == (2, 3, 50)
    assert vision["angular_velocity[2]"] == pytest.approx(0.3) and math.isnan(vision["position_variance[0]"])
    assert (vision["timestamp"], vision["timestamp_sample"]) == (1_000_000, 1_000_000)
    assert (mocap["pose_frame"], mocap["q[0]"]) == (1, 1.0) and mocap["position[2]"] == pytest.approx(-0.3)
    assert math.isnan(mocap["velocity[0]"]) and mocap["position_variance[0]"] == 0.0
    around = last("obstacle_distance")
    assert (around["distances[71]"], around["frame"], around["increment"], around["sensor_type"]) == (1500, 12, 5.0, 1)
    flow, sensor = last("vehicle_optical_flow"), last("sensor_optical_flow")
    assert (flow["device_id"], flow["max_flow_rate"], flow["max_ground_distance"]) == (11665678, 8.0, 100.0)
    assert flow["min_ground_distance"] == pytest.approx(0.08) and flow["pixel_flow[1]"] == pytest.approx(0.02)
    assert (sensor["distance_available"], sensor["delta_angle_available"], sensor["quality"]) == (1, 1, 200)
    assert math.isnan(sensor["max_flow_rate"])
    ours, theirs = last("distance_sensor"), last("distance_sensor", 1)
    assert (ours["device_id"], ours["current_distance"]) == (10092548, 1.0)
    assert (theirs["device_id"], theirs["current_distance"], theirs["signal_quality"]) == (9699598, 2.5, 79)
    assert len(column(log, "distance_sensor", "timestamp", 1)) == 10
    board = last("onboard_computer_status")
    assert (board["uptime"], board["temperature_board"], board["cpu_cores[1]"]) == (1000, 42, 20)
    assert (board["ram_total"], board["gpu_cores[3]"], board["temperature_core[0]"]) == (2000, 255, 30)
    radio = last("radio_status")
    fields = ("rssi", "remote_rssi", "txbuf", "noise", "remote_noise", "rxerrors", "fix")
    assert [radio[field] for field in fields] == [200, 180, 90, 40, 42, 3, 7]
    place = last("aux_global_position")
    assert (place["alt"], place["id"], place["source"]) == (490.0, 1, 1)
    assert place["lat"] == pytest.approx(47.3977418)


def test_without_a_range_finder_of_ours_a_companions_is_the_first_instance(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.topics.distance_sensors_outside = (DistanceSensorSample(1_000, 2.0, publisher="onboard"),)
    rig.run(2.0)
    rig.logger.shut_down()
    assert [data.multi_id for data in rig.read(FIRST).data_list if data.name == "distance_sensor"] == [0]


@pytest.mark.parametrize(("profile", "logged"), [(128, True), (1, False)])
def test_vision_and_avoidance_is_a_bit_of_its_own(tmp_path: Path, profile: int, logged: bool) -> None:
    """add_vision_and_avoidance_topics of logged_topics.cpp."""
    rig = Rig(tmp_path, SDLOG_MODE=2, SDLOG_PROFILE=profile)
    for _ in range(100):
        now_us = rig.now_us + TICK_US
        rig.topics.collision_constraints = CollisionConstraints(now_us, (1.0, 2.0), (0.5, 0.25))
        rig.topics.vehicle_mocap_odometry = VehicleOdometry(now_us, told_us=now_us)
        rig.run(TICK_US * 1e-6)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert (
        names(log) >= {"collision_constraints", "vehicle_mocap_odometry"}
        if logged
        else not names(log)
        & {
            "collision_constraints",
            "vehicle_mocap_odometry",
        }
    )
    if logged:
        assert column(log, "collision_constraints", "adapted_setpoint[1]")[0] == 0.25
        assert 10 <= len(column(log, "vehicle_mocap_odometry", "timestamp")) <= 15


def test_each_request_of_a_switch_is_logged(tmp_path: Path) -> None:
    """ManualControl::sendActionRequest: several may come at once."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(1.0)
    asked = (RequestedAction.ARM, RequestedAction.SWITCH_MODE)
    rig.topics.action_requests = tuple(
        ActionRequest(number, rig.now_us, action, number, NavState.POSCTL) for number, action in enumerate(asked, 1)
    )
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert column(log, "action_request", "action") == [1.0, 5.0]
    assert column(log, "action_request", "source") == [1.0, 2.0]
    assert column(log, "action_request", "mode") == [2.0, 2.0]


def test_how_far_autotuning_is_goes_into_the_log(tmp_path: Path) -> None:
    """mc_autotune_attitude_control.cpp:229; 10 Hz."""
    rig = Rig(tmp_path, SDLOG_MODE=2)
    rig.run(1.0)
    rig.topics.autotune_attitude_control_status = AutotuneAttitudeControlStatus(rig.now_us, (0.5,) * 5, state=3)
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert column(log, "autotune_attitude_control_status", "coeff[4]") == [0.5]
    assert column(log, "autotune_attitude_control_status", "state") == [3.0]


# --- SDLOG_PROFILE ------------------------------------------------------------------------------------------------


def intervals(profile: int) -> dict[tuple[str, int], int]:
    modules = VehicleKind.MULTICOPTER.traits.modules
    topics = logged_topics.logged_topics(profile, logged_topics.Vehicle(modules, [101, 102], 1))
    return {(topic.name, topic.instance): topic.interval_ms for topic in topics}


@pytest.mark.parametrize(
    ("bit", "wanted"),
    [
        (1, {"vehicle_status": 500, "vehicle_land_detected": 1000, "ranging_beacon": 0, "sensor_selection": 0}),
        (2, {"sensor_accel": 100, "sensor_gyro": 100, "sensor_baro": 100, "sensor_mag": 100}),
        (3, {"vehicle_acceleration": 0, "vehicle_torque_setpoint": 0, "actuator_motors": 0}),
        (4, {"rate_ctrl_status": 20, "esc_status": 5, "manual_control_setpoint": 0}),
        (5, {"debug_array": 0, "debug_key_value": 0, "debug_value": 0, "debug_vect": 0, "actuator_test": 500}),
        (6, {"sensor_accel": 100, "sensor_gyro": 100, "sensor_baro": 100, "sensor_mag": 100}),
        (11, {"sensor_gps": 10, "estimator_aid_src_baro_hgt": 10, "vehicle_air_data": 10, "sensor_optical_flow": 10}),
    ],
)
def test_each_bit_brings_its_topics(bit: int, wanted: dict[str, int]) -> None:
    """logged_topics.cpp:295-407; commander tells its state twice a second and the land detector every second."""
    alone, beside = intervals(1 << bit), intervals(1 << bit | 1)
    assert {name: alone[name, 0] for name in wanted} == wanted == {name: beside[name, 0] for name in wanted}
    assert ("cpuload", 0) not in alone and ("cpuload", 0) in beside


def test_of_several_bits_the_last_one_counts() -> None:
    both = intervals(1 << 1 | 1 << 11)
    assert (both["vehicle_air_data", 0], both["vehicle_magnetometer", 0], both["distance_sensor", 1]) == (10, 10, 10)
    assert intervals(131)["vehicle_visual_odometry", 0] == 30


def test_numbers_of_others_are_logged_for_debugging(tmp_path: Path) -> None:
    rig = Rig(tmp_path, SDLOG_MODE=2, SDLOG_PROFILE=1 << 5)
    rig.run(1.0)
    topics, now_us = rig.topics, rig.now_us
    topics.debug_key_value = DebugKeyValue(now_us, b"abc", 1.5)
    topics.debug_value = DebugValue(now_us, 3, 2.5)
    topics.debug_vect = DebugVect(now_us, b"vec", (1.0, 2.0, 3.0))
    topics.debug_array = DebugArray(now_us, 5, b"arr", (1.0, 2.0))
    topics.actuator_test = ActuatorTest(now_us, 101, 0.25, 3_000_000)
    rig.run(1.0)
    rig.logger.shut_down()
    log = rig.read(FIRST)
    assert column(log, "debug_key_value", "value") == [1.5] and column(log, "debug_key_value", "key[0]") == [ord("a")]
    assert column(log, "debug_value", "ind") == [3.0] and column(log, "debug_vect", "z") == [3.0]
    assert column(log, "debug_array", "id") == [5.0] and column(log, "debug_array", "data[1]") == [2.0]
    test = {field: values[0] for field, values in log.get_dataset("actuator_test").data.items()}
    assert (test["action"], test["function"], test["value"], test["timeout_ms"]) == (1, 101, 0.25, 3000)


# --- raw sensors --------------------------------------------------------------------------------------------------


def test_raw_sensors_are_logged_as_their_drivers_tell_them(tmp_path: Path) -> None:
    """sensor_accel, sensor_gyro, sensor_mag and sensor_baro of PX4 know no calibration; what is flown by does."""
    calibrated = {f"CAL_{sensor}0_ID": device for sensor, device in DEVICE_IDS.items()}
    offsets = {"CAL_ACC0_XOFF": 0.5, "CAL_GYRO0_ZOFF": 0.1, "CAL_MAG0_YOFF": 0.05, "CAL_BARO0_OFF": 50.0}
    rig = Rig(tmp_path, SDLOG_MODE=2, **calibrated, **offsets)
    sensors = Sensors(rig.topics, rig.parameters)
    acceleration = AccelerationFilter(rig.topics, rig.parameters)
    for _ in range(500):
        told = HilSensor(
            rig.now_us + TICK_US, 1.0, 2.0, -9.8, 0.1, 0.2, 0.3, 0.2, 0.0, 0.4, 955.0, 0.0, 0.0, 15.0, 0x1FFF, 0
        )
        rig.now_us = sensors.update([told])
        acceleration.update(rig.now_us)
        rig.logger.update(rig.now_us)
    rig.logger.shut_down()
    log = rig.read(FIRST)

    def last(topic: str, *fields: str) -> list[float]:
        return [column(log, topic, field)[-1] for field in fields]

    assert last("sensor_accel", "x", "y", "z") == pytest.approx([1.0, 2.0, -9.8])
    assert last("sensor_gyro", "x", "y", "z") == pytest.approx([0.1, 0.2, 0.3])
    assert last("sensor_mag", "x", "y", "z") == pytest.approx([0.2, 0.0, 0.4])
    assert last("sensor_baro", "pressure") == pytest.approx([95_500.0])
    assert last("vehicle_acceleration", "xyz[0]") == pytest.approx([0.5])
    assert last("sensor_combined", "gyro_rad[2]") == pytest.approx([0.2])
    assert last("vehicle_magnetometer", "magnetometer_ga[1]") == pytest.approx([-0.05])
    assert last("vehicle_air_data", "baro_pressure_pa") == pytest.approx([95_450.0])


def test_another_profile_counts_from_the_next_start_on(tmp_path: Path) -> None:
    """Logger::run reads it once (logger.cpp:609)."""
    rig = Rig(tmp_path, SDLOG_PROFILE=1)
    rig.run(0.1)
    rig.parameters.set("SDLOG_PROFILE", 3)
    rig.arm()
    for _ in range(250):
        rig.topics.ekf2_timestamps = Ekf2Timestamps(rig.now_us + TICK_US)
        rig.run(TICK_US * 1e-6)
    rig.logger.shut_down()
    assert "sensor_combined" in names(rig.read(FIRST)) and "ekf2_timestamps" not in names(rig.read(FIRST))
