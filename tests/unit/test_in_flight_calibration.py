"""What the estimator learns of biases becomes the sensors' calibration."""

import pytest

from sitl_emu.autopilot.estimator.stable_bias import LEARNING_US, StableBias
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.in_flight_calibration import QUIET_US, InFlightCalibration
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.topics import EstimatorSensorBias, Topics, Vector3
from sitl_emu.autopilot.vehicle_kind import VehicleKind

SECOND_US = 1_000_000
ZERO: Vector3 = (0.0, 0.0, 0.0)
CALIBRATED = {f"CAL_{sensor}0_ID": DEVICE_IDS[sensor] for sensor in ("ACC", "GYRO", "MAG")}


class Bench:
    """A calibrated hexacopter, whose estimator says what the test wants."""

    def __init__(self) -> None:
        self.topics, self.parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, CALIBRATED)
        self.calibration = InFlightCalibration(self.topics, self.parameters)
        self.now_us = 10 * SECOND_US

    def arm(self, armed: bool) -> None:
        self.topics.vehicle_status = self.topics.vehicle_status._replace(armed=armed)
        self.step()

    def step(self, seconds: int = 1) -> None:
        self.now_us += seconds * SECOND_US
        self.topics.estimator_sensor_bias = self.topics.estimator_sensor_bias._replace(timestamp=self.now_us)
        self.calibration.update(self.now_us)

    def fly(self, told: EstimatorSensorBias) -> None:
        """A flight in which the estimator tells this of the biases; then disarm."""
        self.topics.estimator_sensor_bias = told
        self.arm(True)
        self.step()
        self.arm(False)

    def offset(self, sensor: str) -> tuple[float, ...]:
        return tuple(float(self.parameters[f"CAL_{sensor}0_{axis}OFF"]) for axis in "XYZ")


def accel(bias: Vector3, *, stable: bool = True) -> EstimatorSensorBias:
    return EstimatorSensorBias(accel_bias=bias, accel_bias_valid=True, accel_bias_stable=stable)


def gyro(bias: Vector3) -> EstimatorSensorBias:
    return EstimatorSensorBias(gyro_bias=bias, gyro_bias_valid=True, gyro_bias_stable=True)


def mag(bias: Vector3, variance: float) -> EstimatorSensorBias:
    spread = (variance, variance, variance)
    return EstimatorSensorBias(mag_bias=bias, mag_bias_variance=spread, mag_bias_valid=True, mag_bias_stable=True)


def test_a_stable_accelerometer_bias_is_saved_after_disarming_and_told() -> None:
    bench = Bench()
    before = bench.parameters.notifications
    bench.topics.estimator_sensor_bias = accel((0.1, 0.0, -0.2))
    bench.arm(True)
    assert bench.offset("ACC") == ZERO
    bench.arm(False)
    assert bench.offset("ACC") == pytest.approx((0.1, 0.0, -0.2))
    assert bench.parameters.notifications == before + 1
    assert {"CAL_ACC0_XOFF", "CAL_ACC0_ZOFF"} <= bench.parameters.unsaved


def test_the_next_bias_is_added_but_not_before_half_a_minute() -> None:
    bench = Bench()
    bench.fly(accel((0.1, 0.0, 0.0)))
    bench.fly(accel((0.1, 0.0, 0.0)))
    assert bench.offset("ACC") == pytest.approx((0.1, 0.0, 0.0))
    bench.step(QUIET_US // SECOND_US)
    bench.fly(accel((0.1, 0.0, 0.0)))
    assert bench.offset("ACC") == pytest.approx((0.2, 0.0, 0.0))


@pytest.mark.parametrize(
    "told",
    [
        accel((0.04, 0.0, 0.0)),
        accel((0.3, 0.0, 0.0), stable=False),
        gyro((0.009, 0.0, 0.0)),
    ],
    ids=["small", "unstable", "small-gyro"],
)
def test_what_is_small_or_unsure_is_not_saved(told: EstimatorSensorBias) -> None:
    bench = Bench()
    bench.fly(told)
    assert bench.offset("ACC") == bench.offset("GYRO") == ZERO
    assert not bench.parameters.unsaved


def test_sens_imu_autocal_switches_it_off() -> None:
    bench = Bench()
    bench.parameters.set("SENS_IMU_AUTOCAL", 0)
    bench.fly(accel((0.1, 0.0, 0.0)))
    assert bench.offset("ACC") == ZERO


def test_a_magnetometer_draws_near_to_what_was_learnt_the_more_the_surer_that_is() -> None:
    offsets = []
    for variance in (2.5e-6, 2.5e-5):
        bench = Bench()
        bench.fly(mag((0.1, 0.0, 0.0), variance))
        offsets.append(bench.offset("MAG")[0])
    assert offsets == pytest.approx([0.05, 0.1 / 11.0])


def test_a_bias_is_stable_after_ten_seconds_of_learning() -> None:
    stable, variances = StableBias(), (1e-5, 1e-5, 1e-5)
    for now_us in range(SECOND_US, LEARNING_US + 2 * SECOND_US, SECOND_US):
        assert not stable.stable
        stable.update(now_us, (0.01, 0.0, 0.0), variances, 0.4, valid=True, learning=True)
    stable.update(LEARNING_US + 2 * SECOND_US, (0.01, 0.0, 0.0), variances, 0.4, valid=True, learning=True)
    assert stable.stable
    stable.update(LEARNING_US + 3 * SECOND_US, (0.2, 0.0, 0.0), variances, 0.4, valid=True, learning=True)
    moved = stable.stable
    assert not moved


def test_a_filter_fault_makes_what_was_learnt_worthless() -> None:
    stable = StableBias()
    for now_us in (SECOND_US, LEARNING_US, 2 * LEARNING_US):
        stable.update(now_us, ZERO, (1e-5, 1e-5, 1e-5), 0.4, valid=True, learning=True)
    assert stable.stable
    stable.update(3 * LEARNING_US, ZERO, (1e-5, 1e-5, 1e-2), 0.4, valid=True, learning=True)
    spread_too_far = stable.stable
    assert not spread_too_far
