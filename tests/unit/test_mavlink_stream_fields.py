"""What the messages say of place, speed, wind and the vehicle's health, and where there is nothing to say."""

import math
from typing import Any

import pytest

from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    ActuatorOutputs,
    FailsafeFlags,
    GeofenceResult,
    GroundTruth,
    HomePosition,
    LandingTargetPose,
    ManualControlSetpoint,
    MissionResult,
    ObstacleDistance,
    OdometryVariances,
    PositionSetpoint,
    PositionSetpointTriplet,
    VehicleAirData,
    VehicleOpticalFlow,
    VehicleRatesSetpoint,
    VehicleStatus,
    VehicleThrustSetpoint,
    WindEstimate,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import ALT_M, GCS, LAT_DEG, LON_DEG, ONBOARD, Peer, command_long, only

REQUEST_MESSAGE = mavlink.MAV_CMD_REQUEST_MESSAGE


def test_the_truth_is_the_simulators() -> None:
    """Without a time, and in whole m/s² (streams/HIL_STATE_QUATERNION.hpp); the estimate is another thing."""
    peer = Peer()
    peer.fly()
    peer.topics.groundtruth = GroundTruth(
        4_000, (0.5, 0.5, 0.5, 0.5), (0.1, 0.2, 0.3), 47.0000001, 8.5, 501.25, vx=1.25, vy=-0.5, vz=0.0,
        ax=1.9, ay=-1.9, az=0.0,
    )  # fmt: skip
    truth = only(peer.send(command_long(REQUEST_MESSAGE, 115)), "HIL_STATE_QUATERNION")[0]
    assert (truth.time_usec, truth.lat, truth.lon, truth.alt) == (0, 470000001, 85000000, 501250)
    assert truth.attitude_quaternion == [0.5] * 4
    assert (truth.rollspeed, truth.pitchspeed, truth.yawspeed) == pytest.approx((0.1, 0.2, 0.3))
    assert (truth.vx, truth.vy, truth.vz, truth.xacc, truth.yacc, truth.zacc) == (125, -50, 0, 1, -1, 0)


def test_what_a_transponder_is_to_say_is_told_as_often_as_it_is_asked_for() -> None:
    """streams/UAVIONIX_ADSB_OUT_CFG.hpp, UAVIONIX_ADSB_OUT_DYNAMIC.hpp."""
    peer = Peer()
    peer.now_us = 1_000
    for _ in range(2):
        aircraft = only(peer.send(command_long(REQUEST_MESSAGE, 10001)), "UAVIONIX_ADSB_OUT_CFG")[0]
    assert (aircraft.ICAO, aircraft.emitterType, aircraft.aircraftSize) == (1194684, 14, 1)
    assert (aircraft.stallSpeed, aircraft.rfSelect, aircraft.callsign) == (700, 2, "")
    peer.parameters.set("ADSB_CALLSIGN_1", int.from_bytes(b"HB-A", "big"))
    assert only(peer.send(command_long(REQUEST_MESSAGE, 10001)), "UAVIONIX_ADSB_OUT_CFG")[0].callsign == ""
    peer.parameters.set("ADSB_CALLSIGN_1", int.from_bytes(b"HBAB", "big"))
    peer.parameters.set("ADSB_CALLSIGN_2", int.from_bytes(b"C1  ", "big"))
    assert only(peer.send(command_long(REQUEST_MESSAGE, 10001)), "UAVIONIX_ADSB_OUT_CFG")[0].callsign == "HBABC1  "
    peer.fly()
    flight = only(peer.send(command_long(REQUEST_MESSAGE, 10002)), "UAVIONIX_ADSB_OUT_DYNAMIC")[0]
    assert (flight.utcTime, flight.squawk, flight.baroAltMSL, flight.state) == (2**32 - 1, 1200, 956, 8)
    assert (flight.gpsLat, flight.gpsLon, flight.gpsAlt) == (round(LAT_DEG * 1e7), round(LON_DEG * 1e7), 489400)
    assert (flight.velNS, flight.accuracyHor, flight.accuracyVert) == (10, 900, 178)
    peer.topics.vehicle_status = VehicleStatus(armed=True)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 10002)), "UAVIONIX_ADSB_OUT_DYNAMIC")[0].state == 0


def test_what_sensors_of_others_gave_is_told() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.send(mavlink.MAVLink_optical_flow_rad_message(0, 3, 20_000, 0.02, -0.04, 0.01, 0.0, 0.5, 0, 200, 0, 1.5))
    flow = only(peer.send(command_long(REQUEST_MESSAGE, 106)), "OPTICAL_FLOW_RAD")[0]
    assert (flow.integration_time_us, flow.quality, flow.distance) == (20_000, 200, 1.5)
    assert flow.integrated_x == pytest.approx(0.02)
    assert (flow.integrated_xgyro, flow.integrated_zgyro) == (pytest.approx(0.01), 0.5)
    peer.topics.landing_target_pose = LandingTargetPose(1_000, 4.0, 2.0, 0.0)
    target = only(peer.send(command_long(REQUEST_MESSAGE, 149)), "LANDING_TARGET")[0]
    assert (target.x, target.y, target.z, target.position_valid) == (0.0, 0.0, 0.0, 0)
    known = LandingTargetPose(2_000, 4.0, 2.0, 0.0, x_rel=3.0, y_rel=0.0, z_rel=3.0, rel_pos_valid=True)
    peer.topics.landing_target_pose = known
    target = only(peer.send(command_long(REQUEST_MESSAGE, 149)), "LANDING_TARGET")[0]
    assert (target.x, target.y, target.z, target.position_valid) == (3.0, 0.0, 3.0, 1)
    peer.topics.obstacle_distance_fused = ObstacleDistance(
        1_000, 12, (65535,) * 71 + (500,), 5.0, 20, 1200, told_us=5_000
    )
    around = only(peer.send(command_long(REQUEST_MESSAGE, 330)), "OBSTACLE_DISTANCE")[0]
    assert (around.time_usec, around.distances[71], around.increment_f, around.frame) == (1_000, 500, 5.0, 12)
    assert (around.min_distance, around.max_distance) == (20, 1200)


def test_a_flow_without_a_distance_is_told_with_minus_1() -> None:
    """streams/OPTICAL_FLOW_RAD.hpp."""
    peer = Peer()
    peer.topics.vehicle_optical_flow = VehicleOpticalFlow(1_000, 0.0, 0.0, 200, 20_000)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 106)), "OPTICAL_FLOW_RAD")[0].distance == -1.0


def test_sticks_lose_what_float32_does_not_hold() -> None:
    """0.251 * 1000 is a little less than 251 there (streams/MANUAL_CONTROL.hpp)."""
    peer = Peer()
    sticks = (0.25, 0.251, -0.251, 0.002 - 1.0)
    peer.topics.manual_control_setpoint = ManualControlSetpoint(
        1_000, roll=sticks[0], pitch=sticks[1], yaw=sticks[2], throttle=sticks[3], aux=(0.506, 0.0, 0.0, 0.0, 0.0, 1.0)
    )
    told = only(peer.send(command_long(REQUEST_MESSAGE, 69)), "MANUAL_CONTROL")[0]
    assert (told.y, told.x, told.r, told.z, told.aux1, told.aux6) == (250, 250, -250, 0, 505, 1000)


def test_outputs_are_all_told_those_without_a_function_disarmed_and_one_message_has_no_fractions() -> None:
    """SERVO_OUTPUT_RAW.hpp puts a float into an integer; MixingOutput publishes all of its outputs."""
    peer = Peer()
    peer.topics.actuator_outputs = ActuatorOutputs(1_000, (0.0449, 0.99999999, 0.0), (1044.9, 1999.99999, 900.0))
    raw = only(peer.send(command_long(REQUEST_MESSAGE, 36)), "SERVO_OUTPUT_RAW")[0]
    assert [getattr(raw, f"servo{number}_raw") for number in range(1, 17)] == [1044, 2000, *(900,) * 14]
    status = only(peer.send(command_long(REQUEST_MESSAGE, 375)), "ACTUATOR_OUTPUT_STATUS")[0]
    assert status.active == 16
    assert status.actuator == pytest.approx([1044.9, 1999.99999, *(900.0,) * 14, *(0.0,) * 16])


def test_places_lose_their_fractions() -> None:
    """They are not rounded (streams/HOME_POSITION.hpp, GLOBAL_POSITION_INT.hpp)."""
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    topics = peer.topics
    topics.home_position = topics.home_position._replace(lat=47.39774209, lon=-8.54559409)
    home = only(peer.send(command_long(REQUEST_MESSAGE, 242)), "HOME_POSITION")[0]
    assert (home.latitude, home.longitude) == (473_977_420, -85_455_940)
    topics.vehicle_global_position = topics.vehicle_global_position._replace(lat=47.39774209, lon=-8.54559409)
    place = only(peer.send(command_long(REQUEST_MESSAGE, 33)), "GLOBAL_POSITION_INT")[0]
    assert (place.lat, place.lon) == (473_977_420, -85_455_940)


def test_a_rovers_target_tells_no_motion() -> None:
    """Nobody publishes vehicle_local_position_setpoint there (streams/POSITION_TARGET_GLOBAL_INT.hpp)."""
    peer = Peer(kind=VehicleKind.ROVER_ACKERMANN)
    peer.topics.actuator_armed = ActuatorArmed(armed=True)
    peer.topics.position_setpoint_triplet = PositionSetpointTriplet(
        1_000, current=PositionSetpoint(valid=True, lat=47.4, lon=8.5, alt=ALT_M)
    )
    target = only(peer.send(command_long(REQUEST_MESSAGE, 87)), "POSITION_TARGET_GLOBAL_INT")[0]
    assert (target.lat_int, target.vx, target.afz, target.yaw, target.yaw_rate) == (474_000_000, 0.0, 0.0, 0.0, 0.0)


def test_who_only_ever_controlled_rates_has_no_target_attitude() -> None:
    """As in acro from the start (streams/ATTITUDE_TARGET.hpp)."""
    peer = Peer()
    peer.now_us = 1_000_000
    peer.topics.vehicle_rates_setpoint = VehicleRatesSetpoint(1_000_000, (0.5, 0.0, 0.0))
    target = only(peer.send(command_long(REQUEST_MESSAGE, 83)), "ATTITUDE_TARGET")[0]
    assert (target.q, target.body_roll_rate, target.time_boot_ms) == ([0.0] * 4, 0.5, 0)


def test_odometry_is_in_the_local_frame() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    odometry = only(peer.send(command_long(REQUEST_MESSAGE, 331)), "ODOMETRY")[0]
    assert (odometry.frame_id, odometry.child_frame_id) == (mavlink.MAV_FRAME_LOCAL_NED,) * 2
    assert (odometry.vx, odometry.vy) == (0.5, 0.0)


def test_odometry_tells_the_variances_of_its_filter_and_0_for_what_couples_them() -> None:
    """x, y, z, roll, pitch, yaw lie at 0, 6, 11, 15, 18, 20 (streams/ODOMETRY.hpp); it counts every reset."""
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    topics = peer.topics
    topics.vehicle_attitude = topics.vehicle_attitude._replace(q=(1.0, 0.0, 0.0, 0.0), quat_reset_counter=16)
    topics.odometry_variances = OdometryVariances(1, (1e-4, 2e-4, 4e-4), (0.02, 0.03, 0.25), (2.0, 3.0, 9.0))
    topics.vehicle_local_position = topics.vehicle_local_position._replace(
        xy_reset_counter=1, z_reset_counter=2, vxy_reset_counter=4, vz_reset_counter=8, timestamp_sample=900
    )
    told = only(peer.send(command_long(REQUEST_MESSAGE, 331)), "ODOMETRY")[0]
    pose, velocity = [0.0] * 21, [0.0] * 21
    pose[0], pose[6], pose[11], pose[15], pose[18], pose[20] = 2.0, 3.0, 9.0, 1e-4, 2e-4, 4e-4
    velocity[0], velocity[6], velocity[11] = 0.02, 0.03, 0.25
    assert told.pose_covariance == pytest.approx(pose)
    assert told.velocity_covariance == pytest.approx(velocity)
    assert (told.reset_counter, told.time_usec, told.quality) == (31, 900, 0)


def test_airspeed_is_not_measured_and_the_altitude_is_the_filters_or_the_barometers() -> None:
    """NaN, so that nobody takes it for standing still (streams/VFR_HUD.hpp)."""
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    hud = only(peer.send(command_long(REQUEST_MESSAGE, 74)), "VFR_HUD")[0]
    assert math.isnan(hud.airspeed)
    assert (hud.alt, hud.groundspeed) == (pytest.approx(ALT_M + 3.0, abs=1e-3), 0.5)
    peer.topics.vehicle_local_position = peer.topics.vehicle_local_position._replace(timestamp=5_000, ref_alt=math.nan)
    assert only(peer.send(command_long(REQUEST_MESSAGE, 74)), "VFR_HUD")[0].alt == 489.0
    peer.topics.vehicle_air_data = VehicleAirData()
    assert only(peer.send(command_long(REQUEST_MESSAGE, 74), ONBOARD), "VFR_HUD")[0].alt == 0.0


def test_a_vehicle_that_does_not_know_the_globe_tells_its_place_in_its_own_frame() -> None:
    """By vision or flow alone; PX4 tells every local position there is (streams/LOCAL_POSITION_NED.hpp)."""
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.vehicle_local_position = peer.topics.vehicle_local_position._replace(ref_lat=math.nan, ref_lon=math.nan)
    place = only(peer.send(command_long(REQUEST_MESSAGE, 32)), "LOCAL_POSITION_NED")[0]
    assert (place.x, place.y, place.z, place.vx) == (1.0, 2.0, -3.0, 0.5)


def test_the_wind_is_told_once_an_estimate_with_its_variance() -> None:
    peer = Peer()
    peer.fly_and_run(0.1)
    peer.topics.wind = WindEstimate(peer.now_us, 3.0, -4.0, 0.25, 0.5)
    told = only(peer.run(5.0), "WIND_COV")
    assert [(wind.wind_x, wind.wind_y, wind.var_horiz, wind.var_vert) for wind in told] == [(3.0, -4.0, 0.75, 0.0)]
    assert told[0].wind_alt == pytest.approx(ALT_M + 3.0, abs=1e-3)


def test_heights_without_a_home_are_above_the_origin() -> None:
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.home_position = HomePosition()
    altitude = only(peer.send(command_long(REQUEST_MESSAGE, 141)), "ALTITUDE")[0]
    assert (altitude.altitude_relative, altitude.altitude_local) == (3.0, 3.0)
    position = only(peer.send(command_long(REQUEST_MESSAGE, 33)), "GLOBAL_POSITION_INT")[0]
    assert position.relative_alt == position.alt == 492_400, "but here above the sea (GLOBAL_POSITION_INT.hpp)"
    peer.now_us += 1
    peer.topics.vehicle_local_position = peer.topics.vehicle_local_position._replace(z_valid=False)
    altitude = only(peer.send(command_long(REQUEST_MESSAGE, 141)), "ALTITUDE")[0]
    assert altitude.altitude_monotonic == 489.0
    assert math.isnan(altitude.altitude_local)


def test_a_home_without_a_place_in_the_local_frame_is_told_at_its_origin() -> None:
    """As the receiver alone gives it; PX4's home_position_s begins with zeros."""
    peer = Peer()
    peer.now_us = 1_000
    peer.fly()
    peer.topics.home_position = HomePosition(1_000, True, 47.4, 8.5, ALT_M, yaw=0.0)
    home = only(peer.send(command_long(REQUEST_MESSAGE, 242)), "HOME_POSITION")[0]
    assert (home.latitude, home.x, home.y, home.z, list(home.q)) == (474_000_000, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0])
    assert only(peer.send(command_long(REQUEST_MESSAGE, 141)), "ALTITUDE")[0].altitude_relative == 3.0
    location = only(peer.send(command_long(REQUEST_MESSAGE, 12901)), "OPEN_DRONE_ID_LOCATION")[0]
    assert location.height == 3.0


def test_a_receiver_that_does_not_tell_its_accuracy_is_shown_without() -> None:
    """Another simulator may send HIL_GPS with unknown DOP."""
    peer = Peer()
    peer.fly_and_run(0.5)
    peer.topics.sensor_gps = peer.topics.sensor_gps._replace(timestamp=peer.now_us, eph=math.nan, epv=math.nan)
    message = only(peer.send(command_long(512, 24)), "GPS_RAW_INT")[0]
    assert (message.h_acc, message.v_acc) == (0, 0)


def test_high_latency_tells_all_in_one() -> None:
    peer = Peer()
    peer.now_us = 1_000_000
    peer.fly()
    told = only(peer.send(command_long(512, 235)), "HIGH_LATENCY2")[0]
    assert (told.latitude, told.longitude, told.altitude) == (473977420, 85455940, 492)
    assert (told.type, told.autopilot, told.battery, told.wp_num) == (13, 12, 100, 0)
    assert told.custom_mode == 4 | 3 << 8
    assert (told.groundspeed, told.throttle, told.climb_rate) == (0, 0, 0), "nothing counts in the first"
    assert (told.eph, told.epv, told.temperature_air) == (255, 255, -128)
    peer.fly_and_run(0.1)
    told = only(peer.send(command_long(512, 235)), "HIGH_LATENCY2")[0]
    assert (told.groundspeed, told.battery, told.wp_num) == (3, 100, 65535), "2.5, away from zero"
    assert (told.eph, told.epv, told.temperature_air) == (9, 18, 15)


def test_high_latency_tells_what_is_not_well() -> None:
    peer = Peer()
    peer.now_us = 1_000_000
    peer.fly()
    peer.topics.failsafe_flags = FailsafeFlags(manual_control_signal_lost=False, offboard_control_signal_lost=True)
    peer.topics.battery_status = peer.topics.battery_status._replace(warning=2)
    peer.topics.geofence_result = GeofenceResult(custom_fence_triggered=True)
    told = only(peer.send(command_long(REQUEST_MESSAGE, 235)), "HIGH_LATENCY2")[0]
    assert told.failure_flags == 128 | 512 | 2048
    for gps, fault, flags in ((4, 0, 1 | 4096), (0, 1, 4096)):
        peer.now_us += 1
        peer.fly()
        status = peer.topics.estimator_status
        peer.topics.estimator_status = status._replace(gps_check_fail_flags=gps, filter_fault_flags=fault)
        told_then = only(peer.send(command_long(REQUEST_MESSAGE, 235)), "HIGH_LATENCY2")[0]
        assert told_then.failure_flags & (1 | 4096) == flags


def test_remote_identification() -> None:
    peer = Peer()
    peer.now_us = 10_000_000
    peer.fly()
    peer.topics.sensor_gps = peer.topics.sensor_gps._replace(vel_n_m_s=-3.0, vel_e_m_s=4.0, vel_d_m_s=-0.5)
    location = only(peer.send(command_long(REQUEST_MESSAGE, 12901)), "OPEN_DRONE_ID_LOCATION")[0]
    assert (location.direction, location.speed_horizontal, location.speed_vertical) == (12700, 500, 50)
    assert (location.status, location.height, location.altitude_geodetic) == (1, 3.0, 489.0)
    assert (location.horizontal_accuracy, location.vertical_accuracy, location.speed_accuracy) == (12, 5, 3)
    assert (location.timestamp, location.timestamp_accuracy) == (65535.0, 0), "the simulated receiver knows no date"
    assert only(peer.send(command_long(REQUEST_MESSAGE, 12904)), "OPEN_DRONE_ID_SYSTEM")[0].timestamp == 0
    peer.topics.sensor_gps = peer.topics.sensor_gps._replace(fix_type=0)
    location = only(peer.send(command_long(REQUEST_MESSAGE, 12901)), "OPEN_DRONE_ID_LOCATION")[0]
    assert (location.speed_horizontal, location.speed_accuracy, location.latitude) == (500, 0, 0)
    peer.topics.vehicle_status = VehicleStatus(armed=True, failsafe=True)
    location = only(peer.send(command_long(REQUEST_MESSAGE, 12901)), "OPEN_DRONE_ID_LOCATION")[0]
    assert location.status == 3
    peer.now_us += 11_000_000
    location = only(peer.send(command_long(REQUEST_MESSAGE, 12901)), "OPEN_DRONE_ID_LOCATION")[0]
    unknown = (location.direction, location.speed_horizontal, location.speed_vertical, location.latitude)
    assert unknown == (36100, 25500, 6300, 0)


def test_high_latency_tells_of_all_the_time_since_its_last_message_on_the_link() -> None:
    """MavlinkStreamHighLatency2::update_data: averages, the greatest climb and error, and changes of the mission."""
    peer = Peer()
    peer.now_us = 1_000_000
    peer.fly()

    def asked(link: int = GCS) -> Any:
        return only(peer.send(command_long(REQUEST_MESSAGE, 235), link), "HIGH_LATENCY2")[0]

    asked()
    for speed, thrust in ((2.0, 0.3), (4.0, 0.5)):
        peer.now_us += 4_000
        peer.fly()
        topics, now_us = peer.topics, peer.now_us
        topics.vehicle_local_position = topics.vehicle_local_position._replace(vx=speed, vz=-speed)
        topics.sensor_gps = topics.sensor_gps._replace(eph=3.0 / speed)
        topics.vehicle_thrust_setpoint = VehicleThrustSetpoint(now_us, (0.0, 0.0, -thrust))
        topics.vehicle_status = VehicleStatus(timestamp=now_us, armed=True)
        topics.vehicle_air_data = VehicleAirData(now_us, ambient_temperature=19.6)
        topics.mission_result = MissionResult(now_us, seq_current=1, seq_total=3)
        peer.mavlink.update(now_us)
    told = asked()
    assert (told.groundspeed, told.throttle, told.temperature_air) == (15, 40, 20)
    assert (told.climb_rate, told.eph, told.wp_num) == (40, 15, 1)
    again = asked()
    assert (again.groundspeed, again.throttle, again.temperature_air, again.eph) == (0, 0, -128, 255)
    assert again.wp_num == 65535
    assert asked(ONBOARD).groundspeed == 0, "the first there"


def test_high_latency_of_a_vehicle_that_knows_nothing() -> None:
    told = only(Peer().send(command_long(512, 235)), "HIGH_LATENCY2")[0]
    assert (told.latitude, told.eph, told.battery) == (0, 255, -1)
