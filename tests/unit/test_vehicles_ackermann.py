import math
from typing import TypeVar

import pytest

from sitl_emu import vehicles
from sitl_emu.vehicles.ackermann import Ackermann
from sitl_emu.vehicles.dynamics import STEP_S
from sitl_emu.vehicles.multicopter import from_body_down
from sitl_emu.vehicles.sih_ackermann import SihAckermann
from sitl_emu.world.atmosphere import gravity_m_s2
from tests.typed import present

G = 9.80665
ROVER = vehicles.load("rover")
SIH = vehicles.load("sihsim_rover_ackermann")
HOME = (47.397742, 8.545594)
CHASSIS = present(ROVER.chassis)
Body = TypeVar("Body", Ackermann, SihAckermann)


def flat(north: float, east: float) -> float:
    return 0.0


def drive(body: Body, steering: float, throttle: float, seconds: float) -> Body:
    for _ in range(round(seconds * 250)):
        body.step((steering, throttle), 0.0, 0.0, 0.0)
    return body


def speed(body: Ackermann | SihAckermann) -> float:
    return math.hypot(body.vn_m_s, body.ve_m_s)


def test_straight_on_along_its_heading() -> None:
    body = drive(Ackermann(ROVER, flat, yaw_rad=0.5), 0.0, 0.8, 5.0)
    assert math.atan2(body.east_m, body.north_m) == pytest.approx(0.5, abs=1e-6)
    assert math.atan2(body.ve_m_s, body.vn_m_s) == pytest.approx(0.5, abs=1e-6)


def test_full_throttle_speed_is_what_the_airframe_says() -> None:
    body = drive(Ackermann(ROVER, flat), 0.0, 1.0, 8.0)
    assert speed(body) == pytest.approx(ROVER.airframe["RO_MAX_THR_SPEED"], abs=0.1)


@pytest.mark.parametrize("steering", [0.3, -0.6, 1.0])
def test_turn_radius_is_wheelbase_over_tan_steer(steering: float) -> None:
    body = drive(Ackermann(ROVER, flat), steering, 0.3, 10.0)
    radius = speed(body) / abs(body.r_rad_s)
    rear_axle = CHASSIS.wheelbase_m / math.tan(CHASSIS.max_steer_angle_rad * abs(steering))
    expected = math.hypot(rear_axle, CHASSIS.centre_to_rear_axle_m)
    assert radius == pytest.approx(expected, rel=0.06)
    assert math.copysign(1.0, body.r_rad_s) == math.copysign(1.0, steering), "positive steers right"


def test_tyres_slide_when_too_fast_for_the_curve() -> None:
    body = drive(Ackermann(ROVER, flat), 0.0, 1.0, 4.0)
    worst = 0.0
    for _ in range(500):
        body.step((1.0, 1.0), 0.0, 0.0, 0.0)
        worst = max(worst, abs(body.ay_m_s2))
    assert worst <= CHASSIS.tyre_friction * G * 1.02
    assert speed(body) > 0.5


def test_reverse_steers_like_a_car() -> None:
    body = drive(Ackermann(ROVER, flat), 0.5, -0.4, 4.0)
    assert body.r_rad_s < 0.0
    assert body.north_m < 0.0 or body.east_m != 0.0


def test_stops_at_zero_throttle_and_stays() -> None:
    body = drive(Ackermann(ROVER, flat), 0.0, 0.8, 4.0)
    before = body.north_m
    drive(body, 0.0, 0.0, 3.0)
    assert speed(body) == 0.0
    assert 0.1 < body.north_m - before < 1.5
    stopped = body.north_m
    drive(body, 0.4, 0.0, 5.0)
    assert body.north_m == stopped
    assert not body.running


def test_brake_stops_a_slow_rover_on_a_slope() -> None:
    body = drive(Ackermann(ROVER, lambda north, east: -0.15 * north), 0.0, 0.1, 2.0)
    assert speed(body) > 0.2
    before = body.north_m
    drive(body, 0.0, 0.0, 2.0)
    assert speed(body) == 0.0
    assert body.north_m - before < 0.4


@pytest.mark.parametrize("yaw", [0.0, 1.0, 2.5, -1.2])
def test_parks_on_a_slope_and_lies_on_it(yaw: float) -> None:
    rise_n, rise_e = 0.2, -0.1
    body = Ackermann(ROVER, lambda n, e: 5.0 + rise_n * n + rise_e * e, 3.0, 4.0, yaw, G)
    start = (body.north_m, body.east_m, body.down_m)
    drive(body, 0.0, 0.0, 5.0)
    assert (body.north_m, body.east_m, body.down_m) == pytest.approx(start)
    x, y, z = from_body_down(body.q)
    assert math.acos(z) == pytest.approx(math.atan(math.hypot(rise_n, rise_e)), abs=1e-3)
    assert (body.ax_m_s2, body.ay_m_s2, body.az_m_s2) == pytest.approx((-G * x, -G * y, -G * z), abs=1e-9)


def test_climbs_slower_than_it_descends_and_follows_the_ground() -> None:
    def hill(north: float, east: float) -> float:
        return 0.15 * north

    up = drive(Ackermann(ROVER, hill), 0.0, 0.7, 6.0)
    down = drive(Ackermann(ROVER, hill, yaw_rad=math.pi), 0.0, 0.7, 6.0)
    assert 0.5 < speed(up) < speed(down)
    for body in (up, down):
        assert -body.down_m - hill(body.north_m, body.east_m) == pytest.approx(CHASSIS.centre_height_m, abs=0.05)
        assert body.vd_m_s == pytest.approx(-0.15 * body.vn_m_s, abs=0.02)


def test_gyro_and_attitude_agree_on_rough_ground() -> None:
    def rough(north: float, east: float) -> float:
        return 0.2 * math.sin(0.8 * north) + 0.1 * math.sin(1.1 * east)

    body = Ackermann(ROVER, rough)
    w, x, y, z = body.q
    for tick in range(1500):
        body.step((0.4 * math.sin(tick / 200.0), 0.6), 0.0, 0.0, 0.0)
        p, q, r = (0.002 * rate for rate in (body.p_rad_s, body.q_rad_s, body.r_rad_s))
        w, x, y, z = (
            w - p * x - q * y - r * z,
            x + p * w + r * y - q * z,
            y + q * w - r * x + p * z,
            (z + r * w + q * x - p * y),
        )
        k = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * k, x * k, y * k, z * k
    dot = abs(w * body.q[0] + x * body.q[1] + y * body.q[2] + z * body.q[3])
    assert 2 * math.acos(min(1.0, dot)) < 0.01, "integrated rates give the attitude"


def test_wrong_vehicle() -> None:
    with pytest.raises(ValueError, match="iris has no chassis"):
        Ackermann(vehicles.load("iris"), flat)
    with pytest.raises(ValueError, match="iris is no SIH rover"):
        SihAckermann(vehicles.load("iris"), flat)


# --- PX4's SIH rover: figures measured on PX4 v1.18 ---


def sih(yaw: float = 0.0) -> SihAckermann:
    return SihAckermann(SIH, flat, 0.0, 0.0, yaw, 9.8079, *HOME)


@pytest.mark.parametrize(("yaw", "measured"), [(0.0, 3.0), (math.pi, 3.0), (math.pi / 2, 2.55), (math.pi / 4, 3.2)])
def test_sih_speed_depends_on_direction(yaw: float, measured: float) -> None:
    # RO_SPEED_LIM 3 of RO_MAX_THR_SPEED 3.2 is throttle 0.94
    assert speed(drive(sih(yaw), 0.0, 3.0 / 3.2, 6.0)) == pytest.approx(measured, abs=0.12)


def test_sih_throttle_0_4_drives_as_measured() -> None:
    assert speed(drive(sih(), 0.0, 0.4, 4.0)) == pytest.approx(1.68, abs=0.05)


def test_sih_stops_and_stands() -> None:
    body = drive(sih(), 0.0, 0.4, 4.0)
    before = body.north_m
    drive(body, 0.0, 0.0, 3.0)
    assert speed(body) < 0.01
    assert body.north_m - before == pytest.approx(0.4, abs=0.2)


def test_sih_static_friction_holds_a_little_throttle() -> None:
    assert speed(drive(sih(), 0.0, 0.2, 3.0)) < 0.01
    assert speed(drive(sih(), 0.0, 0.3, 3.0)) > 0.5


def parked(place: tuple[float, float], seconds: float, yaw: float = 0.0) -> SihAckermann:
    """As from boot: no output has come yet."""
    body = SihAckermann(SIH, flat, 0.0, 0.0, yaw, gravity_m_s2(place[0]), *place)
    for _ in range(round(seconds / STEP_S)):
        body.step((), 0.0, 0.0, 0.0)
    return body


def test_sih_parked_from_boot_falls_through_the_ground_at_px4s_home_until_it_drives() -> None:
    """sih.cpp: friction stops it (generate_rover_ackermann_dynamics) before the ground can (equations_of_motion)."""
    body = parked(HOME, 30.0)
    assert body.vd_m_s == pytest.approx(0.0392, abs=1e-4)
    assert body.down_m == pytest.approx(30.0 * 0.0392, abs=0.01)
    assert body.az_m_s2 == pytest.approx(-9.8084, abs=1e-3)
    drive(body, 0.0, 0.5, 2.0)
    sunk_m = body.down_m
    assert abs(body.vd_m_s) < 1e-3, "the ground stops it, and lifts it no more"
    drive(body, 0.0, 0.0, 5.0)
    assert body.down_m == pytest.approx(sunk_m, abs=0.01)


@pytest.mark.parametrize("place", [(52.5, 13.4), (-33.9, 151.2)])
def test_sih_is_caught_by_the_ground_where_rounding_leaves_it_a_weight(place: tuple[float, float]) -> None:
    """Where a real PX4 v1.18 with PX4_HOME_LAT and PX4_HOME_LON stands still 1 mm below its start."""
    body = parked(place, 10.0)
    assert body.vd_m_s == pytest.approx(0.0, abs=1e-6)
    assert 0.0 < body.down_m < 0.001


def test_sih_rises_on_its_way_east_and_sinks_on_its_way_west() -> None:
    """What the Earth's turning does, -2 ω cos φ of the way made east, the ground does not hold (docs/measured.md)."""
    for yaw, sign in ((math.pi / 2, 1.0), (-math.pi / 2, -1.0)):
        body = parked(HOME, 5.0, yaw)
        drive(body, 0.0, 0.9, 8.0)
        assert body.vd_m_s == pytest.approx(-9.9e-5 * body.east_m, abs=2e-5) and body.east_m * sign > 15.0


def test_sih_steers_right_for_positive_steering() -> None:
    body = drive(sih(), 0.5, 0.6, 3.0)
    assert body.r_rad_s > 0.3
