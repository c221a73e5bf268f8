"""Trims: sticks that are let go and do not rest at zero are made to (PX4's rc_calibration.cpp, do_trim_calibration).

It asks only whether sticks have ever been told of, and manual_control tells of some at its start, at zero, where there
are none (ManualControl::processInput): so without sticks nothing is trimmed, and that is done.
"""

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps

WAIT_US = 400_000
TRIMS = ("TRIM_ROLL", "TRIM_PITCH", "TRIM_YAW")
SCALES = ("FW_MAN_R_SC", "FW_MAN_P_SC", "FW_MAN_Y_SC")


def calibrate_trims(bench: Bench) -> Steps:
    """Add the sticks to TRIM_*, which a fixed wing flies by; that it looks for them announces them."""
    yield from bench.sleep(WAIT_US)
    sticks = bench.topics.manual_control_setpoint
    bench.parameters.use(TRIMS + SCALES)
    # A pitch trim adds to the actuators, which move the other way.
    for trim, scale, stick in zip(TRIMS, SCALES, (sticks.roll, -sticks.pitch, sticks.yaw), strict=True):
        bench.parameters.set(trim, stick * float(bench.parameters[scale]) + float(bench.parameters[trim]))
    bench.info("trim cal done\t", "commander_cal_trim_done")
    return True
