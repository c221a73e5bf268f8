"""Preflight calibrations on simulated time: what is told, how long they take, what they write, how they end."""

import math
from collections.abc import Callable

import pytest

from sitl_emu.autopilot.commander.calibration.worker import CalibrationWorker
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import (
    DEVICE_IDS,
    NONE,
    ZERO,
    corrected_accel,
    corrected_gyro,
    corrected_mag,
    corrections_of,
    is_calibrated,
    raw_accel,
    raw_gyro,
    raw_mag,
)
from sitl_emu.autopilot.topics import (
    ManualControlSetpoint,
    SensorBaro,
    SensorCombined,
    SensorGps,
    SensorMag,
    Topics,
    Vector3,
    VehicleAcceleration,
    VehicleAttitude,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.typed import now
from tests.unit.navigation_fake import FakeVehicle
from tests.unit.vehicle_command import vehicle_command

TICK_US = 4_000
G = 9.80665
ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = range(4)
GYRO, MAG, BARO, REMOTE_CONTROL, REST, ACCEL = (1,), (0, 1), (0, 0, 1), (0, 0, 0, 1), (0,), (0, 0, 0, 0, 1)
TRIMS = (0, 0, 0, 2)
LEVEL, QUICK, AIRSPEED, ESC = (0, 0, 0, 0, 2), (0, 0, 0, 0, 4), (0, 0, 0, 0, 0, 1), (0, 0, 0, 0, 0, 0, 1)
FORCES: dict[str, Vector3] = {
    "back": (G, 0.0, 0.0),
    "front": (-G, 0.0, 0.0),
    "left": (0.0, G, 0.0),
    "right": (0.0, -G, 0.0),
    "up": (0.0, 0.0, G),
    "down": (0.0, 0.0, -G),
}


class Table:
    """A vehicle on a table that somebody may turn, and its calibration worker."""

    def __init__(self) -> None:
        self.topics, self.parameters = Topics(), Parameters(VehicleKind.MULTICOPTER)
        self.said: list[str] = []
        self.worker = CalibrationWorker(self.topics, self.parameters, self._say)
        self.now_us = 0
        self.gyro: Callable[[float], Vector3] = lambda t: (0.0, 0.0, 0.0)
        self.accel: Callable[[float], Vector3] = lambda t: FORCES["down"]
        self.mag: Callable[[float], Vector3] = lambda t: (0.2, 0.0, 0.4)
        self.euler: Callable[[float], Vector3] = lambda t: (0.0, 0.0, 0.0)
        self.q = (1.0, 0.0, 0.0, 0.0)
        self.run(0.1)
        self.said.clear()

    def _say(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        self.said.append(text.rstrip("\t"))

    def command(self, *params: float, armed: bool = False) -> int | None:
        """The result of a PREFLIGHT_CALIBRATION."""
        command = vehicle_command(241, *params, rest=0.0)
        self.worker.hear(self.now_us, command)
        return self.worker.preflight_calibration(self.now_us, command, armed=armed)

    def run(self, seconds: float) -> None:
        """Let time go by."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            now_us, t = self.now_us, self.now_us * 1e-6
            self.topics.sensor_combined = SensorCombined(now_us, self.gyro(t), self.accel(t))
            self.topics.vehicle_acceleration = VehicleAcceleration(now_us, now_us, self.accel(t))
            if now_us % 64_000 == 0:
                self.topics.sensor_mag = SensorMag(now_us, self.mag(t))
            self.topics.vehicle_attitude = VehicleAttitude(now_us, self.q, self.euler(t))
            self.worker.update(now_us)

    def run_until_done(self, limit_s: float) -> float:
        """How long it took, s."""
        start_us = self.now_us
        while self.worker.busy:
            self.run(0.02)
            assert self.now_us - start_us < limit_s * 1e6, self.said[-5:]
        return (self.now_us - start_us) * 1e-6

    def answers(self) -> list[int]:
        """Later answers."""
        results = [ack.result for ack in self.topics.vehicle_command_acks]
        self.topics.vehicle_command_acks = ()
        return results


@pytest.fixture
def table() -> Table:
    return Table()


# --- which and when -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("asked", [GYRO, MAG, BARO, ACCEL, LEVEL, AIRSPEED, (0, 0, 0, 0, 0, 2)])
def test_each_says_that_it_begins(table: Table, asked: tuple[float, ...]) -> None:
    assert table.command(*asked) == ACCEPTED
    sensors: dict[tuple[float, ...], str] = {GYRO: "gyro", MAG: "mag", BARO: "baro", ACCEL: "accel", LEVEL: "level"}
    assert table.said[0] == f"[cal] calibration started: 2 {sensors.get(asked, 'airspeed')}"


def test_what_there_is_not(table: Table) -> None:
    assert table.command(9, 9, 9, 9, 9, 9, 9) == UNSUPPORTED
    assert table.command(*(math.nan,) * 7) == UNSUPPORTED
    assert table.command(3) is None  # temperature: PX4's module for it does not run in SITL
    assert table.command(*REST) == ACCEPTED
    assert table.said == []
    assert table.command(*ESC) == DENIED
    assert table.said == ["[cal] calibration failed: Disconnect battery and try again"]


def test_nothing_begins_while_armed_or_while_another_runs(table: Table) -> None:
    assert table.command(*GYRO, armed=True) == TEMPORARILY_REJECTED
    assert table.command(*ACCEL) == ACCEPTED
    table.run(0.5)
    assert table.command(*GYRO) == TEMPORARILY_REJECTED
    table.run(0.9)
    assert table.answers() == []  # it is not looked at before the side is measured
    table.run(7.0)
    assert table.answers() == [DENIED]
    assert "command denied during calibration: 241" in table.said
    assert table.worker.busy


def test_who_is_denied_is_denied_until_something_else_is_asked(table: Table) -> None:
    table.command(*GYRO)
    table.run(0.1)
    table.command(*ACCEL)
    table.run(0.65)
    assert table.answers() == [DENIED] * 3  # every 200 ms
    table.worker.hear(table.now_us, vehicle_command(400, 0.0, rest=0.0))
    table.run(0.4)
    assert table.answers() == []


def test_the_remote_control_is_shut_off_and_given_back(table: Table) -> None:
    assert table.command(*REMOTE_CONTROL) == ACCEPTED
    assert now(table.worker.calibrating) and not table.worker.busy
    assert table.command(*REST) == ACCEPTED
    assert not table.worker.calibrating
    assert table.said == ["Calibration: Disabling RC input", "Calibration: Restoring RC input"]


def test_without_sticks_nothing_is_trimmed_which_is_soon_done(table: Table) -> None:
    """PX4's manual_control tells of sticks at its start, too: rc_calibration.cpp asks for no more."""
    assert table.command(*TRIMS) == ACCEPTED
    table.run_until_done(1.0)
    assert table.said == ["trim cal done"]
    assert table.parameters["TRIM_ROLL"] == 0.0
    assert "TRIM_ROLL" in table.parameters.index and "FW_MAN_Y_SC" in table.parameters.index


def test_the_sticks_are_trimmed(table: Table) -> None:
    table.topics.manual_control_setpoint = ManualControlSetpoint(1, valid=True, roll=0.1, pitch=0.05, yaw=-0.02)
    table.parameters.set("TRIM_ROLL", 0.2)
    assert "TRIM_ROLL" not in table.parameters.index
    assert table.command(*TRIMS) == ACCEPTED
    assert table.run_until_done(1.0) == pytest.approx(0.4, abs=0.03)
    assert table.said[-1] == "trim cal done"
    trims = [table.parameters[name] for name in ("TRIM_ROLL", "TRIM_PITCH", "TRIM_YAW")]
    assert trims == pytest.approx([0.3, -0.05, -0.02])
    assert "TRIM_ROLL" in table.parameters.index and "FW_MAN_R_SC" in table.parameters.index


def test_while_the_remote_control_is_calibrated_nothing_else_is_but_arming_is_denied() -> None:
    """PX4's Commander: rc_calibration_in_progress is no calibration_enabled, and leaves servos prearmed."""
    vehicle = FakeVehicle(COM_PREARM_MODE=2)
    vehicle.run(6.0)
    assert vehicle.result(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 0, 0, 1) == ACCEPTED
    vehicle.step()
    status = vehicle.topics.vehicle_status
    assert status.rc_calibration_in_progress and not status.calibrating
    assert status.system_status == mavlink.MAV_STATE_CALIBRATING and vehicle.topics.actuator_armed.prearmed
    assert vehicle.arm() == TEMPORARILY_REJECTED
    assert "Arming denied: calibrating" in vehicle.take_texts()


# --- gyro ---------------------------------------------------------------------------------------------------


def test_a_gyro_at_rest(table: Table) -> None:
    table.gyro = lambda t: (0.02, -0.01, 0.005)
    table.command(*GYRO)
    assert 1.0 <= table.run_until_done(3.0) <= 2.0
    told = [f"[cal] progress <{percent}>" for percent in range(0, 101, 10)]
    assert table.said[-12:] == [*told, "[cal] calibration done: gyro"]
    offset = [table.parameters[f"CAL_GYRO0_{axis}OFF"] for axis in "XYZ"]
    assert offset == pytest.approx([0.02, -0.01, 0.005])
    assert is_calibrated(table.parameters, "GYRO")
    corrections = corrections_of(table.parameters)
    assert corrected_gyro((0.02, -0.01, 0.005), corrections) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_a_gyro_that_is_moved_is_measured_again(table: Table) -> None:
    moved_until = table.now_us * 1e-6 + 2.0
    table.gyro = lambda t: (0.5 * math.sin(9.0 * t), 0.0, 0.0) if t < moved_until else (0.0, 0.0, 0.0)
    table.command(*GYRO)
    table.run_until_done(6.0)
    assert "motion, retrying.." in table.said
    assert table.said[-1] == "[cal] calibration done: gyro"


def test_a_gyro_that_never_rests(table: Table) -> None:
    table.gyro = lambda t: (0.5 * math.sin(9.0 * t), 0.0, 0.0)
    table.command(*GYRO)
    table.run_until_done(30.0)
    assert table.said[-2:] == ["ERROR: Motion during calibration", "[cal] calibration failed: gyro"]
    assert not is_calibrated(table.parameters, "GYRO")


def test_a_gyro_calibration_is_cancelled(table: Table) -> None:
    table.command(*GYRO)
    table.run(0.3)
    assert table.command(*REST) == TEMPORARILY_REJECTED
    table.run(0.2)
    assert table.answers() == [ACCEPTED]
    table.run_until_done(1.0)
    assert table.said[-2:] == ["[cal] calibration cancelled", "[cal] calibration failed: gyro"]


def test_a_gyro_keeps_an_offset_that_is_near_enough(table: Table) -> None:
    table.gyro = lambda t: (0.02, 0.0, 0.0)
    table.command(*GYRO)
    table.run_until_done(3.0)
    table.gyro = lambda t: (0.005, 0.005, 0.0)  # 7 mrad/s, as it is calibrated
    table.command(*GYRO)
    table.run_until_done(3.0)
    offset = [table.parameters[f"CAL_GYRO0_{axis}OFF"] for axis in "XYZ"]
    assert offset == pytest.approx([0.02, 0.0, 0.0], abs=1e-6)


# --- accelerometer -------------------------------------------------------------------------------------------


def test_an_accelerometer_on_six_sides(table: Table) -> None:
    table.command(*ACCEL)
    for side, (x, y, z) in FORCES.items():
        table.accel = lambda t, force=(x * 1.02 + 0.1, y * 0.98 - 0.2, z + 0.3): force  # type: ignore[misc]
        table.run(9.0)
        assert f"[cal] {side} side done, rotate to a different side" in table.said
    table.run_until_done(2.0)
    assert table.said.count("[cal] down orientation detected") == 2
    assert "[cal] pending: front left right up down" in table.said
    assert "[cal] progress <102>" in table.said
    assert table.said[-1] == "[cal] calibration done: accel"
    corrections = corrections_of(table.parameters)
    for x, y, z in FORCES.values():
        measured = (x * 1.02 + 0.1, y * 0.98 - 0.2, z + 0.3)
        assert corrected_accel(measured, corrections) == pytest.approx((x, y, z), abs=1e-4)


def test_an_accelerometer_that_nobody_turns(table: Table) -> None:
    table.command(*ACCEL)
    # six rests until the side is told, 3.8 s each, and the 750 samples of one of them
    assert table.run_until_done(60.0) == pytest.approx(6 * 3.8 + 3.0, abs=1.0)
    assert table.said[2:5] == [
        "[cal] hold vehicle still on a pending side",
        "[cal] detected rest position, hold still...",
        "[cal] down orientation detected",
    ]
    assert "[cal] Hold still, measuring down side" in table.said
    assert table.said.count("[cal] down side already completed") == 5
    assert table.said[-2:] == ["[cal] calibration failed: timeout: no motion", "[cal] calibration failed: accel"]
    assert not is_calibrated(table.parameters, "ACC")


def test_an_accelerometer_that_is_shaken(table: Table) -> None:
    table.command(*ACCEL)
    table.run(2.8)
    assert "[cal] detected rest position, hold still..." in table.said
    table.accel = lambda t: (3.0 * math.sin(20.0 * t), 0.0, -G)
    table.run(2.0)
    assert "[cal] detected motion, hold still..." in table.said
    assert table.command(*REST) == TEMPORARILY_REJECTED
    table.run(5.0)
    assert table.worker.busy and table.answers() == []  # PX4 looks for who cancels between two sides alone
    table.accel = lambda t: FORCES["down"]
    table.run_until_done(9.0)
    assert table.said[-2:] == ["[cal] calibration cancelled", "[cal] calibration failed: accel"]


def test_an_accelerometer_in_a_board_that_leans(table: Table) -> None:
    table.parameters.set("SENS_BOARD_X_OFF", 10.0)
    leaning = corrections_of(table.parameters)
    table.command(*ACCEL)
    for force in FORCES.values():
        x, y, z = raw_accel(force, leaning)
        table.accel = lambda t, felt=(x, y + 0.3, z): corrected_accel(felt, leaning)  # type: ignore[misc]
        table.run(8.0)
    table.run_until_done(2.0)
    offset = [table.parameters[f"CAL_ACC0_{axis}OFF"] for axis in "XYZ"]
    assert offset == pytest.approx([0.0, 0.3, 0.0], abs=1e-4)


def test_an_accelerometer_that_is_right_keeps_round_numbers(table: Table) -> None:
    table.command(*ACCEL)
    for x, y, z in FORCES.values():
        table.accel = lambda t, force=(x * 1.0004 + 0.005, y, z): force  # type: ignore[misc]
        table.run(8.0)
    table.run_until_done(2.0)
    assert table.said[-1] == "[cal] calibration done: accel"
    assert [table.parameters[f"CAL_ACC0_X{suffix}"] for suffix in ("OFF", "SCALE")] == [0.0, 1.0]


def test_an_accelerometer_quickly_as_it_stands(table: Table) -> None:
    table.accel = lambda t: (0.1, -0.2, -G + 0.3)
    table.run(0.1)
    assert table.command(*QUICK) == ACCEPTED
    table.run(0.01)
    assert table.said == [] and not table.worker.busy  # it is the newest sample alone
    assert corrected_accel((0.1, -0.2, -G + 0.3), corrections_of(table.parameters)) == pytest.approx(
        (0, 0, -G), abs=1e-6
    )


def test_an_accelerometer_quickly_by_the_attitude_or_without_it(table: Table) -> None:
    roll = math.radians(5.0)
    lying = (0.0, -G * math.sin(roll), -G * math.cos(roll))
    table.q = (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)
    table.accel = lambda t: (lying[0] + 0.2, lying[1], lying[2])
    table.run(0.1)
    table.command(*QUICK)
    assert [table.parameters[f"CAL_ACC0_{axis}OFF"] for axis in "XYZ"] == pytest.approx([0.2, 0.0, 0.0], abs=1e-5)
    table.q = (1.0, 0.0, 0.0, 0.0)
    table.accel = lambda t: (0.0, 1.05 * G, 0.0)  # 90 degrees from where it should be: only its strength is put right
    table.parameters.set("CAL_ACC0_XOFF", 0.0)
    table.run(0.1)
    table.command(*QUICK)
    assert [table.parameters[f"CAL_ACC0_{axis}OFF"] for axis in "XYZ"] == pytest.approx([0.0, 0.05 * G, 0.0], abs=1e-4)


# --- level, barometer, airspeed ---------------------------------------------------------------------------------


def test_the_horizon(table: Table) -> None:
    table.euler = lambda t: (math.radians(2.0), math.radians(-1.0), 0.3)
    table.command(*LEVEL)
    assert 1.0 <= table.run_until_done(3.0) <= 1.3
    assert table.said[1:] == [f"[cal] progress <{n}>" for n in (0, 20, 40, 60, 80, 100, 100)] + [
        "[cal] calibration done: level"
    ]
    assert table.parameters["SENS_BOARD_X_OFF"] == pytest.approx(2.0, abs=1e-3)
    assert table.parameters["SENS_BOARD_Y_OFF"] == pytest.approx(-1.0, abs=1e-3)
    # A board that leans 2 degrees to the right feels its weight's counterforce to the left.
    leaning = (0.0, -G * math.sin(math.radians(2.0)), -G * math.cos(math.radians(2.0)))
    table.parameters.set("SENS_BOARD_Y_OFF", 0.0)
    assert corrected_accel(leaning, corrections_of(table.parameters)) == pytest.approx((0.0, 0.0, -G), abs=1e-3)


def test_a_horizon_whose_board_leant_already(table: Table) -> None:
    table.parameters.set("SENS_BOARD_X_OFF", 20.0)
    table.parameters.set("SENS_BOARD_Y_OFF", 15.0)
    table.euler = lambda t: (math.radians(10.0), math.radians(20.0), 1.0)
    table.command(*LEVEL)
    table.run_until_done(3.0)
    # the vehicle's lean seen from a board that leant before: as rotations add up, not as angles do
    assert table.parameters["SENS_BOARD_X_OFF"] == pytest.approx(33.37, abs=0.01)
    assert table.parameters["SENS_BOARD_Y_OFF"] == pytest.approx(33.62, abs=0.01)


def test_a_horizon_that_sways_or_leans_too_much(table: Table) -> None:
    table.euler = lambda t: (0.1 * math.sin(10.0 * t), 0.0, 0.0)
    table.command(*LEVEL)
    table.run_until_done(30.0)
    assert table.said[-2:] == ["motion during calibration", "[cal] calibration failed: level"]
    table.euler = lambda t: (0.0, 0.9, 0.0)
    table.command(*LEVEL)
    table.run_until_done(3.0)
    assert table.said[-2:] == ["excess pitch angle", "[cal] calibration failed: level"]


def test_the_barometer_is_set_by_the_gps(table: Table) -> None:
    table.topics.sensor_baro = SensorBaro(table.now_us, 95_600.0, 489.0, 20.0)
    table.command(*BARO)
    table.run_until_done(4.0)
    assert table.said[-1] == "[cal] calibration failed: GPS required for baro cal"
    table.topics.sensor_gps = SensorGps(table.now_us + 3_000_000, 47.4, 8.5, 500.0, epv=1.0, fix_type=3)
    table.command(*BARO)
    assert table.run_until_done(4.0) == pytest.approx(3.0, abs=0.1)
    assert table.said[-1] == "[cal] calibration done: baro"
    expected = 101_325.0 * (1.0 - 0.0065 * 500.0 / 288.15) ** 5.2561
    assert table.parameters["CAL_BARO0_OFF"] == pytest.approx(95_600.0 - expected, abs=1.5)
    assert (table.parameters["CAL_BARO0_OFF"] * 2**14 / 20_000) % 1.0 == 0.0  # halved until it is within 0.1 m


def test_there_is_no_airspeed_sensor(table: Table) -> None:
    table.command(*AIRSPEED)
    assert 35.0 <= table.run_until_done(40.0) <= 35.5
    assert table.said[1:] == ["[cal] Ensure sensor is not measuring wind", "[cal] calibration failed: airspeed"]


# --- corrections --------------------------------------------------------------------------------------------------


def test_corrections_and_back() -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER)
    assert corrections_of(parameters) == NONE
    values = {"SENS_BOARD_X_OFF": 3.0, "SENS_BOARD_Z_OFF": -5.0, "CAL_ACC0_XSCALE": 1.1, "CAL_ACC0_ZOFF": 0.2}
    values |= {"CAL_ACC0_ID": DEVICE_IDS["ACC"], "CAL_GYRO0_ID": DEVICE_IDS["GYRO"], "CAL_MAG0_ID": DEVICE_IDS["MAG"]}
    values |= {"CAL_GYRO0_YOFF": 0.1, "CAL_MAG0_XOFF": 0.05, "CAL_MAG0_YSCALE": 0.9, "CAL_MAG0_XODIAG": 0.1}
    for name, value in values.items():
        parameters.set(name, value)
    corrections = corrections_of(parameters)
    vector = (0.3, -0.2, 0.5)
    for corrected, raw in ((corrected_gyro, raw_gyro), (corrected_accel, raw_accel), (corrected_mag, raw_mag)):
        assert raw(corrected(vector, corrections), corrections) == pytest.approx(vector)
        assert corrected(vector, corrections) != vector


def test_only_a_calibration_of_the_sensor_s_own_counts_in_whatever_slot() -> None:
    """FindCurrentCalibrationIndex, ParametersLoad and Reset of each sensor."""
    offsets = {"CAL_ACC0_XOFF": 1.0, "CAL_ACC2_XOFF": 2.0, "CAL_BARO0_OFF": 50.0}
    parameters = Parameters(VehicleKind.MULTICOPTER, {**offsets, "CAL_ACC0_ID": 1, "CAL_ACC2_ID": DEVICE_IDS["ACC"]})
    corrections = corrections_of(parameters)
    assert corrections.accel_offset == (2.0, 0.0, 0.0)
    assert corrections.baro_offset_pa == 0.0
    parameters.set("CAL_ACC2_ID", 0)
    assert corrections_of(parameters, corrections) == NONE


def test_scales_that_are_none_and_small_changes_are_refused() -> None:
    """Accelerometer.cpp, Magnetometer.cpp, Gyroscope.cpp, Barometer.cpp: set_offset, set_scale, set_offdiagonal."""
    ids = {f"CAL_{sensor}0_ID": device for sensor, device in DEVICE_IDS.items()}
    parameters = Parameters(VehicleKind.MULTICOPTER, ids)
    small = {"CAL_ACC0_XOFF": 0.009, "CAL_ACC0_YSCALE": 1.009, "CAL_MAG0_ZOFF": 0.004, "CAL_MAG0_XODIAG": 0.009}
    small |= {"CAL_BARO0_OFF": 0.009, "CAL_GYRO0_XOFF": 0.009}
    for name, value in small.items():
        parameters.set(name, value)
    assert corrections_of(parameters, first=False) == NONE
    first = corrections_of(parameters)
    assert first.gyro_offset[0] == pytest.approx(0.009)
    assert first._replace(gyro_offset=ZERO) == NONE
    parameters.set("CAL_ACC0_XSCALE", 1.2)
    parameters.set("CAL_MAG0_XSCALE", 1.2)
    known = corrections_of(parameters, first=False)
    assert known.accel_scale[0] == pytest.approx(1.2)
    for value in (0.0, -1.0):
        parameters.set("CAL_ACC0_XSCALE", value)
        parameters.set("CAL_MAG0_XSCALE", value)
        assert corrections_of(parameters, known, first=False) == known


def test_a_board_that_is_mounted_askew() -> None:
    """SENS_BOARD_ROT (GetBoardRotation), then the level adjustment; a number that is none leaves it straight."""
    parameters = Parameters(VehicleKind.MULTICOPTER, {"SENS_BOARD_ROT": 2})
    assert corrected_accel((1.0, 2.0, 3.0), corrections_of(parameters)) == pytest.approx((-2.0, 1.0, 3.0))
    parameters.set("SENS_BOARD_ROT", 8)
    assert corrected_gyro((1.0, 2.0, 3.0), corrections_of(parameters)) == pytest.approx((1.0, -2.0, -3.0))
    parameters.set("SENS_BOARD_ROT", 38)  # roll 90, pitch 68, yaw 293 degrees
    parameters.set("SENS_BOARD_X_OFF", 10.0)
    corrections = corrections_of(parameters)
    assert raw_mag(corrected_mag((0.2, 0.1, 0.4), corrections), corrections) == pytest.approx((0.2, 0.1, 0.4))
    parameters.set("SENS_BOARD_ROT", 8)
    leaning = (0.0, math.sin(math.radians(10.0)), math.cos(math.radians(10.0)))
    assert corrected_accel((0.0, 0.0, -1.0), corrections_of(parameters)) == pytest.approx(
        (0.0, -leaning[1], leaning[2])
    )
    parameters.set("SENS_BOARD_X_OFF", 0.0)
    for number in (-1, 41, 100):
        parameters.set("SENS_BOARD_ROT", number)
        assert corrections_of(parameters) == NONE
