"""A gyro's offset that is put right while the vehicle stands still: PX4's gyro_calibration."""

import math
import random

import pytest

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.gyro_calibration import GyroCalibration
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS, corrected_gyro, corrections_of, is_calibrated
from sitl_emu.autopilot.topics import SensorImu, Topics, Vector3
from sitl_emu.autopilot.vehicle_kind import VehicleKind

TICK_US = 20_000
CALIBRATED = {"CAL_GYRO0_ID": DEVICE_IDS["GYRO"]}
G = 9.80665


class Bench:
    """A vehicle that stands, its gyro a little noisy."""

    def __init__(self, **parameters: float) -> None:
        self.topics, self.parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, {**CALIBRATED, **parameters})
        self.calibration = GyroCalibration(self.topics, self.parameters)
        self.now_us = 1_000_000
        self.noise = random.Random(1)
        self.noise_rad_s = 0.003
        self.bias: Vector3 = (0.0, 0.0, 0.0)
        self.accel: Vector3 = (0.0, 0.0, -G)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            x, y, z = (value + self.noise.gauss(0.0, self.noise_rad_s) for value in self.bias)
            rates = corrected_gyro((x, y, z), corrections_of(self.parameters))
            self.topics.sensor_imu = SensorImu(self.now_us, rates, self.accel)
            self.calibration.update(self.now_us)

    @property
    def offset(self) -> list[float]:
        return [float(self.parameters[f"CAL_GYRO0_{axis}OFF"]) for axis in "XYZ"]


def test_an_offset_that_is_wrong_is_put_right_after_5_s() -> None:
    bench = Bench(CAL_GYRO0_XOFF=0.1)
    bench.run(4.9)
    assert bench.offset[0] == pytest.approx(0.1)
    bench.run(0.3)
    assert bench.offset == pytest.approx([0.0, 0.0, 0.0], abs=0.001)
    assert bench.parameters["CAL_GYRO0_PRIO"] == 50


def test_what_is_right_within_10_mrad_a_second_stays() -> None:
    bench = Bench()
    bench.bias = (0.005, -0.005, 0.005)
    bench.run(20.0)
    assert bench.offset == [0.0, 0.0, 0.0]
    assert bench.parameters["CAL_GYRO0_PRIO"] == -1


def test_a_gyro_without_a_calibration_gets_one() -> None:
    bench = Bench(CAL_GYRO0_ID=0)
    bench.run(5.5)
    assert is_calibrated(bench.parameters, "GYRO")


@pytest.mark.parametrize("what", ["off", "armed", "calibrated", "shaken", "noisy", "turned"])
def test_it_waits_for_rest(what: str) -> None:
    bench = Bench(CAL_GYRO0_XOFF=0.1, IMU_GYRO_CAL_EN=what != "off")
    status = bench.topics.vehicle_status
    bench.topics.vehicle_status = status._replace(armed=what == "armed", calibrating=what == "calibrated")
    bench.noise_rad_s = 0.1 if what == "noisy" else 0.003
    for step in range(50):
        if what == "shaken":
            bench.accel = (0.4 * (step % 2), 0.5 * (step % 3), -G)
        elif what == "turned":
            bench.accel = (0.0, G * math.sin(0.1 * step), -G * math.cos(0.1 * step))
        bench.run(0.2)
    assert bench.offset[0] == pytest.approx(0.1)


def test_a_change_of_a_parameter_makes_it_wait() -> None:
    bench = Bench(CAL_GYRO0_XOFF=0.1)
    bench.run(4.0)
    bench.parameters.set("MPC_XY_CRUISE", 7.0)
    bench.run(4.9)
    assert bench.offset[0] == pytest.approx(0.1)
    bench.run(0.3)
    assert bench.offset[0] == pytest.approx(0.0, abs=0.001)
