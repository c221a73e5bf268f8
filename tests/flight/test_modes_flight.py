"""PX4's reference hexacopter flown by its modes; the numbers are those of a real PX4 v1.18, with their tolerances."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.topics import CommandRecord, ManualControlSetpoint, VehicleCommand
from tests.flight.modes_flight import Flight, Row

DO_ORBIT = 34


def ground_speed(row: Row) -> float:
    """Horizontal speed."""
    return math.hypot(row.vn, row.ve)


def when(rows: list[Row], condition: list[bool]) -> float:
    """Time of the first row that meets a condition."""
    return rows[condition.index(True)].t


def test_a_takeoff_to_10_m_and_a_reposition_of_50_m() -> None:
    flight = Flight()
    flight.begin()
    flight.climb_to(10.0)
    rows = flight.rows
    assert max(-row.vd for row in rows) == pytest.approx(1.53, abs=0.26)
    assert when(rows, [row.up > 5.0 for row in rows]) == pytest.approx(7.55, abs=1.485)
    assert rows[-1].up == pytest.approx(10.2, abs=1.04)
    flight.begin()
    flight.go(flight.setpoint((50.0, 0.0, 10.0)))
    flight.fly(17.0)
    rows = flight.rows
    assert max(map(ground_speed, rows)) == pytest.approx(4.61, abs=0.49)
    assert when(rows, [row.north > 25.0 for row in rows]) == pytest.approx(7.9, abs=1.6)
    assert when(rows, [abs(row.north - 50.0) < 1.0 for row in rows]) == pytest.approx(14.1, abs=2.03)
    assert max(row.north for row in rows) - 50.0 == pytest.approx(0.83, abs=0.94)
    assert max(row.tilt_deg for row in rows) == pytest.approx(26.8, abs=7.8)


def test_a_climb_with_a_turn_and_a_landing_from_15_m() -> None:
    flight = Flight()
    flight.climb_to(5.0)
    flight.begin()
    flight.go(flight.setpoint((0.0, 0.0, 15.0), yaw=math.pi / 2))
    flight.fly(10.0)
    assert max(-row.vd for row in flight.rows) == pytest.approx(2.61, abs=0.42)
    assert max(row.yaw_rate_deg_s for row in flight.rows) == pytest.approx(45.2, abs=17.5)
    turned = when(flight.rows, [abs(row.yaw_deg - 90.0) < 3.0 for row in flight.rows])
    assert turned == pytest.approx(3.63, abs=0.9)
    flight.begin()
    flight.mode(NavState.AUTO_LAND)
    flight.go(flight.setpoint((0.0, 0.0, 0.0), SetpointType.LAND))
    flight.fly(26.0, until=lambda row: row.landed)
    rows = flight.rows
    assert rows[-1].t == pytest.approx(19.5, abs=3.9)
    assert max(row.vd for row in rows) == pytest.approx(1.52, abs=0.54)


def test_full_stick_in_position_mode_and_the_stop_after_it() -> None:
    flight = Flight()
    flight.climb_to(10.0)
    flight.topics.manual_control_setpoint = ManualControlSetpoint(1, True)
    flight.mode(NavState.POSCTL)
    flight.fly(2.0)
    flight.begin()
    flight.topics.manual_control_setpoint = ManualControlSetpoint(2, True, pitch=1.0)
    flight.fly(6.0)
    go = flight.rows
    assert go[-1].vn == pytest.approx(7.0, abs=0.6)
    assert max(row.tilt_deg for row in go) == pytest.approx(38.1, abs=5.5)
    flight.begin()
    flight.topics.manual_control_setpoint = ManualControlSetpoint(3, True)
    flight.fly(6.0)
    stop = flight.rows
    assert when(stop, [ground_speed(row) < 0.4 for row in stop]) == pytest.approx(4.63, abs=1.2)
    assert stop[-1].north - go[-1].north == pytest.approx(12.9, abs=2.43)


def test_an_orbit_of_15_m() -> None:
    flight = Flight()
    flight.climb_to(10.0)
    flight.begin()
    centre = flight.setpoint((0.0, 0.0, 10.0))
    command = VehicleCommand(DO_ORBIT, 15.0, 3.0, 0.0, 0.0, centre.lat, centre.lon, centre.alt)
    flight.topics.vehicle_commands = (CommandRecord(1, flight.ticks * 4000, command),)
    flight.mode(NavState.ORBIT)
    flight.fly(30.0)
    late = flight.rows[-100:]
    assert all(math.hypot(row.north, row.east) == pytest.approx(15.8, abs=1.5) for row in late)
    assert all(ground_speed(row) == pytest.approx(2.49, abs=0.37) for row in late)
