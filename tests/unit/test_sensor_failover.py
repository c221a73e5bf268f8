"""When a compass or a barometer is said to have failed."""

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.sensors.data_validator import BARO_EQUAL_VALUES, MAG_EQUAL_VALUES, DataValidator
from sitl_emu.autopilot.sensors.sensor_failover import SensorFailover

STEP_US = 20_000


class Watched:
    """A sensor at 50 Hz, and what is said of it."""

    def __init__(self, sensor: str = "MAG") -> None:
        self.validator = DataValidator(MAG_EQUAL_VALUES if sensor == "MAG" else BARO_EQUAL_VALUES)
        self.said: list[tuple[float, Severity, str, tuple[float, ...]]] = []
        self.failover = SensorFailover(sensor, self.validator, self._say)
        self.now_us = 0

    def _say(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        assert event in ("sensor_failover_mag", "sensor_failover_baro")
        self.said.append((self.now_us * 1e-6, severity, text, arguments))

    def run(self, seconds: float, says: str = "something") -> None:
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.now_us += STEP_US
            if says != "nothing":
                value = 0.2 if says == "the same" else 0.2 + 1e-5 * (self.now_us // STEP_US % 7)
                self.validator.put(self.now_us, (value, value, value))
            self.failover.update(self.now_us)


def test_silence_is_told_after_three_tenths_of_a_second_and_once() -> None:
    """As a real PX4 v1.18 (SIH) told it when its simulated magnetometer was stopped."""
    compass = Watched()
    compass.run(1.0)
    compass.run(10.0, "nothing")
    ((at, *told),) = compass.said
    assert at == pytest.approx(1.32)
    assert told == [Severity.EMERGENCY, "MAG #0 failed:  TIMEOUT!\t", (0, 4)]


def test_a_barometer_is_told_by_its_name() -> None:
    """Asked of a real PX4: CAL_BARO0_PRIO 0, which disables it."""
    barometer = Watched("BARO")
    barometer.run(1.0)
    barometer.run(1.0, "nothing")
    assert [text for _, _, text, _ in barometer.said] == ["BARO #0 failed:  TIMEOUT!\t"]


def test_a_compass_that_never_spoke_has_not_failed() -> None:
    compass = Watched()
    compass.run(5.0, "nothing")
    assert compass.said == []


@pytest.mark.parametrize(("sensor", "samples"), [("MAG", 335), ("BARO", 35)])
def test_the_same_for_too_long_is_stale(sensor: str, samples: int) -> None:
    watched = Watched(sensor)
    watched.run(1.0)
    watched.run(10.0, "the same")
    assert [(text, told) for _, _, text, told in watched.said] == [(f"{sensor} #0 failed:  STALE!\t", (0, 2))]
    assert watched.said[0][0] == pytest.approx(1.0 + samples * 0.02, abs=0.03)


def test_a_compass_that_was_well_again_may_fail_again_but_not_within_three_seconds() -> None:
    compass = Watched()
    for _ in range(3):
        compass.run(1.0)
        compass.run(1.0, "nothing")
    assert [at for at, *_ in compass.said] == pytest.approx([1.32, 5.32], abs=0.03)
