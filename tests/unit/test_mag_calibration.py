"""Calibrating the magnetometer on simulated time: by turning the vehicle, and by a known heading."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from sitl_emu.autopilot.commander.calibration import lm_fit
from sitl_emu.autopilot.commander.calibration.lm_fit import Ellipsoid, fit
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS, corrected_mag, corrections_of
from sitl_emu.autopilot.topics import SensorGps, Vector3, VehicleCommand
from sitl_emu.core.geomagnetism import magnetic_field
from tests.unit.test_calibration import ACCEPTED, FORCES, MAG, Table


@pytest.fixture
def table() -> Table:
    return Table()


def test_a_magnetometer_that_nobody_turns(table: Table) -> None:
    table.command(*MAG)
    # a rest, 35 s for somebody to turn it, and 7 s in which it is sampled all the same
    assert 43.0 < table.run_until_done(60.0) < 48.0
    assert "[cal] Rotate vehicle" in table.said
    assert table.said[-2:] == ["Failed: This calibration requires rotation.", "[cal] calibration failed: mag"]
    assert not any("side done" in text for text in table.said)


def turning(side: str, t: float) -> Vector3:
    """The field, 0.25 gauss towards x of the table and 0.4 down, in a vehicle that turns about the vertical."""
    along, across = 0.25 * math.cos(t), -0.25 * math.sin(t)
    down = 0.4
    return {
        "back": (-down, across, along),
        "front": (down, across, -along),
        "left": (along, -down, across),
        "right": (along, down, -across),
        "up": (along, -across, -down),
        "down": (along, across, down),
    }[side]


RING = [turning("down", 0.1 * n) for n in range(60)]


def turn_on_each_side(table: Table, distorted: Callable[[Vector3], Vector3]) -> None:
    """All six sides one after the other, with a field that something distorts."""
    table.gyro = lambda t: (0.0, 0.0, 1.0)
    for side, force in FORCES.items():
        table.accel = lambda t, force=force: force  # type: ignore[misc]
        table.mag = lambda t, side=side: distorted(turning(side, t))  # type: ignore[misc]
        table.run(11.0)
    table.run_until_done(3.0)


def test_a_magnetometer_that_is_turned_on_all_sides(table: Table) -> None:
    table.command(*MAG)
    turn_on_each_side(table, lambda field: (1.1 * field[0] + 0.05, 0.95 * field[1] - 0.02, field[2] + 0.1))
    assert table.said[-2:] == ["[cal] progress <100>", "[cal] calibration done: mag"]
    assert any(text.startswith("[cal] down side calibration: progress <") for text in table.said)
    offset = [table.parameters[f"CAL_MAG0_{axis}OFF"] for axis in "XYZ"]
    assert offset == pytest.approx([0.05, -0.02, 0.1], abs=0.01)
    corrections = corrections_of(table.parameters)
    distorted = [(1.1 * x + 0.05, 0.95 * y - 0.02, z + 0.1) for x, y, z in RING]
    strengths = [math.hypot(*corrected_mag(field, corrections)) for field in distorted]
    assert max(strengths) - min(strengths) < 0.01


def test_a_magnetometer_whose_axes_are_aslant(table: Table) -> None:
    table.command(*MAG)
    turn_on_each_side(table, lambda field: (field[0] + 0.1 * field[1], field[1] + 0.1 * field[0], field[2]))
    assert table.said[-1] == "[cal] calibration done: mag"
    assert table.parameters["CAL_MAG0_XODIAG"] == pytest.approx(-0.1, abs=0.02)


def test_a_magnetometer_on_two_sides_corrects_its_offset(table: Table) -> None:
    table.parameters.set("SENS_MAG_SIDES", 0b110000)
    table.parameters.set("CAL_MAG0_ID", DEVICE_IDS["MAG"])
    table.parameters.set("CAL_MAG0_XSCALE", 1.2)
    table.parameters.set("CAL_MAG0_XOFF", 0.1)
    table.command(*MAG)
    table.gyro = lambda t: (0.0, 0.0, 1.0)
    old = corrections_of(table.parameters)
    for side in ("up", "down"):

        def field(t: float, side: str = side) -> Vector3:
            x, y, z = turning(side, t)
            return corrected_mag((x / 1.2 + 0.15, y, z), old)

        table.accel = lambda t, side=side: FORCES[side]  # type: ignore[misc]
        table.mag = field
        table.run(12.0)
    table.run_until_done(3.0)
    assert table.said.count("[cal] left side done, rotate to a different side") == 1
    assert table.said[-1] == "[cal] calibration done: mag"
    assert table.parameters["CAL_MAG0_XOFF"] == pytest.approx(0.15, abs=0.01)
    assert table.parameters["CAL_MAG0_XSCALE"] == pytest.approx(1.2)


def test_a_scale_of_0_counts_as_1(table: Table) -> None:
    table.parameters.set("CAL_MAG0_YSCALE", 0.0)
    table.topics.sensor_gps = SensorGps(table.now_us, 47.4, 8.5, 489.0, eph=1.0, fix_type=3)
    table.worker.fixed_mag_cal_yaw(table.now_us, VehicleCommand(42006, 90.0, 0, 0, 0), armed=False)
    table.run(0.1)
    assert table.said[-1] == "Mag quick calibration finished"
    assert table.parameters["CAL_MAG0_YSCALE"] == 1.0


def test_a_magnetometer_in_a_field_that_is_none(table: Table) -> None:
    table.command(*MAG)
    turn_on_each_side(table, lambda field: (0.1 * field[0], 0.1 * field[1], 0.1 * field[2]))
    assert table.said[-2:] == ["Retry calibration (unable to fit mag 0)", "[cal] calibration failed: mag"]


def test_a_magnetometer_that_is_switched_off(table: Table) -> None:
    table.parameters.set("CAL_MAG0_ID", DEVICE_IDS["MAG"])
    table.parameters.set("CAL_MAG0_PRIO", 0)
    table.command(*MAG)
    assert table.said[-2:] == ["Failed: No magnetometer available or enabled", "[cal] calibration failed: mag"]


def test_a_magnetometer_by_a_known_heading(table: Table) -> None:
    table.topics.sensor_gps = SensorGps(table.now_us, 47.4, 8.5, 489.0, eph=1.0, fix_type=3)
    result = table.worker.fixed_mag_cal_yaw(table.now_us, VehicleCommand(42006, 90.0, 0, 0, 0), armed=False)
    assert result == ACCEPTED
    table.run(0.1)
    assert table.said == ["Assuming vehicle is facing heading 90.0 degrees", "Mag quick calibration finished"]
    field = magnetic_field(47.4, 8.5)
    horizontal = field.strength_gauss * math.cos(field.inclination_rad)
    x, y, _ = corrected_mag((0.2, 0.0, 0.4), corrections_of(table.parameters))
    assert math.hypot(x, y) == pytest.approx(horizontal, rel=1e-3)
    assert math.atan2(-y, x) == pytest.approx(math.pi / 2 - field.declination_rad, abs=1e-3)


def test_a_known_heading_needs_a_place(table: Table) -> None:
    table.worker.fixed_mag_cal_yaw(table.now_us, VehicleCommand(42006, 0.0, 0, 0, 0), armed=False)
    assert table.said == ["GPS required for mag quick cal"]


def test_a_known_heading_leaves_the_scale_alone(table: Table) -> None:
    table.topics.sensor_gps = SensorGps(table.now_us, 47.4, 8.5, 489.0, eph=1.0, fix_type=3)
    table.parameters.set("CAL_MAG0_ID", DEVICE_IDS["MAG"])
    table.parameters.set("CAL_MAG0_XSCALE", 1.5)
    table.worker.fixed_mag_cal_yaw(table.now_us, VehicleCommand(42006, 90.0, 0, 0, 0), armed=False)
    table.run(0.1)
    # 0.2 of the topic are 0.2 / 1.5 of the sensor
    x, _, _ = corrected_mag((0.2 / 1.5, 0.0, 0.4), corrections_of(table.parameters))
    field = magnetic_field(47.4, 8.5)
    horizontal = field.strength_gauss * math.cos(field.inclination_rad)
    assert x == pytest.approx(horizontal * math.cos(math.pi / 2 - field.declination_rad), abs=1e-3)


def test_points_that_are_no_sphere() -> None:
    start = Ellipsoid(0.4, np.zeros(3), np.eye(3))
    assert not fit(np.zeros((0, 3)), start, sphere=True)[1]
    assert not fit(np.array([(math.cos(n), math.sin(n), 0.0) for n in range(20)]), start, sphere=True)[1]


def test_a_step_that_is_no_better_ends_no_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where rounding lets the bolder step cost as much as the last one did, and the careful one more (lm_fit.cpp)."""
    costs = itertools.chain([2e-6, 1e-6], itertools.cycle([2e-6, 1e-6]))
    monkeypatch.setattr(lm_fit, "_cost", lambda samples, shape: next(costs))
    samples = np.array([turning("down", 0.1 * n) for n in range(60)])
    start = Ellipsoid(0.47, np.zeros(3), np.eye(3))
    _, found = fit(samples, start, sphere=True)
    assert found
