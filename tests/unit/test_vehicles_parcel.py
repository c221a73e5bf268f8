"""A vehicle with its parcel is one rigid body, heavier and with a lower centre; let go, both go on."""

import dataclasses
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion, rotated, rotation
from sitl_emu.vehicles import VehicleError, inertia
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.dynamics import Vector3
from sitl_emu.vehicles.multicopter import Multicopter
from sitl_emu.vehicles.rigid_body import cross
from tests.typed import present

G = 9.80665
RESPONDER = vehicles.load("responder")
LADEN = vehicles.with_parcel(RESPONDER, {})
rates = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3)))


def vacuum(vehicle: Vehicle) -> Vehicle:
    """Without any drag, the parcel's too."""
    still = dataclasses.replace(
        present(vehicle.aerodynamics),
        linear_n_s_m=(0.0,) * 3,
        quadratic_n_s2_m2=(0.0,) * 3,
        angular_n_m_s=(0.0,) * 3,
    )
    return dataclasses.replace(
        vehicle, aerodynamics=still, parcel=dataclasses.replace(present(vehicle.parcel), drag_m2=0.0)
    )


def in_the_air(vehicle: Vehicle, spin: Vector3 = (0.0, 0.0, 0.0)) -> Multicopter:
    body = Multicopter(vehicle, lambda north, east: 0.0, gravity_m_s2=G)
    body.down_m = -1000.0
    body.q = quaternion(0.3, -0.2, 1.0)
    body.p_rad_s, body.q_rad_s, body.r_rad_s = spin
    return body


def centre_velocity(body: Multicopter, offset: Vector3) -> Vector3:
    return body.velocity_at(rotated(rotation(body.q), offset))


def test_its_estimator_knows_the_drag_of_both() -> None:
    """EKF2_BCOEF and EKF2_MCOEF: deceleration is v (rho / 2 |v| / BCOEF + MCOEF), with a parcel aboard."""
    drag, mass_kg, parcel = present(LADEN.aerodynamics), inertia.laden(LADEN).mass_kg, present(LADEN.parcel)
    for name, axis in (("EKF2_BCOEF_X", 0), ("EKF2_BCOEF_Y", 1)):
        squared = drag.quadratic_n_s2_m2[axis] + 0.5 * 1.225 * parcel.drag_m2
        assert RESPONDER.airframe[name] == pytest.approx(0.5 * 1.225 * mass_kg / squared, rel=0.01)
        assert RESPONDER.airframe["EKF2_MCOEF"] == pytest.approx(drag.linear_n_s_m[axis] / mass_kg, rel=0.01)


def test_mass_and_balance_are_those_of_both() -> None:
    parcel, both = present(LADEN.parcel), inertia.laden(LADEN)
    assert both.mass_kg == pytest.approx(RESPONDER.mass_kg + 2.0)
    assert both.centre_m == pytest.approx((0.0, 0.0, 2.0 * 0.17 / 6.3))
    own = inertia.cuboid(parcel.mass_kg, parcel.size_m)
    apart = RESPONDER.mass_kg * 2.0 / both.mass_kg * 0.17**2
    for axis, arm in enumerate((apart, apart, 0.0)):
        assert both.inertia_kg_m2[axis] == pytest.approx(RESPONDER.inertia_kg_m2[axis] + own[axis] + arm)
    assert inertia.laden(RESPONDER).mass_kg == RESPONDER.mass_kg


@given(rates)
def test_in_free_fall_the_common_centre_of_mass_falls_freely(spin: Vector3) -> None:
    vehicle = vacuum(LADEN)
    offset, body = inertia.laden(vehicle).centre_m, in_the_air(vacuum(LADEN), spin)
    n, e, d = centre_velocity(body, offset)
    for _ in range(250):
        body.step((), 0.0, 0.0, 0.0)
    assert centre_velocity(body, offset) == pytest.approx((n, e, d + G), abs=1e-6)


@given(rates, st.integers(0, 100))
def test_let_go_both_keep_their_momentum(spin: Vector3, ticks: int) -> None:
    vehicle = vacuum(LADEN)
    parcel, both = present(vehicle.parcel), inertia.laden(vehicle)
    body = in_the_air(vehicle, spin)
    for _ in range(ticks):
        body.step((0.8, 0.3, 0.6, 0.5), 0.0, 0.0, 0.0)
    before = centre_velocity(body, both.centre_m)
    its = centre_velocity(body, parcel.centre_m)
    body.drop()
    own = (body.vn_m_s, body.ve_m_s, body.vd_m_s)
    for axis in range(3):
        total = RESPONDER.mass_kg * own[axis] + parcel.mass_kg * its[axis]
        assert total == pytest.approx(both.mass_kg * before[axis], abs=1e-9)


def test_let_go_it_is_the_vehicle_that_it_was() -> None:
    laden, bare = in_the_air(LADEN), in_the_air(RESPONDER)
    laden.drop()
    for _ in range(250):
        laden.step((0.7, 0.5, 0.6, 0.6), 2.0, 1.0, 0.0)
        bare.step((0.7, 0.5, 0.6, 0.6), 2.0, 1.0, 0.0)
    assert (laden.north_m, laden.east_m, laden.down_m, laden.q) == (bare.north_m, bare.east_m, bare.down_m, bare.q)


def test_rotors_turn_it_about_the_common_centre_of_mass() -> None:
    """One step from rest, level: more thrust to the right rolls to the left, by M / I of both."""
    body, both = in_the_air(vacuum(LADEN)), inertia.laden(LADEN)
    body.q = (1.0, 0.0, 0.0, 0.0)
    body.speeds = [1.0, 0.0, 0.0, 1.0]
    body.motor_off = [False, True, True, False]
    body.step((1.0, 0.0, 0.0, 1.0), 0.0, 0.0, 0.0)
    thrust_n = present(LADEN.propulsion).thrust_max_n
    assert body.p_rad_s / 0.004 == pytest.approx(-2.0 * 0.265 * thrust_n / both.inertia_kg_m2[0])
    assert body.az_m_s2 == pytest.approx(-2.0 * thrust_n / both.mass_kg)
    swings = cross((body.p_rad_s / 0.004, 0.0, 0.0), both.centre_m)
    assert body.ay_m_s2 == pytest.approx(-swings[1], rel=1e-3), "the accelerometer, above that centre, is swung"


def test_wind_turns_it_and_its_drag_is_added() -> None:
    parcel, both = present(LADEN.parcel), inertia.laden(LADEN)
    body = in_the_air(LADEN)
    body.q = (1.0, 0.0, 0.0, 0.0)
    body.step((), 10.0, 0.0, 0.0)
    force_n = (0.6 + 0.05 * 10.0) * 10.0 + 0.5 * 1.225 * parcel.drag_m2 * 100.0
    assert body.q_rad_s / 0.004 == pytest.approx(-both.centre_m[2] * force_n / both.inertia_kg_m2[1], rel=1e-6)
    bare = in_the_air(RESPONDER)
    bare.step((), 10.0, 0.0, 0.0)
    assert bare.q_rad_s == 0.0


def test_an_impulse_at_the_common_centre_of_mass_turns_nothing() -> None:
    body, both = in_the_air(LADEN), inertia.laden(LADEN)
    arm = rotated(rotation(body.q), both.centre_m)
    assert body.mobility(arm, (0.0, 1.0, 0.0)) == pytest.approx(1.0 / both.mass_kg)
    body.push(arm, (1.0, -2.0, 3.0))
    assert (body.p_rad_s, body.q_rad_s, body.r_rad_s) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert (body.vn_m_s, body.ve_m_s, body.vd_m_s) == pytest.approx([part / both.mass_kg for part in (1.0, -2.0, 3.0)])


@given(rates)
def test_an_impulse_changes_the_speed_where_it_strikes_as_mobility_says(spin: Vector3) -> None:
    body, arm, along = in_the_air(LADEN, spin), (0.2, -0.1, 0.05), (0.6, 0.0, 0.8)
    before, mobility = body.velocity_at(arm), body.mobility(arm, along)
    body.push(arm, along)
    after = body.velocity_at(arm)
    change = sum((b - a) * part for a, b, part in zip(before, after, along, strict=True))
    assert change == pytest.approx(mobility)


def test_it_stands_at_rest_with_it_on_a_slope_too() -> None:
    body = Multicopter(LADEN, lambda north, east: 0.1 * north, gravity_m_s2=G)
    for _ in range(500):
        body.step((), 0.0, 0.0, 0.0)
    assert math.hypot(body.vn_m_s, body.ve_m_s, body.vd_m_s) < 1e-6
    assert math.hypot(body.north_m, body.east_m) < 1e-3


@pytest.mark.parametrize(
    ("model", "figures", "complaint"),
    [
        ("iris", {}, "parcel: iris has no release that could hold one; of ours have one: responder"),
        ("responder", {"mass": 1.0}, "parcel: unknown field 'mass' = 1.0; allowed are: mass_kg, size_m, centre_m"),
        ("responder", {"mass_kg": 0}, "parcel: mass_kg = 0 is out of range"),
        ("responder", {"size_m": [0.2, 0.2, 0.3]}, "parcel: it would hang lower than the landing gear (0.27 m)"),
        ("responder", {"centre_m": [0.1, 0.0, 0.17]}, "parcel: with it, parts are not symmetric"),
    ],
)  # fmt: skip
def test_a_parcel_that_cannot_be_is_told(model: str, figures: dict[str, Any], complaint: str) -> None:
    with pytest.raises(VehicleError) as told:
        vehicles.with_parcel(vehicles.load(model), figures)
    assert str(told.value).startswith(complaint)
