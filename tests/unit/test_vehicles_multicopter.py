import dataclasses
import math
from collections.abc import Callable
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.dynamics import STEP_S
from sitl_emu.vehicles.multicopter import Multicopter, from_body_down
from tests.typed import present

G = 9.80665
MODELS = ["iris", "m600", "responder", "sihsim_hex"]


def flat(north: float, east: float) -> float:
    return 0.0


def in_the_air(model: str, **changes: Any) -> tuple[Multicopter, Vehicle]:
    """A vehicle high above the ground, at rest and level, with rotors still."""
    vehicle = dataclasses.replace(vehicles.load(model), **changes)
    return Multicopter(vehicle, lambda north, east: 0.0, gravity_m_s2=G), vehicle


def lift_off(body: Multicopter) -> None:
    body.down_m = -1000.0
    body.q = (1.0, 0.0, 0.0, 0.0)


def hover_control(vehicle: Vehicle) -> float:
    propulsion = present(vehicle.propulsion)
    return math.sqrt(vehicle.mass_kg * G / (propulsion.thrust_max_n * len(propulsion.rotors)))


@pytest.mark.parametrize("model", MODELS)
def test_hover_thrust_equals_weight(model: str) -> None:
    body, vehicle = in_the_air(model)
    lift_off(body)
    u = hover_control(vehicle)
    body.speeds = [u] * len(body.speeds)
    for _ in range(500):
        body.step((u,) * len(body.speeds), 0.0, 0.0, 0.0)
    assert body.vd_m_s == pytest.approx(0.0, abs=1e-9)
    assert body.az_m_s2 == pytest.approx(-G)
    assert (body.p_rad_s, body.q_rad_s, body.r_rad_s) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(("model", "share"), [("sihsim_hex", 0.8), ("m600", 0.64)])
def test_sihs_speed_controllers_tell_the_root_of_the_throttle(model: str, share: float) -> None:
    """Thruster::throttle_to_rpm in aero.hpp: SIH's thrust goes with the throttle's square all the same."""
    body, _ = in_the_air(model)
    body.speeds = [0.64] * len(body.speeds)
    assert body.motor_speeds() == pytest.approx([share] * len(body.speeds))
    body.speeds[0] = -0.1
    assert body.motor_speeds()[0] == (0.0 if model == "sihsim_hex" else -0.1)


def test_rotors_that_turn_backwards_push_down() -> None:
    body, vehicle = in_the_air("iris")
    lift_off(body)
    u = -hover_control(vehicle)
    body.speeds = [u] * len(body.speeds)
    body.step((u,) * len(body.speeds), 0.0, 0.0, 0.0)
    assert body.az_m_s2 == pytest.approx(G, rel=0.01) and body.power_w > 0.0


def test_free_fall_without_air() -> None:
    air = dataclasses.replace(
        present(vehicles.load("iris").aerodynamics), linear_n_s_m=(0.0,) * 3, quadratic_n_s2_m2=(0.0,) * 3
    )
    body, _ = in_the_air("iris", aerodynamics=air)
    lift_off(body)
    for _ in range(250):
        body.step((), 0.0, 0.0, 0.0)
    assert body.vd_m_s == pytest.approx(G)
    assert body.down_m == pytest.approx(-1000.0 + G / 2, abs=1e-6)
    assert body.az_m_s2 == 0.0


@pytest.mark.parametrize("model", MODELS)
def test_terminal_velocity(model: str) -> None:
    body, vehicle = in_the_air(model)
    lift_off(body)
    body.down_m = -20000.0
    for _ in range(15000):
        body.step((), 0.0, 0.0, 0.0)
    air, v = present(vehicle.aerodynamics), body.vd_m_s
    drag = (air.linear_n_s_m[2] + air.quadratic_n_s2_m2[2] * v) * v
    assert drag == pytest.approx(vehicle.mass_kg * G, rel=1e-3)


def test_wind_carries_and_sih_wind_leans_as_measured() -> None:
    body, vehicle = in_the_air("sihsim_hex")
    lift_off(body)
    u = hover_control(vehicle)
    body.speeds = [u] * 6
    for _ in range(4000):
        body.step((u,) * 6, 4.0, -1.0, 0.0)
    assert (body.vn_m_s, body.ve_m_s) == pytest.approx((4.0, -1.0), abs=1e-3)


@pytest.mark.parametrize("model", MODELS)
def test_torque_signs_follow_the_airframe(model: str) -> None:
    """As PX4 allocates: more thrust right rolls left, more in front pitches up, ccw rotors (KM > 0) yaw right."""
    _, vehicle = in_the_air(model)
    signs_of: dict[str, Callable[[int], float]] = {
        "p_rad_s": lambda i: -vehicle.airframe.get(f"CA_ROTOR{i}_PY", 0.0),
        "q_rad_s": lambda i: vehicle.airframe.get(f"CA_ROTOR{i}_PX", 0.0),
        "r_rad_s": lambda i: vehicle.airframe.get(f"CA_ROTOR{i}_KM", 0.05),
    }
    for axis, sign_of in signs_of.items():
        body, _ = in_the_air(model)
        lift_off(body)
        signs = [sign_of(i) for i in range(len(body.speeds))]
        controls = tuple(0.5 + (0.1 if sign > 1e-6 else -0.1 if sign < -1e-6 else 0.0) for sign in signs)
        for _ in range(5):
            body.step(controls, 0.0, 0.0, 0.0)
        assert getattr(body, axis) > 0.0


def test_rotor_lag_is_first_order() -> None:
    body, vehicle = in_the_air("sihsim_hex")
    lift_off(body)
    steps = round(present(vehicle.propulsion).time_constant_s / STEP_S)
    for _ in range(steps):
        body.step((1.0,) * 6, 0.0, 0.0, 0.0)
    assert body.speeds[0] == pytest.approx(1.0 - math.exp(-steps * STEP_S / 0.05))


def test_motor_off_stops_one_rotor() -> None:
    body, _ = in_the_air("iris")
    body.motor_off[2] = True
    for _ in range(100):
        body.step((1.0,) * 4, 0.0, 0.0, 0.0)
    assert body.speeds[2] == 0.0
    assert body.speeds[0] > 0.9


def test_spinning_body_keeps_angular_momentum_and_energy() -> None:
    """Torque-free, without damping: Euler's equations keep |I ω| and the energy of rotation."""
    air = dataclasses.replace(present(vehicles.load("m600").aerodynamics), angular_n_m_s=(0.0,) * 3)
    body, vehicle = in_the_air("m600", aerodynamics=air)
    lift_off(body)
    body.p_rad_s, body.q_rad_s, body.r_rad_s = 1.0, 0.4, -0.7
    moments = vehicle.inertia_kg_m2

    def state() -> tuple[float, float]:
        rates = (body.p_rad_s, body.q_rad_s, body.r_rad_s)
        energy = sum(moment * rate**2 for moment, rate in zip(moments, rates, strict=True))
        return energy, math.hypot(*(moment * rate for moment, rate in zip(moments, rates, strict=True)))

    before = state()
    for _ in range(1000):
        body.step((), 0.0, 0.0, 0.0)
    assert state() == pytest.approx(before, rel=0.01)
    assert math.hypot(*body.q) == pytest.approx(1.0)


def test_attitude_integrates_the_rates() -> None:
    body, _ = in_the_air("sihsim_hex")
    lift_off(body)
    body._angular = (0.0, 0.0, 0.0)
    body.r_rad_s = math.pi / 2
    for _ in range(250):
        body.step((), 0.0, 0.0, 0.0)
    assert 2 * math.atan2(body.q[3], body.q[0]) == pytest.approx(math.pi / 2, abs=1e-4)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.15, -0.1), (-0.2, 0.05)])
def test_stands_still_on_slopes(model: str, slopes: tuple[float, float]) -> None:
    rise_n, rise_e = slopes
    vehicle = vehicles.load(model)
    body = Multicopter(vehicle, lambda n, e: 3.0 + rise_n * n + rise_e * e, 12.0, -7.0, 0.6, G)
    start = (body.north_m, body.east_m, body.down_m)
    for _ in range(2500):
        body.step((0.0,) * 6, 2.0, -1.0, 0.0)
    assert (body.north_m, body.east_m, body.down_m) == pytest.approx(start, abs=1e-3)
    assert math.hypot(body.vn_m_s, body.ve_m_s, body.vd_m_s) < 1e-9
    assert math.hypot(body.ax_m_s2, body.ay_m_s2, body.az_m_s2) == pytest.approx(G, rel=1e-6)
    # upright on the slope: the body's down axis is the ground's normal
    assert math.acos(from_body_down(body.q)[2]) == pytest.approx(math.atan(math.hypot(rise_n, rise_e)), abs=2e-3)


@pytest.mark.parametrize("model", ["iris", "m600", "responder"])
@pytest.mark.parametrize("tilt", [0.0, 0.15])
def test_touches_down_softly_and_rests(model: str, tilt: float) -> None:
    vehicle = vehicles.load(model)
    body = Multicopter(vehicle, flat, gravity_m_s2=G)
    rest = body.down_m
    body.down_m, body.vd_m_s, body.vn_m_s = rest - 0.3, 0.7, 0.3
    body.q = quaternion(tilt, -tilt, 1.0)
    hardest = deepest = highest_after = 0.0
    u = hover_control(vehicle) * 0.99
    touched = False
    for tick in range(1500):
        control = u if tick < 250 else 0.0
        body.step((control,) * 6, 0.0, 0.0, 0.0)
        hardest = max(hardest, -body.az_m_s2)
        deepest = max(deepest, body.down_m - rest)
        touched = touched or body.down_m > rest
        if touched:
            highest_after = max(highest_after, rest - body.down_m)
    assert touched
    assert hardest < 12 * G, "no accelerometer is overdriven"
    assert deepest < 0.05
    assert highest_after < 0.12, "hardly bounces, though rotors still carry it"
    assert body.down_m == pytest.approx(rest, abs=1e-4)
    assert math.hypot(body.vn_m_s, body.ve_m_s) < 1e-9
    assert math.acos(min(1.0, from_body_down(body.q)[2])) < 1e-3


def test_sih_sinks_in_while_it_brakes_and_is_then_held_as_it_is() -> None:
    vehicle = vehicles.load("sihsim_hex")
    body = Multicopter(vehicle, flat, gravity_m_s2=G)
    body.down_m, body.vd_m_s, body.vn_m_s = -0.1, 0.5, 0.2
    body.q = quaternion(0.1, 0.0, 1.0)
    u = hover_control(vehicle) * math.sqrt(1.0 / math.cos(0.1))
    body.speeds = [u] * 6
    for _ in range(100):
        body.step((u,) * 6, 0.0, 0.0, 0.0)
    assert body.down_m > 0.03 and body.vd_m_s > 0.3, "its drag and its rotors carry all of its weight"
    before = body.vn_m_s, body.ve_m_s, body.vd_m_s
    falls_m_s = math.nan
    for _ in range(100):
        if not body.vd_m_s:
            break
        falls_m_s = body.vd_m_s
        body.step((0.9 * u,) * 6, 0.0, 0.0, 0.0)
    assert not body.vd_m_s
    felt = math.hypot(body.ax_m_s2, body.ay_m_s2, body.az_m_s2 + G)
    assert felt == pytest.approx(math.hypot(*before[:2], falls_m_s) / STEP_S, rel=0.1), "all its speed in one step"
    held = body.north_m, body.east_m, body.down_m
    for _ in range(500):
        body.step((0.5 * u,) * 6, 3.0, -2.0, 0.0)
    assert (body.north_m, body.east_m, body.down_m) == held
    assert math.acos(from_body_down(body.q)[2]) == pytest.approx(0.1, abs=1e-6), "its feet turn it nowhere"
    for _ in range(250):
        body.step((1.2 * u,) * 6, 0.0, 0.0, 0.0)
    assert body.down_m < -0.3


def test_takes_off_again() -> None:
    body, vehicle = in_the_air("iris")
    u = 1.1 * hover_control(vehicle)
    for _ in range(500):
        body.step((u,) * 4, 0.0, 0.0, 0.0)
    assert body.down_m < -1.0
    assert from_body_down(body.q)[2] == pytest.approx(1.0, abs=1e-6)


def test_below_hover_it_stays_on_the_ground() -> None:
    body, vehicle = in_the_air("iris")
    start = body.north_m, body.east_m
    u = 0.95 * hover_control(vehicle)
    # with a rolling moment too small to tip it over
    for _ in range(500):
        body.step((u, u, 1.03 * u, 1.03 * u), 0.0, 0.0, 0.0)
    assert body.down_m == pytest.approx(-0.11, abs=0.015)
    assert (body.north_m, body.east_m) == pytest.approx(start, abs=1e-3)
    assert from_body_down(body.q)[2] > 0.999


def test_ground_is_found_from_any_height_in_time() -> None:
    body, _ = in_the_air("iris")
    body.down_m, body.vd_m_s = -30.0, 8.0
    for _ in range(3000):
        body.step((), 0.0, 0.0, 0.0)
    assert body.down_m == pytest.approx(-0.11, abs=0.015)


def test_no_multicopter() -> None:
    with pytest.raises(ValueError, match="rover is no multicopter"):
        Multicopter(vehicles.load("rover"), flat)
