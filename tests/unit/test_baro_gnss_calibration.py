"""The barometer's height becomes the GNSS receiver's after a start: PX4's SENS_BAR_AUTOCAL."""

import math

import pytest

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.baro_gnss_calibration import BaroGnssCalibration
from sitl_emu.autopilot.sensors.sensors import altitude_m
from sitl_emu.autopilot.topics import EstimatorStatusFlags, SensorGps, Topics, VehicleAirData
from sitl_emu.autopilot.vehicle_kind import VehicleKind

TICK_US = 20_000
BARO_EVERY, GPS_EVERY = 5, 6
PRESSURE_HPA = 955.0
ALTITUDE_M = altitude_m(PRESSURE_HPA, 1013.25)


class Bench:
    """A vehicle on the ground whose receiver says another height than its barometer."""

    def __init__(self, **parameters: float) -> None:
        self.topics, self.parameters = Topics(), Parameters(VehicleKind.MULTICOPTER, parameters)
        self.calibration = BaroGnssCalibration(self.topics, self.parameters)
        self.topics.estimator_status_flags = EstimatorStatusFlags(cs_gps_hgt=True)
        self.ticks = 0
        self.gps_above_m = -0.4
        self.epv_m = 1.78

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.ticks += 1
            now_us = self.ticks * TICK_US
            if self.ticks % BARO_EVERY == 0:
                corrected_hpa = PRESSURE_HPA - 0.01 * float(self.parameters["CAL_BARO0_OFF"])
                baro_alt_m = altitude_m(corrected_hpa, 1013.25)
                self.topics.vehicle_air_data = VehicleAirData(now_us, now_us, baro_alt_m, 100.0 * corrected_hpa)
            if self.ticks % GPS_EVERY == 0:
                altitude = ALTITUDE_M + self.gps_above_m
                self.topics.sensor_gps = SensorGps(now_us, altitude_msl_m=altitude, epv=self.epv_m)
            self.calibration.update()

    @property
    def offset_pa(self) -> float:
        return float(self.parameters["CAL_BARO0_OFF"])


def test_it_comes_after_two_windows_and_is_halved_down_to_0_1_m_and_told_once() -> None:
    bench = Bench()
    bench.run(4.0)
    assert bench.offset_pa == 0.0
    told = bench.parameters.notifications
    bench.run(0.6)
    assert bench.offset_pa == pytest.approx(-10_000 / 2**11)
    assert bench.parameters["CAL_BARO0_PRIO"] == 50
    assert bench.parameters.notifications == told + 1


def test_it_comes_once() -> None:
    bench = Bench()
    bench.run(5.0)
    bench.gps_above_m = 5.0
    bench.run(20.0)
    assert bench.offset_pa == pytest.approx(-10_000 / 2**11)


@pytest.mark.parametrize("flags", [{"cs_gps_hgt": True, "cs_in_air": True}, {"cs_baro_hgt": True}])
def test_it_does_not_come_in_the_air_or_without_heights_of_the_receiver(flags: dict[str, bool]) -> None:
    bench = Bench()
    bench.topics.estimator_status_flags = EstimatorStatusFlags(**flags)
    bench.run(10.0)
    assert bench.offset_pa == 0.0


@pytest.mark.parametrize("parameter", [{"SENS_BAR_AUTOCAL": 0}, {"SENS_EN_BAROSIM": 1}])
def test_it_does_not_come_where_nobody_wants_it_or_px4_simulates_the_barometer(parameter: dict[str, float]) -> None:
    """Sih's starts: facts/sihsim_hex/volatile/params."""
    bench = Bench(**parameter)
    bench.run(10.0)
    assert bench.offset_pa == 0.0


@pytest.mark.parametrize("epv_m", [8.1, math.nan])
def test_a_receiver_that_is_not_sure_is_waited_for(epv_m: float) -> None:
    bench = Bench()
    bench.epv_m = epv_m
    bench.run(10.0)
    assert bench.offset_pa == 0.0
    bench.epv_m = 1.78
    bench.run(4.0)
    assert bench.offset_pa == 0.0
    bench.run(1.0)
    assert bench.offset_pa != 0.0


def test_a_difference_that_has_changed_by_more_than_4_m_is_watched_on() -> None:
    bench = Bench()
    bench.run(2.5)
    bench.gps_above_m = 10.0
    bench.run(4.0)
    assert bench.offset_pa == 0.0
    bench.run(4.0)
    assert altitude_m(PRESSURE_HPA - 0.01 * bench.offset_pa, 1013.25) == pytest.approx(ALTITUDE_M + 10.0, abs=0.1)


def test_a_simulator_whose_air_is_another_planet_s_keeps_its_barometer() -> None:
    bench = Bench()
    bench.gps_above_m = 3000.0
    bench.run(10.0)
    assert bench.offset_pa == 0.0
