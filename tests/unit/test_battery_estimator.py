"""What a battery's voltage and current tell of its cells."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu.autopilot.sensors.battery_estimator import BatteryEstimator

STEP_S = 0.2


@settings(deadline=None)
@given(cell_ohm=st.floats(0.002, 0.02), open_circuit_v=st.floats(14.0, 16.8))
def test_the_resistance_is_learnt_from_changing_load(cell_ohm: float, open_circuit_v: float) -> None:
    estimator = BatteryEstimator(4, open_circuit_v, 0.0)
    for n in range(600):
        current_a = 20.0 + 10.0 * math.sin(0.3 * n)
        estimator.update(open_circuit_v - 4 * cell_ohm * current_a, current_a, STEP_S)
    assert estimator.resistance_ohm == pytest.approx(cell_ohm, rel=0.1)
    assert estimator.ocv_v == pytest.approx(open_circuit_v, abs=0.1)


def test_without_a_current_sensor_nothing_is_learnt() -> None:
    """-1 A is how PX4's battery says so: the numbers of its simulated battery (../shared/px4/ulog, battery_status)."""
    estimator = BatteryEstimator(4, 16.2, -1.0)
    for _ in range(100):
        estimator.update(15.3, -1.0, STEP_S)
    assert estimator.ocv_v == pytest.approx(16.18)
    assert estimator.ocv_of(15.3, -1.0) == pytest.approx(15.28)
    assert estimator.covariance_norm == pytest.approx(6.01332, abs=1e-4)
    assert (estimator.resistance_ohm, estimator.prediction_v, estimator.error_v) == (0.005, 0.0, 0.0)
