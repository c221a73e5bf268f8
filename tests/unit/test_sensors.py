"""Sensors: what the simulator sends, in SI units."""

import math
import statistics
from itertools import pairwise

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.logger.packing import unpacked
from sitl_emu.autopilot.logger.rows.sensors import battery_status
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.sensors.sensors import Sensors, altitude_m
from sitl_emu.autopilot.system.failure_injection import inject
from sitl_emu.autopilot.topics import ActuatorArmed, BatteryStatus, FailureInjection, Topics, VehicleStatus, topic_names
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.simulator_api import DistanceSensor, HilGps, HilSensor, HilStateQuaternion, SimulatedBattery
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

IMU = HilSensor(8000, 1.0, 2.0, -9.8, 0.1, 0.2, 0.3, 0.2, 0.0, 0.4, 955.0, 0.0, 0.0, 15.0, 0b1101111111111, 0)


def sensors(**parameters: float) -> tuple[Sensors, Topics]:
    topics = Topics()
    return Sensors(topics, Parameters(VehicleKind.MULTICOPTER, parameters)), topics


def test_time_is_the_imu_s() -> None:
    reader, topics = sensors()
    assert reader.update([IMU]) == 8000
    assert topics.sensor_combined.gyro_rad_s == (0.1, 0.2, 0.3)
    assert topics.sensor_mag.magnetometer_ga == (0.2, 0.0, 0.4)
    assert topics.sensor_baro.pressure_pa == pytest.approx(95500.0)


def test_what_is_not_updated_stays() -> None:
    reader, topics = sensors()
    reader.update([IMU])
    reader.update([IMU._replace(time_usec=12000, xmag=9.0, abs_pressure=1.0, fields_updated=0b111111)])
    assert topics.sensor_mag.timestamp == topics.sensor_baro.timestamp == 8000
    assert topics.sensor_combined.timestamp == 12000


@pytest.mark.parametrize("model", ["sihsim_hex", "sihsim_rover_ackermann"])
def test_means_of_a_built_in_simulator_s_magnetometer_spread_as_in_px4(model: str) -> None:
    """PX4 v1.18: by 0.0112 to 0.0150 gauss along x (flights/sihsim_hex/noise_at_rest), 14.27 a second (its log).

    Its means are of 1 and 6 samples in turn first, then of 2 and 5, and of 3 and 4 in the end.
    """
    reader, topics = sensors()
    simulator = VehicleSimulator(vehicles.load(model), Home(47.397742, 8.545594, 489.4, 0.0), 1, FlatGround())
    samples, counts, told = 0, list[int](), list[float]()
    for _ in range(int(120.0 / 0.004)):
        sampled_us, mean_us = topics.sensor_mag.timestamp, topics.vehicle_magnetometer.timestamp_sample
        reader.update(simulator.tick(None))
        samples += topics.sensor_mag.timestamp != sampled_us
        if topics.vehicle_magnetometer.timestamp_sample != mean_us:
            counts, samples = [*counts, samples], 0
            told.append(topics.vehicle_magnetometer.magnetometer_ga[0])
    assert 0.0112 < statistics.pstdev(told) < 0.0150
    assert len(counts) / 120.0 == pytest.approx(14.27, abs=0.02)
    assert set(counts[1:14]) == {1, 6} and 1 not in counts[-700:]
    assert all(six_or_eight in {6, 7, 8} for six_or_eight in map(sum, pairwise(counts[1:])))


def test_pressure_altitude_is_the_standard_atmosphere_s() -> None:
    assert altitude_m(1013.25, 1013.25) == 0.0
    assert altitude_m(898.746, 1013.25) == pytest.approx(1000.0, abs=0.5)
    # the least and the greatest of a measured log
    assert altitude_m(953.955859375, 1013.25) == pytest.approx(505.784, abs=0.002)
    assert altitude_m(955.87859375, 1013.25) == pytest.approx(488.990, abs=0.002)


def test_the_air_is_as_warm_as_nobody_measured_whatever_the_barometer_s_temperature() -> None:
    """VehicleAirData's AirTemperatureUpdate; a real PX4 v1.18 (SIH) logged 15 °C while its sensor_baro said 11.8."""
    reader, topics = sensors()
    reader.update([IMU._replace(time_usec=100_000, temperature=-40.0)])
    assert topics.vehicle_air_data.ambient_temperature == 15.0
    assert topics.vehicle_air_data.rho == pytest.approx(95_500.0 / (287.1 * 288.15))


def test_gps_units() -> None:
    reader, topics = sensors()
    gps = HilGps(4000, 473977400, 85455940, 488123, 90, 178, 500, 100, -200, 30, 0, 3, 10, 0, 0)
    reader.update([gps, IMU])
    fix = topics.sensor_gps
    assert (fix.latitude_deg, fix.longitude_deg) == pytest.approx((47.39774, 8.545594))
    assert (fix.altitude_msl_m, fix.eph, fix.epv) == pytest.approx((488.123, 0.9, 1.78))
    assert (fix.vel_n_m_s, fix.vel_e_m_s, fix.vel_d_m_s) == pytest.approx((1.0, -2.0, 0.3))
    reader.update([gps._replace(eph=65535), IMU])
    assert math.isnan(topics.sensor_gps.eph)


@pytest.mark.parametrize(
    ("distance_cm", "told", "distance_m", "quality"),
    [(350, 0, 3.5, -1), (350, 100, 3.5, 100), (1201, 0, math.nan, 0), (350, 1, 3.5, 0), (1201, 1, math.nan, 0)],
)
def test_distance_out_of_range_is_nan_and_worth_nothing(
    distance_cm: int, told: int, distance_m: float, quality: int
) -> None:
    reader, topics = sensors()
    reader.update([DistanceSensor(4, 20, 1200, distance_cm, 0, 0, 25, 0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), told), IMU])
    assert topics.distance_sensor.current_distance == pytest.approx(distance_m, nan_ok=True)
    assert topics.distance_sensor.signal_quality == quality


def test_a_distance_below_the_ground_is_negative_and_worth_nothing() -> None:
    """As in PX4's SIH, whose DISTANCE_SENSOR has 16 bits of it."""
    reader, topics = sensors()
    reader.update([DistanceSensor(4, 0, 10_000, 65_497, 0, 0, 25, 0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 1), IMU])
    assert topics.distance_sensor.current_distance == pytest.approx(-0.39)
    assert topics.distance_sensor.signal_quality == 0


def test_a_forward_lidar_is_no_height() -> None:
    reader, topics = sensors()
    reader.update([DistanceSensor(4, 20, 1200, 300, 0, 0, 0, 0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 0), IMU])
    assert topics.distance_sensor.timestamp == 0


@pytest.mark.parametrize(("percent", "warning"), [(100, 0), (15, 0), (14.9, 1), (7, 1), (6.9, 2), (4.9, 3)])
def test_battery_warns_by_its_thresholds(percent: float, warning: int) -> None:
    reader, topics = sensors()
    reader.update([SimulatedBattery(15.0, 10.0, percent), IMU])
    assert topics.battery_status.warning == warning
    assert topics.battery_status.connected and topics.battery_status.voltage_v == 15.0


def test_without_a_current_sensor_the_average_current_fades_away() -> None:
    """In the measured log from 15 A to 0.018 A, never to less than none."""
    reader, topics = sensors(BAT1_N_CELLS=4)
    topics.actuator_armed = ActuatorArmed(armed=True)
    average = []
    for tick in range(1, 1600):
        reader.update([SimulatedBattery(16.2, math.nan, 100), IMU._replace(time_usec=tick * 200_000)])
        average.append(topics.battery_status.current_average_a)
    assert average[0] == pytest.approx(15.0)
    assert average == sorted(average, reverse=True)
    assert average[-1] == pytest.approx(15.0 * math.exp(-320.0 / 50.0), rel=0.05)


@pytest.mark.parametrize(("voltage_v", "connected"), [(0.0, False), (2.0, False), (2.2, True)])
def test_a_battery_without_voltage_is_not_connected(voltage_v: float, connected: bool) -> None:
    """Such as one of no cells (BAT1_N_CELLS 0)."""
    reader, topics = sensors(BAT1_N_CELLS=0)
    for _ in range(3):
        reader.update([SimulatedBattery(voltage_v, math.nan, 100), IMU])
    assert topics.battery_status.connected is connected


def test_a_battery_that_another_source_tells_of_is_not_ours() -> None:
    reader, topics = sensors(BAT1_N_CELLS=4, BAT1_SOURCE=1)
    reader.update([SimulatedBattery(16.2, math.nan, 100), IMU])
    assert not topics.battery_status.connected


def test_without_a_drain_at_boot_there_is_no_battery_of_ours() -> None:
    """init.d-posix/rcS: battery_simulator starts with SIM_BAT_DRAIN greater than 0; what a component tells stands."""
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, {"BAT1_N_CELLS": 4, "SIM_BAT_DRAIN": 0.0})
    reader = Sensors(topics, parameters)
    parameters.set("SIM_BAT_DRAIN", 60.0)
    reader.update([SimulatedBattery(16.2, math.nan, 100), IMU])
    assert topics.battery_status.timestamp == 0
    topics.battery_status = told = BatteryStatus(4_000, True, 3.5, 1.0, 0.06, warning=2)
    for now_us in range(200_000, 400_001, 4_000):
        reader.update([SimulatedBattery(16.2, math.nan, 100), IMU._replace(time_usec=now_us)])
    assert topics.battery_status is told


def test_a_drain_of_zero_in_flight_leaves_the_battery_that_was_there_at_boot() -> None:
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, {"BAT1_N_CELLS": 4})
    reader = Sensors(topics, parameters)
    parameters.set("SIM_BAT_DRAIN", 0.0)
    reader.update([SimulatedBattery(16.2, math.nan, 100), IMU])
    assert topics.battery_status.connected


def test_a_battery_is_told_a_hundred_times_a_second_until_another_source_tells_of_it() -> None:
    """BatterySimulator.hpp; a simulator measures it five times a second."""
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, {"BAT1_N_CELLS": 4})
    reader = Sensors(topics, parameters)
    told = set[int]()

    def run(from_us: int, to_us: int) -> int:
        told.clear()
        for now_us in range(from_us, to_us, 4000):
            measured = [SimulatedBattery(16.2, 36.0, 100)] if now_us % 200_000 == 0 else []
            reader.update([IMU._replace(time_usec=now_us), *measured])
            told.add(topics.battery_status.timestamp)
        return len(told)

    assert run(200_000, 2_200_000) == pytest.approx(200, abs=12)
    assert topics.battery_status.discharged_mah == pytest.approx(36.0 * 1.8 / 3.6)
    parameters.set("BAT1_SOURCE", 1)
    assert run(2_200_000, 4_200_000) <= 2, "the last, and one that was due before the parameter was read"


def test_what_a_component_tells_of_a_battery_stands_until_the_next_sample_of_ours() -> None:
    """Both are the first battery (mavlink_receiver.h, BatterySimulator.hpp); ours goes on from what it was."""
    reader, topics = sensors(BAT1_N_CELLS=4)
    reader.update([IMU._replace(time_usec=200_000), SimulatedBattery(16.0, 36.0, 90)])
    topics.battery_status = BatteryStatus(200_000, True, 3.5, 1.0, 0.06, warning=2)
    reader.update([IMU._replace(time_usec=204_000)])
    assert topics.battery_status.warning == 2
    reader.update([IMU._replace(time_usec=212_000)])
    assert (topics.battery_status.voltage_v, topics.battery_status.remaining) == (16.0, 0.9)
    topics.battery_status = BatteryStatus(212_000, True, 3.5, 1.0, 0.06, 5.0, warning=2)
    reader.update([IMU._replace(time_usec=400_000), SimulatedBattery(16.0, 36.0, 90)])
    assert topics.battery_status.remaining == pytest.approx(0.9)
    assert topics.battery_status.discharged_mah == pytest.approx(36.0 * 0.2 / 3.6)


def test_a_disarmed_vehicle_draws_what_bat1_i_overwrite_says() -> None:
    reader, topics = sensors(BAT1_N_CELLS=4, BAT1_I_OVERWRITE=0.5)
    for armed, expected in ((False, 0.5), (True, 3.0)):
        topics.vehicle_status = topics.vehicle_status._replace(armed=armed)
        reader.update([SimulatedBattery(16.2, 3.0, 100), IMU])
        assert topics.battery_status.current_a == expected


def test_battery_counts_what_was_drawn() -> None:
    reader, topics = sensors()
    reader.update([IMU._replace(time_usec=0)])
    reader.update([SimulatedBattery(15.0, 10.0, 90)])
    reader.update([IMU._replace(time_usec=36_000_000)])
    reader.update([SimulatedBattery(15.0, 10.0, 80)])
    assert topics.battery_status.discharged_mah == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("capacity_mah", "percent", "expected"),
    [
        (-1.0, 50, 0.5),
        (10_000.0, 100, 0.9),  # 10 A for 360 s: no more is left, whatever the voltage says
        (2_000.0, 40, 0.4 - 10.0 * 0.01 / 3600.0 / 2.0 / (0.03 * 0.6)),  # by voltage, and what is drawn meanwhile
    ],
)
def test_the_charge_of_a_known_capacity_is_fused_with_what_was_drawn(
    capacity_mah: float, percent: int, expected: float
) -> None:
    """Battery::estimateStateOfCharge, once it has been connected for two seconds."""
    reader, topics = sensors(BAT1_CAPACITY=capacity_mah, BAT1_N_CELLS=4)
    for tick in range(1801):
        reader.update([IMU._replace(time_usec=tick * 200_000), SimulatedBattery(15.0, 10.0, percent)])
        if tick == 10:
            assert topics.battery_status.remaining == pytest.approx(percent * 1e-2)
    assert topics.battery_status.remaining == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("parameter", "capacity", "logged"), [(-1.0, 0, 0), (4200.0, 4200, 4200), (70e3, 70_000, 4464)]
)
def test_a_battery_tells_the_capacity_that_it_was_given(parameter: float, capacity: int, logged: int) -> None:
    """Battery::getBatteryStatus; the field has 16 bits."""
    reader, topics = sensors(BAT1_CAPACITY=parameter)
    reader.update([IMU, SimulatedBattery(15000, 1000, 90)])
    assert topics.battery_status.capacity == capacity
    told = {name: value for _, name, value in unpacked("battery_status", battery_status(topics.battery_status))}
    assert told["capacity"] == logged


def test_the_time_that_remains() -> None:
    """10 Ah, 90 % full: at 15 A (BAT_AVRG_CURRENT) at first, at the average of what was drawn in flight then."""
    reader, topics = sensors(BAT1_CAPACITY=10_000.0)
    reader.update([IMU._replace(time_usec=0)])
    reader.update([SimulatedBattery(15.0, 30.0, 90)])
    assert topics.battery_status.time_remaining_s == pytest.approx(0.9 * 10.0 / 15.0 * 3600.0)
    topics.actuator_armed = ActuatorArmed(armed=True)
    reader.update([IMU._replace(time_usec=50_000_000)])
    reader.update([SimulatedBattery(15.0, 30.0, 90)])
    average_a, left = 15.0 + (30.0 - 15.0) * (1.0 - math.exp(-1.0)), topics.battery_status.remaining
    assert topics.battery_status.time_remaining_s == pytest.approx(left * 10.0 / average_a * 3600.0)
    reader, topics = sensors()
    reader.update([SimulatedBattery(15.0, 30.0, 90)])
    assert math.isnan(topics.battery_status.time_remaining_s)


def test_charge_follows_in_a_second() -> None:
    reader, topics = sensors()
    reader.update([IMU._replace(time_usec=200_000)])
    reader.update([SimulatedBattery(16.0, math.nan, 80)])
    for tick in range(2, 7):
        reader.update([IMU._replace(time_usec=tick * 200_000)])
        reader.update([SimulatedBattery(16.0, math.nan, 0)])
    assert topics.battery_status.remaining == pytest.approx(0.8 * math.exp(-1.0), abs=0.001)


def inject_failure(topics: Topics, unit: int, kind: int) -> None:
    failures = inject(topics.failure_injection, unit, kind, 0)
    assert failures is not None
    topics.failure_injection = failures


def test_injected_failures_silence_the_gps_and_empty_the_battery() -> None:
    reader, topics = sensors()
    gps = HilGps(4000, 473977400, 85455940, 488123, 90, 178, 500, 100, -200, 30, 0, 3, 10, 0, 0)
    inject_failure(topics, 4, 1)
    reader.update([gps, IMU])
    assert topics.sensor_gps.timestamp == 0
    inject_failure(topics, 4, 0)
    reader.update([gps, IMU])
    assert topics.sensor_gps.timestamp == 4000
    inject_failure(topics, 100, 1)
    reader.update([SimulatedBattery(16.0, math.nan, 80), IMU])
    assert topics.battery_status.remaining == 0.0 and topics.battery_status.warning == 3


@pytest.mark.parametrize(
    ("simulated_by_px4", "above_m", "velocity_change"), [(1, 0.0, (0.0, 0.0, 0.0)), (0, 100.0, (5.0, -8.0, 2.0))]
)
def test_a_gps_that_is_stuck_or_wrong(
    simulated_by_px4: int, above_m: float, velocity_change: tuple[float, float, float]
) -> None:
    """SensorGpsSim.cpp and SimulatorMavlink.cpp."""
    reader, topics = sensors(SENS_EN_GPSSIM=simulated_by_px4)
    gps = HilGps(4000, 473977400, 85455940, 488123, 90, 178, 500, 100, -200, 30, 0, 3, 10, 0, 0)
    reader.update([gps, IMU])
    first = topics.sensor_gps
    inject_failure(topics, 4, 2)
    reader.update([gps._replace(time_usec=8000, lat=480000000), IMU])
    assert topics.sensor_gps == first._replace(timestamp=8000)
    assert topics.sensor_gps.timestamp_sample == (
        4000 if simulated_by_px4 else 0
    )  # too old for the estimator, or as new
    inject_failure(topics, 4, 4)
    reader.update([gps._replace(time_usec=12000), IMU])
    wrong = topics.sensor_gps
    assert (wrong.latitude_deg, wrong.longitude_deg) == (first.latitude_deg + 1.0, first.longitude_deg + 1.0)
    assert wrong.altitude_msl_m == pytest.approx(first.altitude_msl_m + above_m)
    velocity = (wrong.vel_n_m_s, wrong.vel_e_m_s, wrong.vel_d_m_s)
    told = (first.vel_n_m_s, first.vel_e_m_s, first.vel_d_m_s)
    assert velocity == pytest.approx([old + change for old, change in zip(told, velocity_change, strict=True)])


def test_an_imu_that_measures_what_nothing_can_is_clipped() -> None:
    reader, topics = sensors()
    reader.update([IMU._replace(xacc=1e38, ygyro=-1e30)])
    assert topics.sensor_imu.accelerometer_m_s2 == (20_000.0, 2.0, -9.8)
    assert topics.sensor_imu.gyro_rad_s == pytest.approx((0.1, -math.radians(2000.0), 0.3))


def test_gyro_accelerometer_magnetometer_and_barometer_off_and_stuck() -> None:
    reader, topics = sensors()
    every = IMU._replace(fields_updated=0x1FFF)
    reader.update([every])
    seen = (topics.sensor_imu, topics.sensor_mag, topics.sensor_baro)
    later = every._replace(time_usec=8000, xgyro=0.5, xacc=5.0, xmag=0.4, abs_pressure=900.0)
    for unit in (0, 2, 3):
        inject_failure(topics, unit, 1)
    reader.update([later])
    assert (topics.sensor_imu, topics.sensor_mag, topics.sensor_baro) == seen
    for unit in (0, 2, 3):
        inject_failure(topics, unit, 2)
    reader.update([later])
    assert topics.sensor_imu.timestamp == topics.sensor_mag.timestamp == topics.sensor_baro.timestamp == 8000
    assert topics.sensor_imu.gyro_rad_s == seen[0].gyro_rad_s
    assert topics.sensor_imu.accelerometer_m_s2[0] == topics.sensor_imu.raw_accelerometer_m_s2[0] == 5.0
    assert topics.sensor_mag.magnetometer_ga == seen[1].magnetometer_ga
    assert topics.sensor_baro.baro_alt_m == seen[2].baro_alt_m
    inject_failure(topics, 0, 0)
    inject_failure(topics, 1, 1)
    reader.update([later._replace(time_usec=12000)])
    assert topics.sensor_combined.timestamp == 8000


def test_what_px4_simulates_itself_takes_no_notice_of_failures() -> None:
    """Asked of a real PX4 (SIH): compass and barometer off or stuck change nothing there."""
    reader, topics = sensors(SENS_EN_MAGSIM=1, SENS_EN_BAROSIM=1)
    for unit in (0, 1, 2, 3):
        inject_failure(topics, unit, 1)
    reader.update([IMU._replace(fields_updated=0x1FFF)])
    assert topics.sensor_imu.timestamp == topics.sensor_mag.timestamp == topics.sensor_baro.timestamp == 8000


@pytest.mark.parametrize("left_out", [True, False])
def test_what_px4_simulates_itself_is_left_out_of_a_start_by_0(left_out: bool) -> None:
    """px4-rc.sihsim; a later change counts at the next start alone, and what comes from outside is not touched."""
    names = ("SENS_EN_GPSSIM", "SENS_EN_MAGSIM", "SENS_EN_BAROSIM")
    parameters = Parameters(VehicleKind.MULTICOPTER, dict.fromkeys(names, int(left_out)))
    topics = Topics()
    for name in names:
        parameters.set(name, 0)
    reader = Sensors(topics, parameters)
    for name in names:
        parameters.set(name, 1)
    gps = HilGps(8000, 473977400, 85455940, 488123, 90, 178, 500, 100, -200, 30, 0, 3, 10, 0, 0)
    reader.update([gps, IMU._replace(fields_updated=0x1FFF)])
    stamps = topics.sensor_gps.timestamp, topics.sensor_mag.timestamp, topics.sensor_baro.timestamp
    assert stamps == ((0, 0, 0) if left_out else (8000, 8000, 8000))
    assert topics.sensor_imu.timestamp == 8000


def test_nobody_gets_what_a_disabled_sensor_says() -> None:
    """CAL_…_PRIO 0 (VehicleMagnetometer, VehicleAirData)."""
    ids = {"CAL_MAG0_ID": 197388, "CAL_BARO0_ID": 6620172, "CAL_MAG0_PRIO": 0, "CAL_BARO0_PRIO": 0}
    for disabled in (True, False):
        reader, topics = sensors(**(ids if disabled else {}))
        for tick in range(1, 50):
            reader.update([IMU._replace(time_usec=tick * 4000, fields_updated=0x1FFF)])
        assert topics.sensor_mag.timestamp == topics.sensor_baro.timestamp == 49 * 4000
        assert (topics.vehicle_magnetometer.timestamp == 0) is disabled
        assert (topics.vehicle_air_data.timestamp == 0) is disabled


def test_who_says_the_same_for_too_long_is_not_listened_to() -> None:
    """DataValidator: vehicle_air_data is told no more after 100 equal numbers, vehicle_magnetometer after 1000."""
    reader, topics = sensors(SENS_MAG_RATE=50.0, SENS_BARO_RATE=50.0)
    every = IMU._replace(fields_updated=0x1FFF)

    def tell(first: int, last: int, *, stuck: bool) -> None:
        for n in range(first, last):
            change = 0.0 if stuck else 1e-3 * (n % 2)
            now_us = n * 20_000
            reader.update([every._replace(time_usec=now_us, xmag=0.2 + change, abs_pressure=955.0 + change)])

    tell(1, 10, stuck=False)
    tell(10, 400, stuck=True)
    assert topics.sensor_mag.timestamp == topics.sensor_baro.timestamp == 399 * 20_000
    assert topics.vehicle_magnetometer.timestamp == 342 * 20_000
    assert topics.vehicle_air_data.timestamp == 43 * 20_000
    tell(400, 402, stuck=False)
    assert topics.vehicle_magnetometer.timestamp == topics.vehicle_air_data.timestamp == 401 * 20_000


def test_a_compass_is_not_calibrated_anew_while_armed() -> None:
    """VehicleMagnetometer::ParametersUpdate; a gyro is."""
    ids = {"CAL_MAG0_ID": DEVICE_IDS["MAG"], "CAL_GYRO0_ID": DEVICE_IDS["GYRO"]}
    topics, parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, ids)
    reader, every = Sensors(topics, parameters), IMU._replace(fields_updated=0x1FFF)
    topics.vehicle_status = VehicleStatus(armed=True)
    parameters.set("CAL_MAG0_XOFF", 0.5)
    parameters.set("CAL_GYRO0_XOFF", 0.05)
    reader.update([every])
    assert topics.sensor_mag.magnetometer_ga == (0.2, 0.0, 0.4)
    assert topics.sensor_imu.gyro_rad_s[0] == pytest.approx(0.05)
    topics.vehicle_status = VehicleStatus(armed=False)
    parameters.set("SENS_BARO_QNH", 1000.0)
    reader.update([every._replace(time_usec=12_000)])
    assert topics.sensor_mag.magnetometer_ga == pytest.approx((-0.3, 0.0, 0.4))


def test_one_failure_at_a_time_and_never_too_many() -> None:
    failures = inject(FailureInjection(), 101, 1, 3)
    assert failures is not None
    assert [failures.type_of(101, motor) for motor in (2, 3, 4)] == [0, 1, 0]
    failures = inject(failures, 101, 4, 0)
    assert failures is not None and failures.type_of(101, 3) == 4
    assert inject(failures, 101, 1, 17) is failures
    failures = inject(failures, 101, 0, 0)
    assert failures == FailureInjection()
    full = FailureInjection(tuple((unit, 1, 1) for unit in range(16)))
    assert inject(full, 100, 1, 0) is None


def test_the_truth_is_kept_apart_from_what_is_flown_by() -> None:
    reader, topics = sensors()
    before = {name: getattr(topics, name) for name in topic_names(topics)}
    place, velocity = (473_977_420, 85_455_940, 488_000), (100, -200, 50)
    truth = HilStateQuaternion(5, (0.0, 1.0, 0.0, 0.0), 0.1, 0.2, 0.3, *place, *velocity, 0, 0, 0, 0, 0)
    reader.update([truth])
    reader.update([truth._replace(time_usec=9, lat=473_977_520, alt=490_000)])
    known = topics.groundtruth
    assert {name for name in before if getattr(topics, name) is not before[name]} == {"groundtruth"}
    assert (known.timestamp, known.ref_timestamp, known.q, known.xyz) == (9, 5, (0.0, 1.0, 0.0, 0.0), (0.1, 0.2, 0.3))
    assert (known.vx, known.vy, known.vz) == (1.0, -2.0, 0.5)
    assert (known.x, known.y, known.z) == pytest.approx((1.112, 0.0, -2.0), abs=1e-3)
    assert (known.lat, known.ref_lat, known.ref_alt) == pytest.approx((47.397752, 47.397742, 488.0))
