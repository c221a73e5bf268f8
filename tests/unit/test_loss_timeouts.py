"""Time-outs of a launch that runs faster or slower than real time, as PX4's rcS sets them."""

import math

import pytest

from sitl_emu.run.loss_timeouts import loss_timeouts


@pytest.mark.parametrize(
    ("speed", "link_s", "sticks_s", "offboard_s"),
    [(3.0, 30.0, 3.0, 3.0), (0.5, 5.0, 0.5, 0.5), (20.0, 200.0, 20.0, 20.0)],
)
def test_partners_keep_their_time_to_answer(speed: float, link_s: float, sticks_s: float, offboard_s: float) -> None:
    assert loss_timeouts(speed) == {"COM_DL_LOSS_T": link_s, "COM_RC_LOSS_T": sticks_s, "COM_OF_LOSS_T": offboard_s}


@pytest.mark.parametrize("speed", [1.0, math.inf])
def test_without_a_factor_they_stay(speed: float) -> None:
    assert loss_timeouts(speed) == {}
