"""One calibration at a time, beside everything else: PX4's WorkerThread, and the commands that start it.

PREFLIGHT_CALIBRATION chooses by its parameters and is answered at once; all of them 0 cancels, or ends the calibration
of the remote control. While one runs every other request is TEMPORARILY_REJECTED, and answered once more by the one
that runs. Nothing starts while the vehicle is armed, nor is it armed while one runs.
"""

import math
from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.commander.calibration import (
    accelerometer,
    airspeed,
    barometer,
    gyro,
    level,
    magnetometer,
    remote_control,
)
from sitl_emu.autopilot.commander.calibration.bench import Bench, Steps
from sitl_emu.autopilot.commander.command_results import ACCEPTED, DENIED, TEMPORARILY_REJECTED, UNSUPPORTED
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleCommand

NOT_A_NUMBER = -1
TEMPERATURE: Final = 3
REMOTE_CONTROL: Final = 4
CALIBRATIONS: dict[tuple[int, int], Callable[[Bench], Steps]] = {
    (1, 1): gyro.calibrate,
    (2, 1): magnetometer.calibrate,
    (3, 1): barometer.calibrate,
    (4, 2): remote_control.calibrate_trims,
    (5, 1): accelerometer.calibrate,
    (5, 2): level.calibrate,
    (5, 4): accelerometer.calibrate_quickly,
    (6, 1): airspeed.calibrate,
    (6, 2): airspeed.calibrate,
}
"""(number of the parameter of PREFLIGHT_CALIBRATION, its value)."""


class CalibrationWorker:
    """Runs calibrations; writes nothing but what they find out, into parameters."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say) -> None:
        self._bench = Bench(topics, parameters, say)
        self._say = say
        self._steps: Steps | None = None
        self.remote_control = False
        """The remote control is being calibrated by the ground station."""

    @property
    def busy(self) -> bool:
        """A calibration runs."""
        return self._steps is not None

    @property
    def calibrating(self) -> bool:
        """A calibration runs, or the remote control's; MAV_STATE_CALIBRATING."""
        return self._steps is not None or self.remote_control

    def update(self, now_us: int) -> None:
        """Every tick while it is busy."""
        self._bench.now_us = now_us
        if self._steps is not None:
            try:
                next(self._steps)
            except StopIteration:
                self._steps = None

    def hear(self, now_us: int, command: VehicleCommand) -> None:
        """Every command that comes: the calibration that runs looks whether the newest cancels it."""
        self._bench.hear(now_us, command)

    def preflight_calibration(self, now_us: int, command: VehicleCommand, *, armed: bool) -> int | None:
        """MAV_RESULT of PREFLIGHT_CALIBRATION; None for no ack."""
        if armed:
            return TEMPORARILY_REJECTED
        if self.busy:
            return TEMPORARILY_REJECTED
        asked = {number: _whole(value) for number, value in enumerate(command[1:8], 1)}
        if asked[1] != 1 and TEMPERATURE in (asked[1], asked[5], asked[7]):
            return None
        for number in range(1, 7):
            if number == REMOTE_CONTROL and asked[number] == 1:
                self.remote_control = True
                self._say(Severity.INFO, "Calibration: Disabling RC input\t", "commander_calib_rc_off")
                return ACCEPTED
            calibrate = CALIBRATIONS.get((number, asked[number]))
            if calibrate is not None:
                self._start(now_us, calibrate(self._bench))
                return ACCEPTED
        if asked[7] == 1:
            # Motor controllers: only without a battery, and the simulated one cannot be unplugged.
            self._say(Severity.CRITICAL, "[cal] calibration failed: Disconnect battery and try again")
            return DENIED
        if asked[REMOTE_CONTROL] != 0:
            return UNSUPPORTED
        if self.remote_control:
            self.remote_control = False
            self._say(Severity.INFO, "Calibration: Restoring RC input\t", "commander_calib_rc_on")
        return ACCEPTED

    def fixed_mag_cal_yaw(self, now_us: int, command: VehicleCommand, *, armed: bool) -> int:
        """FIXED_MAG_CAL_YAW: param1 heading in degrees, param3 and param4 a place, or the GPS's."""
        if armed or self.busy:
            return TEMPORARILY_REJECTED
        heading_deg = math.floor(command.param1 + 0.5) if math.isfinite(command.param1) else 0.0
        place = (command.param3, command.param4)
        if not all(map(math.isfinite, place)) or 0.0 in place:
            place = (math.nan, math.nan)
        steps = magnetometer.calibrate_by_heading(self._bench, math.radians(heading_deg), *place)
        self._start(now_us, steps)
        return ACCEPTED

    def _start(self, now_us: int, steps: Steps) -> None:
        self._bench.begin(now_us)
        self._steps = steps
        self.update(now_us)


def _whole(value: float) -> int:
    return int(value) if math.isfinite(value) else NOT_A_NUMBER
