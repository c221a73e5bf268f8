"""What turning the vehicle takes of the motors."""

import pytest

from sitl_emu.autopilot.control.control_power import ControlPower
from sitl_emu.autopilot.topics import Topics


def test_mean_squares_come_twice_a_second_and_begin_anew() -> None:
    """As a PX4 v1.18 logs them, at 389.6, 390.1, 390.6 s (MulticopterRateControl::updateActuatorControlsStatus)."""
    topics = Topics()
    power = ControlPower(topics)
    told_us = []
    for tick in range(1, 501):
        strength = 0.2 if tick <= 125 else 0.1
        power.add(tick * 4_000, (strength, -2.0 * strength, 0.0), 0.004)
        status = topics.actuator_controls_status
        if status.timestamp == tick * 4_000:
            told_us.append(status.timestamp)
            assert status.control_power == pytest.approx((strength**2, 4.0 * strength**2, 0.0))
    assert told_us == [500_000, 1_000_000, 1_500_000, 2_000_000]
