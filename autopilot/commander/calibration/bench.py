"""What a running calibration sees and says: the sensors, the time, the ground station, its cancelling.

A calibration is a generator: it runs until it has to wait, yields, and goes on at the next tick. What it returns says
whether it succeeded. Texts are those that QGroundControl's and MAVSDK's calibration follow (PX4's
calibration_messages.h, version 2).
"""

import math
from collections.abc import Generator

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import (
    DEVICE_IDS,
    INTERNAL_PRIORITY,
    corrections_of,
    raw_accel,
    raw_gyro,
    raw_mag,
)
from sitl_emu.autopilot.topics import Topics, Vector3, VehicleCommand
from sitl_emu.core import dialect as mavlink

Steps = Generator[None, None, bool]
Wait = Generator[None, None, None]
TEXT_US = 20_000
"""PX4 pauses so long after a text, so that none is lost."""
END_US = 600_000
SILENCE_US = 100_000_000
"""A sensor that says nothing for so long ends the calibration."""
CANCEL_CHECK_US = 200_000
"""While it samples, PX4 looks no more often for somebody who cancels."""
PRIORITIES = range(101)


class Bench:
    """Handed to the calibration that runs."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say) -> None:
        self.topics = topics
        self.parameters = parameters
        self._say = say
        self.corrections = corrections_of(parameters)
        """What stands between sensors and topics, as of the calibration's start."""
        self.now_us = 0
        self._command: VehicleCommand | None = None
        self._command_us = 0

    def begin(self, now_us: int) -> None:
        """Another calibration starts."""
        self.now_us = now_us
        self.corrections = corrections_of(self.parameters)

    def hear(self, now_us: int, command: VehicleCommand) -> None:
        """A command came, of whatever kind: PX4's calibrations see the newest alone."""
        self._command, self._command_us = command, now_us

    # --- what is said ------------------------------------------------------------------------------------------

    def info(self, text: str, event: str = "") -> None:
        """Tell how it goes."""
        self._say(Severity.INFO, text, event)

    def critical(self, text: str, event: str = "") -> None:
        """Tell what is wrong."""
        self._say(Severity.CRITICAL, text, event)

    def emergency(self, text: str) -> None:
        """Tell what must not be missed."""
        self._say(Severity.EMERGENCY, text)

    def started(self, sensor: str) -> None:
        """It begins."""
        self.info(f"[cal] calibration started: 2 {sensor}")

    def progress(self, percent: float) -> None:
        """0 to 100."""
        self.info(f"[cal] progress <{int(percent)}>")

    def done(self, sensor: str) -> Steps:
        """It ended well."""
        self.info(f"[cal] calibration done: {sensor}")
        yield from self.sleep(END_US)
        return True

    def failed(self, sensor: str) -> Steps:
        """It ended badly."""
        self.critical(f"[cal] calibration failed: {sensor}")
        yield from self.sleep(END_US)
        return False

    def silent_sensor(self) -> None:
        """There is nothing to measure."""
        self.critical("[cal] calibration failed: reading sensor")

    # --- time and cancelling -----------------------------------------------------------------------------------

    def sleep(self, duration_us: int) -> Wait:
        """Wait."""
        until_us = self.now_us + duration_us
        while self.now_us < until_us:
            yield

    def cancelled(self, since_us: int) -> bool:
        """Whether somebody has asked for the end since then, which is told and answered; other requests are denied.

        The newest command is looked at again and again, and denied each time, until there is another
        (calibration_routines.cpp, calibrate_cancel_check).
        """
        command = self._command
        if command is None or self._command_us <= since_us or not command.from_external:
            return False
        if command.command != mavlink.MAV_CMD_PREFLIGHT_CALIBRATION:
            return False
        if any(int(value) for value in command[1:7] if value == value):
            text = f"command denied during calibration: {command.command}\t"
            self._say(Severity.CRITICAL, text, "commander_cal_cmd_denied", command.command)
            answer_later(self.topics, command, CommandResult(mavlink.MAV_RESULT_DENIED))
            return False
        self.critical("[cal] calibration cancelled")
        answer_later(self.topics, command, CommandResult(mavlink.MAV_RESULT_ACCEPTED))
        return True

    # --- sensors -----------------------------------------------------------------------------------------------

    def next_imu(self) -> Generator[None, None, bool]:
        """Wait for a sample of gyro and accelerometer; False when none comes."""
        last_us, since_us = self.topics.sensor_combined.timestamp, self.now_us
        while self.topics.sensor_combined.timestamp == last_us:
            if self.now_us - since_us > SILENCE_US:
                return False
            yield
        return True

    def gyro(self) -> Vector3:
        """The gyro's newest sample, uncorrected, rad/s."""
        return raw_gyro(self.topics.sensor_combined.gyro_rad_s, self.corrections)

    def accel(self) -> Vector3:
        """The accelerometer's newest sample, uncorrected, m/s²."""
        return raw_accel(self.topics.sensor_combined.accelerometer_m_s2, self.corrections)

    def mag(self) -> Vector3:
        """The magnetometer's newest sample, uncorrected, gauss."""
        return raw_mag(self.topics.sensor_mag.magnetometer_ga, self.corrections)

    def save(self, sensor: str, *, priority: int | None = None, **vectors: Vector3) -> None:
        """Write CAL_<sensor>0_*: the device, its priority, and X, Y, Z of each vector by its suffix (OFF, SCALE, …).

        Without `priority` that which it has stays, where it is one (ParametersSave of lib/sensor_calibration).
        """
        if priority is None:
            has = int(self.parameters[f"CAL_{sensor}0_PRIO"])
            priority = has if has in PRIORITIES else INTERNAL_PRIORITY
        self.parameters.set(f"CAL_{sensor}0_ID", DEVICE_IDS[sensor])
        self.parameters.set(f"CAL_{sensor}0_PRIO", priority)
        for suffix, values in vectors.items():
            for axis, value in zip("XYZ", values, strict=True):
                self.parameters.set(f"CAL_{sensor}0_{axis}{suffix}", value)


class CancelWatch:
    """Somebody who cancels while samples are taken: looked for every 200 ms, from its making on."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._since_us = self._checked_us = bench.now_us

    def cancelled(self) -> bool:
        """Whether it is cancelled; between two looks it is not."""
        if self._bench.now_us - self._checked_us <= CANCEL_CHECK_US:
            return False
        self._checked_us = self._bench.now_us
        return self._bench.cancelled(self._since_us)


def changed(old: Vector3, new: Vector3, least: float) -> Vector3:
    """What a calibration keeps: no change that is too small, and none that is no number (set_offset, set_scale)."""
    return new if all(map(math.isfinite, new)) and math.dist(old, new) > least else old
