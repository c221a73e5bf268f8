"""What a viewer of PX4's simulation is told of a launched vehicle: on the port that PX4's Hawkeye listens to."""

import contextlib
import time
from typing import Any

import pytest
from pymavlink import mavutil

from tests.launched import launched

INSTANCE = 118
WANTED = {"HEARTBEAT", "HIL_STATE_QUATERNION", "HIL_ACTUATOR_CONTROLS"}
HOME_DEG = (47.397742, 8.545594)
"""PX4 SITL's."""


def test_the_true_pose_and_the_outputs_come_without_being_asked_for() -> None:
    viewer = mavutil.mavlink_connection(f"udpin:0.0.0.0:{19410 + INSTANCE}", dialect="common")
    with contextlib.closing(viewer), launched("iris", "--instance", str(INSTANCE)):
        end = time.monotonic() + 30.0
        told: dict[str, Any] = {}
        while told.keys() != WANTED:
            assert time.monotonic() < end, f"only {sorted(told)} came"
            message = viewer.recv_match(type=WANTED, blocking=True, timeout=1.0)
            if message is not None:
                assert message.get_srcSystem() == INSTANCE + 1
                told[message.get_type()] = message
    truth = told["HIL_STATE_QUATERNION"]
    assert (truth.lat * 1e-7, truth.lon * 1e-7) == pytest.approx(HOME_DEG, abs=1e-4)
    assert told["HIL_ACTUATOR_CONTROLS"].controls[:4] == pytest.approx([0.0] * 4)
