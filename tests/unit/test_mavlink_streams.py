"""What each link streams and how often, against the rates measured on PX4 v1.18, and what the messages say."""

import math
from collections import Counter

import pytest

from sitl_emu.autopilot.mavlink import rates
from sitl_emu.autopilot.mavlink.streams import modules
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    ActuatorOutputs,
    BatteryStatus,
    DistanceSensorSample,
    EscStatus,
    EstimatorFusionControl,
    EstimatorSensorBias,
    EstimatorStatus,
    GroundTruth,
    PositionControllerStatus,
    SensorCombined,
    VehicleLandDetected,
    VehicleLocalPosition,
    VehicleLocalPositionSetpoint,
    VehicleMagnetometer,
    VehicleRatesSetpoint,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import ALT_M, GCS, GIMBAL, LAT_DEG, ONBOARD, PAYLOAD, Peer, command_long, only

SECONDS = 6.0
EXPECTED_HZ: dict[int, dict[str, float]] = {
    GCS: {"ATTITUDE": 50, "GPS_RAW_INT": 5, "SERVO_OUTPUT_RAW": 50, "VFR_HUD": 4, "ESC_STATUS": 2, "HEARTBEAT": 1},
    ONBOARD: {
        "ATTITUDE": 100,
        "GPS_RAW_INT": 8,
        "HIGHRES_IMU": 50,
        "LOCAL_POSITION_NED": 30,
        "ODOMETRY": 30,
        "PING": 1,
    },
    PAYLOAD: {"GPS_RAW_INT": 8, "HEARTBEAT": 1, "MISSION_CURRENT": 1},
    GIMBAL: {"AUTOPILOT_STATE_FOR_GIMBAL_DEVICE": 20, "HEARTBEAT": 1, "CURRENT_EVENT_SEQUENCE": 1 / 3},
}
OF_OTHERS = {
    *("ADSB_VEHICLE", "DEBUG", "DEBUG_FLOAT_ARRAY", "DEBUG_VECT", "NAMED_VALUE_FLOAT"),
    *("GLOBAL_POSITION_SENSOR", "LANDING_TARGET", "OBSTACLE_DISTANCE", "OPTICAL_FLOW_RAD"),
}
"""Streams of what others have sent before."""
NOT_YET = OF_OTHERS | {
    "HIL_STATE_QUATERNION",
    "NAV_CONTROLLER_OUTPUT",
    "ORBIT_EXECUTION_STATUS",
    "POSITION_TARGET_GLOBAL_INT",
    "RC_CHANNELS",
    "WIND_COV",
}
"""Streams without data on a vehicle that stands disarmed, in a simulation that tells no truth."""
ONCE = {"AVAILABLE_MODES", "GPS_GLOBAL_ORIGIN"}
"""When it is known, and when it changes."""
SELDOM_HZ = 0.2
OF_PAYLOADS = {
    "CAMERA_IMAGE_CAPTURED",
    "CAMERA_TRIGGER",
    "GIMBAL_DEVICE_INFORMATION",
    "GIMBAL_DEVICE_SET_ATTITUDE",
    "GIMBAL_MANAGER_INFORMATION",
    "GIMBAL_MANAGER_STATUS",
}
"""And those without data on a vehicle that has neither camera nor gimbal."""
OF_SERVICES = {"MISSION_CURRENT"}
"""Sent by a service: PX4 has no stream of it that could be asked."""
GET_MESSAGE_INTERVAL, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 510, 511, 512
ACCEPTED, DENIED = 0, 2


@pytest.mark.parametrize("link", [GCS, ONBOARD, PAYLOAD, GIMBAL])
def test_rates_are_px4s(link: int) -> None:
    peer = Peer()
    peer.fly_and_run(0.5, link)
    counts = Counter(message.get_type() for message in peer.fly_and_run(SECONDS, link))
    for name, hz in EXPECTED_HZ[link].items():
        assert counts[name] / SECONDS == pytest.approx(hz, rel=0.15, abs=0.35), name
    if link != PAYLOAD:
        table = rates.RATES[peer.mavlink.links[link].mode]
        seldom = {name for name, hz in table.items() if rates.UNLIMITED < hz < SELDOM_HZ}
        expected = (set(table) | {"CURRENT_EVENT_SEQUENCE"}) - seldom - ONCE
        assert set(counts) - ONCE == expected - NOT_YET - OF_PAYLOADS


def test_the_payload_link_keeps_its_data_rate() -> None:
    peer = Peer()
    peer.fly_and_run(2.0, PAYLOAD)
    link = peer.mavlink.links[PAYLOAD]
    before = link.bytes_sent
    messages = peer.fly_and_run(SECONDS, PAYLOAD)
    assert (link.bytes_sent - before) / SECONDS < 4400
    assert len(only(messages, "ATTITUDE")) / SECONDS == pytest.approx(11.84, rel=0.3)


def test_a_rover_that_was_never_armed_has_no_escs_and_no_servo_outputs() -> None:
    peer = Peer(kind=VehicleKind.ROVER_ACKERMANN)
    found = {message.get_type() for message in peer.fly_and_run(3.0)}
    assert not found & {"ESC_INFO", "ESC_STATUS", "SERVO_OUTPUT_RAW"}
    assert "GLOBAL_POSITION_INT" in found


def test_a_rovers_motor_is_told_while_it_is_heard() -> None:
    """A real PX4 v1.18 (SIH): 50 degrees and its speed while it is armed, zeros and no ESC online when it is not."""
    peer = Peer(kind=VehicleKind.ROVER_ACKERMANN)
    peer.run(0.5)
    peer.topics.esc_status = EscStatus(peer.now_us + 1_000_000, (5000,))
    heard = peer.run(1.0)
    info, status = only(heard, "ESC_INFO")[-1], only(heard, "ESC_STATUS")[-1]
    assert (info.temperature, info.count, info.info, info.connection_type) == ([5000, 0, 0, 0], 1, 1, 0)
    assert (status.rpm, status.voltage, status.index) == ([5000, 0, 0, 0], [0.0] * 4, 0)
    heard = peer.run(1.1)
    info, status = only(heard, "ESC_INFO")[-1], only(heard, "ESC_STATUS")[-1]
    assert (info.temperature, info.count, info.info) == ([0, 0, 0, 0], 1, 0)
    assert status.rpm == [0, 0, 0, 0]


def test_a_rover_tells_once_that_it_has_a_new_waypoint() -> None:
    peer = Peer(kind=VehicleKind.ROVER_ACKERMANN)
    peer.fly()
    assert only(peer.run(2.0), "NAV_CONTROLLER_OUTPUT") == []
    peer.topics.position_controller_status = PositionControllerStatus(peer.now_us, 2.0)
    (told,) = only(peer.run(2.0), "NAV_CONTROLLER_OUTPUT")
    assert (told.nav_bearing, told.target_bearing, told.wp_dist, told.xtrack_error) == (0, 0, 0, 0.0)
    assert told.alt_error == pytest.approx(-(ALT_M + 3.0))


def test_a_rovers_outputs_are_told_once_each_and_so_is_the_one_that_stops_it() -> None:
    """AckermannActControl::stopVehicle publishes once, disarmed as the rover is then."""
    peer = Peer(kind=VehicleKind.ROVER_ACKERMANN)
    peer.fly_and_run(0.1)

    def asked() -> list[int]:
        replies = [peer.send(command_long(REQUEST_MESSAGE, number)) for number in (36, 93, 375)]
        return [only(each, "COMMAND_ACK")[0].result for each in replies]

    assert asked() == [DENIED] * 3
    for armed, pulse in ((True, 1500), (False, 900)):
        peer.now_us += 1
        peer.topics.actuator_armed = ActuatorArmed(armed=armed)
        peer.topics.actuator_outputs = ActuatorOutputs(peer.now_us, (0.0,) * 2, (pulse,) * 2)
        assert [asked(), asked()] == [[ACCEPTED] * 3, [DENIED] * 3]
    peer.topics.actuator_outputs = ActuatorOutputs(peer.now_us + 1, (0.0,) * 2, (900,) * 2)
    (told,) = only(peer.run(2.0), "SERVO_OUTPUT_RAW")
    assert told.servo1_raw == told.servo2_raw == 900


def test_speed_controllers_tell_their_speeds_while_they_are_heard() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.esc_status = EscStatus(1_000, (6100, 6200, 6300, 6400, 6500, 6600))
    told = only(peer.send(command_long(REQUEST_MESSAGE, 290)), "ESC_INFO")
    assert [list(message.temperature) for message in told] == [[5000] * 4, [5000, 5000, 0, 0]]
    assert [(message.index, message.count, message.info) for message in told] == [(0, 6, 15), (4, 6, 3)]
    told = only(peer.send(command_long(REQUEST_MESSAGE, 291)), "ESC_STATUS")
    assert [list(message.rpm) for message in told] == [[6100, 6200, 6300, 6400], [6500, 6600, 0, 0]]
    peer.now_us = 200_000
    told = only(peer.send(command_long(REQUEST_MESSAGE, 291)), "ESC_STATUS")
    assert [list(message.rpm) for message in told] == [[0] * 4] * 2


def test_a_receiver_without_a_fix() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.sensor_gps = peer.topics.sensor_gps._replace(timestamp=1_000, fix_type=0, eph=100.0)
    told = only(peer.send(command_long(REQUEST_MESSAGE, 24)), "GPS_RAW_INT")[0]
    assert (told.fix_type, told.eph, told.epv, told.h_acc, told.vel_acc) == (0, 10_000, 10_000, 100_000, 100_000)


def test_what_the_estimator_says_of_itself_is_passed_on() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.estimator_status = EstimatorStatus(
        1_000_000, vel_test_ratio=0.1, pos_test_ratio=0.2, hgt_test_ratio=0.3, hdg_test_ratio=0.4, hagl_test_ratio=0.5,
        pos_horiz_accuracy=0.25, pos_vert_accuracy=0.125, solution_status_flags=831,
    )  # fmt: skip
    told = only(peer.send(command_long(REQUEST_MESSAGE, 230)), "ESTIMATOR_STATUS")[0]
    ratios = (told.vel_ratio, told.pos_horiz_ratio, told.pos_vert_ratio, told.mag_ratio, told.hagl_ratio)
    assert ratios == pytest.approx((0.1, 0.2, 0.3, 0.4, 0.5))
    assert (told.pos_horiz_accuracy, told.pos_vert_accuracy, told.flags) == (0.25, 0.125, 831)
    assert math.isnan(told.tas_ratio)


def test_which_fields_of_the_imu_are_new() -> None:
    """Bits 6 to 8 are the magnetometer's, 9, 11 and 12 the barometer's."""
    peer = Peer()
    peer.now_us = 100_000
    peer.fly()
    imu = only(peer.send(command_long(REQUEST_MESSAGE, 105)), "HIGHRES_IMU")[0]
    assert imu.fields_updated == 0b1101111111111
    assert (imu.abs_pressure, imu.pressure_alt, imu.temperature) == (956.0, 489.0, 15.0), "the mean, and the air's"
    peer.topics.vehicle_magnetometer = VehicleMagnetometer(104_000, 104_000)
    assert not only(peer.send(command_long(REQUEST_MESSAGE, 105)), "HIGHRES_IMU"), "the IMU has measured nothing"
    peer.topics.sensor_combined = SensorCombined(150_000)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 105)), "HIGHRES_IMU")[0].fields_updated == 0b111111111
    peer.topics.sensor_combined = SensorCombined(154_000)
    peer.topics.vehicle_air_data = peer.topics.vehicle_air_data._replace(timestamp=154_000)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 105)), "HIGHRES_IMU")[0].fields_updated == 0b1101000111111
    on_another_link = peer.send(command_long(REQUEST_MESSAGE, 105), ONBOARD)
    assert only(on_another_link, "HIGHRES_IMU")[0].fields_updated == 0b1101111111111


ONCE_AN_UPDATE = (
    "ATTITUDE", "ATTITUDE_QUATERNION", "AUTOPILOT_STATE_FOR_GIMBAL_DEVICE", "ESTIMATOR_SENSOR_FUSION_STATUS",
    "ESTIMATOR_STATUS", "GLOBAL_POSITION_INT", "HIGHRES_IMU", "HIL_ACTUATOR_CONTROLS", "HIL_STATE_QUATERNION",
    "LOCAL_POSITION_NED", "ODOMETRY", "SYS_STATUS", "VFR_HUD",
)  # fmt: skip


@pytest.mark.parametrize("name", ONCE_AN_UPDATE)
def test_who_asks_twice_for_what_is_not_new_is_denied(name: str) -> None:
    """As uORB's subscriptions of PX4's streams have it: nothing is told twice on a link."""
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.groundtruth = GroundTruth(1_000)
    for expected in (ACCEPTED, DENIED, DENIED):
        acks = only(peer.send(command_long(REQUEST_MESSAGE, modules()[name].ID)), "COMMAND_ACK")
        assert [ack.result for ack in acks] == [expected]


@pytest.mark.parametrize(
    ("name", "hz"), [("SYS_STATUS", 100), ("ESTIMATOR_STATUS", 125), ("ESTIMATOR_SENSOR_FUSION_STATUS", 125)]
)
def test_no_stream_is_faster_than_what_it_tells(name: str, hz: int) -> None:
    peer = Peer()
    peer.send(command_long(SET_MESSAGE_INTERVAL, modules()[name].ID, 4000))
    heard = 0
    for tick in range(250):
        peer.now_us += 4000
        if tick % 2 == 0:
            peer.topics.vehicle_local_position = VehicleLocalPosition(peer.now_us)
            peer.topics.estimator_status = EstimatorStatus(peer.now_us)
        if peer.now_us // 10_000 != (peer.now_us - 4000) // 10_000:
            peer.topics.battery_status = BatteryStatus(peer.now_us, True, 16.2, -1.0, 1.0)
        peer.mavlink.update(peer.now_us)
        heard += len(only(peer.received(), name))
    assert heard == pytest.approx(hz, abs=2)


def test_the_imu_is_told_without_the_biases_of_its_sensors() -> None:
    """Of those that the filter has estimated for just these sensors (streams/HIGHRES_IMU.hpp)."""
    peer = Peer()
    told = []
    for with_magnetometer in (False, True):
        peer.now_us += 100_000
        peer.fly()
        peer.topics.estimator_sensor_bias = EstimatorSensorBias(
            peer.now_us, gyro_device_id=1, gyro_bias=(0.01, 0.0, 0.0), mag_device_id=1 if with_magnetometer else 0,
            mag_bias=(0.05, 0.0, -0.1),
        )  # fmt: skip
        told.append(only(peer.send(command_long(REQUEST_MESSAGE, 105)), "HIGHRES_IMU")[0])
    assert [(imu.xmag, imu.zmag) for imu in told] == [pytest.approx((0.2, 0.4)), pytest.approx((0.15, 0.5))]
    assert all(imu.xgyro == pytest.approx(-0.01) and math.isfinite(imu.xacc) for imu in told)


def test_the_imu_tells_its_own_temperature_not_the_barometers() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    assert only(peer.send(command_long(REQUEST_MESSAGE, 26)), "SCALED_IMU")[0].temperature == 1500


def test_a_new_system_id_waits_for_the_next_boot() -> None:
    peer = Peer()
    peer.parameters.set("MAV_SYS_ID", 7)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 69)), "MANUAL_CONTROL")[0].target == 1


def test_nothing_is_streamed_that_is_not_known_yet() -> None:
    found = {message.get_type() for message in Peer().run(3.0)}
    assert not found & {"GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "HOME_POSITION", "GPS_RAW_INT", "ATTITUDE"}
    assert {"HEARTBEAT", "SYS_STATUS"} <= found
    assert only(Peer().send(command_long(REQUEST_MESSAGE, 30)), "COMMAND_ACK")[0].result == DENIED


def test_what_the_estimator_tells_ends_with_it() -> None:
    """As when the IMU fails; what was told last can be asked for (streams/ATTITUDE.hpp and others: update())."""
    of_estimator = {
        *("ATTITUDE", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ODOMETRY", "VFR_HUD"),
        "HIGHRES_IMU",
    }
    peer = Peer()
    assert of_estimator <= {message.get_type() for message in peer.fly_and_run(1.0, ONBOARD)}
    peer.run(0.1, ONBOARD)
    silent = {message.get_type() for message in peer.run(3.0, ONBOARD)}
    assert not of_estimator & silent and "HEARTBEAT" in silent
    assert only(peer.send(command_long(REQUEST_MESSAGE, 30)), "ATTITUDE")


def test_sequence_numbers_have_no_gaps_and_datagrams_fit() -> None:
    peer = Peer()
    sequences = [message.get_seq() for message in peer.fly_and_run(2.0, ONBOARD)]
    assert sequences == [index & 255 for index in range(len(sequences))]
    peer.now_us += 1_000_000
    peer.fly()
    peer.mavlink.update(peer.now_us)
    assert max(len(data) for data in peer.mavlink.links[ONBOARD].outbox) <= 1400


def test_contents() -> None:
    peer = Peer()
    latest = {message.get_type(): message for message in peer.fly_and_run(3.0)}
    heartbeat = latest["HEARTBEAT"]
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.base_mode) == (13, 12, 29)
    assert heartbeat.custom_mode == 50593792
    position = latest["GLOBAL_POSITION_INT"]
    assert (position.lat, position.relative_alt, position.vx) == (round(LAT_DEG * 1e7), 3000, 50)
    assert position.hdg == 0
    gps = latest["GPS_RAW_INT"]
    assert (gps.eph, gps.epv, gps.h_acc, gps.v_acc, gps.vel_acc, gps.fix_type) == (70, 110, 900, 1780, 400, 3)
    battery = latest["BATTERY_STATUS"]
    assert (battery.voltages[0], battery.voltages[1], battery.current_battery) == (16200, 65535, -1)
    assert (battery.battery_remaining, battery.energy_consumed, battery.charge_state) == (100, -1, 1)
    assert (latest["SYS_STATUS"].voltage_battery, latest["SYS_STATUS"].battery_remaining) == (16200, 100)
    assert latest["EXTENDED_SYS_STATE"].landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    mission = latest["MISSION_CURRENT"]
    assert (mission.seq, mission.total, mission.mission_state, mission.mission_mode) == (0, 65535, 1, 2)
    assert math.isnan(latest["POSITION_TARGET_LOCAL_NED"].x)
    assert latest["ALTITUDE"].altitude_amsl == pytest.approx(492.4, abs=1e-3)
    assert latest["CURRENT_MODE"].custom_mode == 50593792


def test_armed_and_in_the_air() -> None:
    peer = Peer()
    peer.topics.vehicle_status = VehicleStatus(armed=True, system_status=4)
    peer.topics.vehicle_land_detected = VehicleLandDetected(landed=False)
    latest = {message.get_type(): message for message in peer.fly_and_run(1.1)}
    assert (latest["HEARTBEAT"].base_mode, latest["HEARTBEAT"].system_status) == (157, 4)
    assert latest["EXTENDED_SYS_STATE"].landed_state == mavlink.MAV_LANDED_STATE_IN_AIR


def test_every_message_in_rates_has_a_module_named_as_it() -> None:
    for table in rates.RATES.values():
        assert set(table) <= set(modules())
    for name, module in modules().items():
        assert mavlink.mavlink_map[module.ID].msgname == name


@pytest.mark.parametrize("name", sorted(modules()))
def test_every_stream_can_be_requested(name: str) -> None:
    peer = Peer()
    peer.parameters.set("CAL_MAG0_ID", 197388)
    peer.fly_and_run(0.2)
    peer.send(command_long(SET_MESSAGE_INTERVAL, modules()[name].ID, -1.0))
    replies = peer.send(command_long(REQUEST_MESSAGE, modules()[name].ID))
    ack = only(replies, "COMMAND_ACK")[0]
    assert (ack.result == ACCEPTED) == bool(only(replies, name))
    assert ack.result == (DENIED if name in NOT_YET | OF_PAYLOADS | OF_SERVICES else ACCEPTED)


def test_high_latency_comes_with_its_stream() -> None:
    """PX4 sends it when the stream begins, so that the request that began it finds nothing new and is denied."""
    peer = Peer()
    peer.fly_and_run(0.2)
    ask = command_long(REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2)
    for result in (DENIED, ACCEPTED, ACCEPTED):
        replies = peer.send(ask)
        assert [ack.result for ack in only(replies, "COMMAND_ACK")] == [result]
        assert len(only(replies, "HIGH_LATENCY2")) == 1
        peer.fly_and_run(0.2)
    begun = command_long(SET_MESSAGE_INTERVAL, mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2, 1e6)
    assert len(only(peer.send(begun, ONBOARD), "HIGH_LATENCY2")) == 1


def test_a_receiver_that_fell_silent_is_told_once_a_second() -> None:
    peer = Peer()
    peer.fly_and_run(1.0)
    told = only(peer.run(4.0), "GPS_RAW_INT")
    assert len(told) == 4
    lost = told[-1]
    assert (lost.fix_type, lost.satellites_visible, lost.eph, lost.epv, lost.vel) == (0, 255, 65535, 65535, 65535)
    assert (lost.cog, lost.lat, lost.time_usec) == (65535, 0, 0)


@pytest.mark.parametrize(
    ("distance_m", "quality", "told"), [(1.0, -1, 0), (1.0, 0, 1), (1.0, 60, 60), (math.nan, -1, 1)]
)
def test_the_quality_of_a_distance_is_told(distance_m: float, quality: int, told: int) -> None:
    """0 is not known and 1 is nothing, where uORB has -1 and 0 (streams/DISTANCE_SENSOR.hpp)."""
    peer = Peer()
    peer.now_us = 1_000
    peer.topics.distance_sensor = DistanceSensorSample(1_000, distance_m, 0.2, 12.0, signal_quality=quality)
    sensor = only(peer.send(command_long(REQUEST_MESSAGE, 132)), "DISTANCE_SENSOR")[0]
    assert sensor.signal_quality == told


def test_a_distance_below_the_ground_is_told_as_16_bits_of_it() -> None:
    """streams/DISTANCE_SENSOR.hpp turns a negative float into a uint16."""
    peer = Peer()
    peer.now_us = 1_000
    peer.topics.distance_sensor = DistanceSensorSample(1_000, -0.395, 0.0, 100.0, signal_quality=0)
    sensor = only(peer.send(command_long(REQUEST_MESSAGE, 132)), "DISTANCE_SENSOR")[0]
    assert (sensor.current_distance, sensor.signal_quality) == (65_497, 1)


def test_a_distance_sensor_of_others_is_told_as_it_was_heard() -> None:
    """But for centimetres that float32 does not hold (streams/DISTANCE_SENSOR.hpp); out of range, too."""
    peer = Peer()
    peer.now_us = 1_000
    for heard_cm, told_cm in ((301, 301), (5, 4), (1400, 1400), (0, 0)):
        peer.now_us += 1_000
        looks = (0, 20, 1200, heard_cm, 1, 0, 25, 9, 0.5, 0.25, (1.0, 0.0, 0.0, 0.0), 0)
        peer.send(mavlink.MAVLink_distance_sensor_message(*looks))
        (told,) = only(peer.send(command_long(REQUEST_MESSAGE, 132)), "DISTANCE_SENSOR")
        assert (told.current_distance, told.min_distance, told.max_distance) == (told_cm, 19, 1200)
        assert (told.type, told.id, told.orientation, told.covariance, told.signal_quality) == (1, 0, 25, 9, 0)
        assert (told.horizontal_fov, told.vertical_fov, told.quaternion) == (0.5, 0.25, [1.0, 0.0, 0.0, 0.0])


def test_each_distance_sensor_is_told_as_it_measures() -> None:
    """One for each link, numbered as it spoke first, and of each the newest alone (streams/DISTANCE_SENSOR.hpp)."""
    peer = Peer()
    peer.fly_and_run(0.5, ONBOARD)
    for link, orientation in ((GCS, 25), (ONBOARD, 0), (GCS, 6)):
        peer.send(mavlink.MAVLink_distance_sensor_message(0, 20, 1200, 100, 0, 9, orientation, 0), link)
    peer.received(ONBOARD)  # what was forwarded
    told = [(sensor.id, sensor.orientation) for sensor in only(peer.fly_and_run(0.5, ONBOARD), "DISTANCE_SENSOR")]
    assert (told.count((0, 25)), told.count((1, 6)), told.count((2, 0)), len(told)) == (5, 1, 1, 7)


def test_a_distance_sensor_that_fell_silent_is_not_told() -> None:
    peer = Peer()
    peer.fly_and_run(1.0, ONBOARD)
    peer.run(1.0, ONBOARD)
    assert not only(peer.run(5.0, ONBOARD), "DISTANCE_SENSOR")


def test_the_calibration_of_the_magnetometer_is_told_once_per_change_of_parameters() -> None:
    peer = Peer()
    peer.parameters.set("CAL_MAG0_ID", 197388)
    peer.parameters.set("CAL_MAG0_YOFF", 0.125)
    peer.fly_and_run(0.1)
    report = only(peer.send(command_long(REQUEST_MESSAGE, 192)), "MAG_CAL_REPORT")[0]
    assert (report.compass_id, report.cal_status, report.ofs_x, report.ofs_y) == (0, 4, 0.0, 0.125)
    assert (report.diag_x, report.diag_y, report.diag_z, report.offdiag_x) == (1.0, 1.0, 1.0, 0.0)
    assert not only(peer.send(command_long(REQUEST_MESSAGE, 192)), "MAG_CAL_REPORT")
    peer.parameters.set("MPC_XY_CRUISE", 6.0)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 192)), "MAG_CAL_REPORT")


def test_which_sensors_are_fused() -> None:
    """GPS, flow, vision, auxiliary position, barometer, range finder, magnetometer, airspeed, beacon."""
    peer = Peer()
    peer.fly()
    peer.topics.estimator_fusion_control = EstimatorFusionControl(
        1, (True, False), True, rng_intended=True, mag_intended=True, gps_active=(True, True), baro_active=True,
        mag_active=True,
    )  # fmt: skip
    status = only(peer.send(command_long(REQUEST_MESSAGE, 514)), "ESTIMATOR_SENSOR_FUSION_STATUS")[0]
    assert list(status.intended) == [1, 1, 0, 0, 0, 1, 1, 0, 0]
    assert list(status.active) == [3, 0, 0, 0, 1, 0, 1, 0, 0]
    assert all(map(math.isnan, status.test_ratio))


def test_setpoints_are_told_while_somebody_sets_them() -> None:
    """Positions are silent in a mode that controls none; there, attitude goes on with the rates after half a second."""
    peer = Peer()
    peer.fly_and_run(0.5)
    peer.run(0.1)
    silent = peer.run(1.0)
    assert not only(silent, "POSITION_TARGET_LOCAL_NED") and not only(silent, "ATTITUDE_TARGET")
    peer.topics.vehicle_rates_setpoint = VehicleRatesSetpoint(peer.now_us, (0.5, 0.0, 0.0))
    (told_of_rates,) = only(peer.run(0.5), "ATTITUDE_TARGET")
    assert told_of_rates.body_roll_rate == 0.5


def test_what_is_not_controlled_is_ignored_in_the_mask() -> None:
    peer = Peer()
    peer.fly()
    peer.topics.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint(1, 1.0, 2.0, -3.0, yaw=0.5)
    target = only(peer.send(command_long(REQUEST_MESSAGE, 85)), "POSITION_TARGET_LOCAL_NED")[0]
    assert (target.type_mask, target.x, target.yaw) == (8 | 16 | 32 | 64 | 128 | 256 | 2048, 1.0, 0.5)


def test_the_origin_is_told_when_it_changes() -> None:
    peer = Peer()
    told = only(peer.fly_and_run(3.0, ONBOARD), "GPS_GLOBAL_ORIGIN")
    assert [message.latitude for message in told] == [round(LAT_DEG * 1e7)]
    assert only(peer.send(command_long(REQUEST_MESSAGE, 49)), "GPS_GLOBAL_ORIGIN")
