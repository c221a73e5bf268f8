"""How long an autopilot waits for who has fallen silent, when its time runs faster than its partners' clocks.

PX4's SITL start-up script (ROMFS/px4fmu_common/init.d-posix/rcS, v1.18) sets three time-outs by PX4_SIM_SPEED_FACTOR,
on every start, whatever was saved. Without a factor, which is real time here, they stay as they are.
"""

from sitl_emu.autopilot.parameters import Value

TIMEOUTS_S = {"COM_DL_LOSS_T": 10.0, "COM_RC_LOSS_T": 1.0, "COM_OF_LOSS_T": 1.0}
"""At a factor of 1, as rcS has them."""


def loss_timeouts(speed: float) -> dict[str, Value]:
    """The parameters that PX4's start-up script sets for a speed factor; none in real time and without a limit."""
    if speed == 1.0 or speed == float("inf"):
        return {}
    return {name: seconds * speed for name, seconds in TIMEOUTS_S.items()}
