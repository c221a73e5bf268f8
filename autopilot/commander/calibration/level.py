"""Level horizon calibration: the attitude at rest is how the board is mounted (PX4's level_calibration.cpp).

It is turned by what the board was thought to lean, so that the mean is all of it.
"""

import math

from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.core.attitude import euler, product, quaternion

DURATION_US = 500_000
MOST_TRIES = 50
MOST_MOTION_RAD = math.radians(0.5)
MOST_TILT_RAD = 0.8
REPORT_EVERY_PERCENT = 20


def calibrate(bench: Bench) -> Steps:
    """Write SENS_BOARD_X_OFF and SENS_BOARD_Y_OFF; it can't be cancelled."""
    bench.started("level")
    roll_deg, pitch_deg = (float(bench.parameters[f"SENS_BOARD_{axis}_OFF"]) for axis in "XY")
    board = quaternion(math.radians(roll_deg), math.radians(pitch_deg), 0.0)
    for _ in range(MOST_TRIES):
        attitudes: list[tuple[float, float]] = []
        roll = pitch = 0.0
        start_us, reported = bench.now_us, -REPORT_EVERY_PERCENT
        while bench.now_us - start_us < DURATION_US:
            yield
            percent = 100 * (bench.now_us - start_us) // DURATION_US
            if percent >= reported + REPORT_EVERY_PERCENT:
                reported = percent
                bench.progress(percent)
            attitudes.append(bench.topics.vehicle_attitude.euler[:2])
            told = euler(product(board, quaternion(*attitudes[-1], 0.0)))
            roll, pitch = roll + told[0], pitch + told[1]
        rolls, pitches = zip(*attitudes, strict=True)
        still = max(rolls) - min(rolls) < MOST_MOTION_RAD and max(pitches) - min(pitches) < MOST_MOTION_RAD
        if still:
            break
    bench.progress(100)
    roll, pitch = roll / len(rolls), pitch / len(pitches)
    trouble = ""
    if not still:
        trouble = "motion during calibration"
    elif abs(roll) > MOST_TILT_RAD:
        trouble = "excess roll angle"
    elif abs(pitch) > MOST_TILT_RAD:
        trouble = "excess pitch angle"
    if trouble:
        bench.critical(trouble)
        return (yield from bench.failed("level"))
    for axis, tilt in (("X", roll), ("Y", pitch)):
        bench.parameters.set(f"SENS_BOARD_{axis}_OFF", math.degrees(tilt))
    return (yield from bench.done("level"))
