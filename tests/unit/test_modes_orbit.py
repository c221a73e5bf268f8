"""Orbit over a vehicle that follows perfectly."""

import itertools
import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import (
    CommandRecord,
    ManualControlSetpoint,
    VehicleCommand,
)
from tests.unit.modes_follower import ALTITUDE_M, HOME, STEP_S, Follower, move

DO_ORBIT = 34


def orbit(radius: float, speed: float = 3.0, yaw_behaviour: float = 0.0) -> Follower:
    """A vehicle asked to fly a circle around a place 1 m from its own."""
    follower = Follower(nav_state=NavState.ORBIT)
    follower.place(1.0, 0.0, 10.0)
    ask(follower, radius, speed, yaw_behaviour, HOME.lat0_deg, HOME.lon0_deg, ALTITUDE_M + 10.0)
    return follower


def ask(follower: Follower, *params: float) -> None:
    """Command radius, speed, yaw behaviour, and maybe latitude, longitude, altitude."""
    radius, speed, behaviour, *place = params
    command = VehicleCommand(DO_ORBIT, radius, speed, behaviour, 0.0, *(place or (math.nan,) * 3))
    number = len(follower.topics.vehicle_commands) + 1
    follower.topics.vehicle_commands += (CommandRecord(number, follower.now_us, command),)


def flown_round(follower: Follower, seconds: float) -> tuple[float, float, float]:
    """Mean radius (m), mean speed (m/s) and angle turned (rad, clockwise) of the next seconds."""
    rows = [row.local for row in follower.fly(seconds)]
    bearings = [math.atan2(local.y, local.x) for local in rows]
    turned = sum(math.remainder(b - a, math.tau) for a, b in itertools.pairwise(bearings))
    radius = sum(math.hypot(local.x, local.y) for local in rows) / len(rows)
    return radius, sum(math.hypot(local.vx, local.vy) for local in rows) / len(rows), turned


@pytest.mark.parametrize("radius", [15.0, -15.0])
def test_an_orbit_keeps_its_radius_and_faces_its_centre(radius: float) -> None:
    follower = orbit(radius)
    follower.fly(20.0)
    flown, speed, turned = flown_round(follower, 4.0)
    assert flown == pytest.approx(15.0, abs=0.5)
    assert speed == pytest.approx(3.0, abs=0.2)
    assert math.copysign(1.0, turned) == math.copysign(1.0, radius)
    last = follower.topics.vehicle_local_position
    inward = math.remainder(last.heading - math.atan2(-last.y, -last.x), math.tau)
    assert abs(math.degrees(inward)) < 5.0
    assert follower.topics.orbit_status.radius == pytest.approx(radius)


@pytest.mark.parametrize(("radius", "speed", "clockwise"), [(10.0, -2.0, -1.0), (-10.0, -2.0, 1.0)])
def test_a_negative_speed_turns_the_other_way(radius: float, speed: float, clockwise: float) -> None:
    """The sign of the radius and that of the speed count both (FlightTaskOrbit.cpp)."""
    follower = orbit(radius, speed)
    follower.fly(15.0)
    assert math.copysign(1.0, flown_round(follower, 3.0)[2]) == clockwise
    assert follower.topics.orbit_status.radius == pytest.approx(10.0 * clockwise)


def test_an_orbit_is_no_faster_than_its_radius_allows() -> None:
    follower = orbit(8.0, 20.0)
    follower.fly(15.0)
    assert flown_round(follower, 3.0)[1] == pytest.approx(math.sqrt(2.0 * 8.0), abs=0.2)


def test_an_orbit_begins_slowly_on_its_circle() -> None:
    """The speed along the circle begins at none, and grows by MPC_ACC_HOR."""
    follower = orbit(15.0)
    along = []
    for row in follower.fly(20.0):
        if math.isnan(row.setpoint.position[0]):
            north, east = row.local.x, row.local.y
            velocity = row.setpoint.velocity
            along.append((velocity[1] * north - velocity[0] * east) / math.hypot(north, east))
    steps = [b - a for a, b in itertools.pairwise(along)]
    step = follower.parameters["MPC_ACC_HOR"] * STEP_S + 1e-3
    assert 0.0 <= along[0] <= step and max(steps) <= step
    assert along[-1] == pytest.approx(3.0, abs=0.01)


def test_it_flies_straight_to_its_circle_whatever_it_flew_before() -> None:
    """To PositionSmoothing the circle is a single waypoint."""
    follower = Follower(nav_state=NavState.ORBIT)
    local = follower.topics.vehicle_local_position._replace(vy=4.0, x=-40.0)
    follower.topics.vehicle_local_position = local
    ask(follower, 15.0, 3.0, 0.0, HOME.lat0_deg, HOME.lon0_deg, ALTITUDE_M + 20.0)
    rows = follower.fly(6.0)
    assert rows[-1].local.x > -22.0


def test_on_the_way_to_a_circle_the_height_waits_for_nobody() -> None:
    """FlightTaskOrbit leaves PositionSmoothing's vertical error at 0."""
    follower = Follower(nav_state=NavState.ORBIT)
    ask(follower, 15.0, 3.0, 0.0, HOME.lat0_deg, HOME.lon0_deg, ALTITUDE_M + 30.0)
    for _ in range(50):
        follower.place(-40.0, 0.0, 10.0)
        rows = follower.fly(0.1)
    assert -rows[-1].setpoint.position[2] > 15.0


def test_an_orbit_may_keep_its_heading() -> None:
    follower = orbit(15.0, yaw_behaviour=1.0)
    follower.fly(15.0)
    assert abs(follower.fly(5.0)[-1].local.heading) < 0.05


def test_an_orbit_may_look_along_its_circle() -> None:
    follower = orbit(15.0, yaw_behaviour=3.0)
    last = follower.fly(25.0)[-1].local
    assert abs(math.remainder(last.heading - math.atan2(last.vy, last.vx), math.tau)) < math.radians(10.0)


def test_a_stick_turns_an_orbit_away_from_a_heading_that_it_keeps() -> None:
    """FlightTaskOrbit::update: what is smoothed is the yaw that the stick finds in the next step."""
    follower = orbit(15.0, yaw_behaviour=4.0)
    follower.fly(20.0)
    kept = follower.topics.trajectory_setpoint.yaw
    move(follower, yaw=1.0)
    turning = follower.fly(2.0)[-1]
    assert turning.setpoint.yaw == pytest.approx(kept, abs=1e-4) and turning.setpoint.yawspeed > 1.0

    def turned_away() -> None:
        local = follower.topics.vehicle_local_position
        follower.topics.vehicle_local_position = local._replace(heading=kept + 0.4)

    move(follower)
    assert follower.fly(3.0, turned_away)[-1].setpoint.yaw == pytest.approx(kept, abs=1e-4)


def test_an_orbit_that_leaves_the_heading_alone_lets_its_turn_run_out() -> None:
    """Behaviour 2: HeadingSmoothing stops where it can."""
    follower = orbit(15.0, yaw_behaviour=2.0)
    rows = follower.fly(20.0)
    turns = [math.remainder(b.setpoint.yaw - a.setpoint.yaw, math.tau) for a, b in itertools.pairwise(rows)]
    slowing = [abs(b - a) / STEP_S**2 for a, b in itertools.pairwise(turns)]
    assert max(slowing) <= math.radians(follower.parameters["MPC_YAWRAUTO_ACC"]) * 1.1 and turns[-1] == 0.0


def test_what_a_second_command_leaves_out_stays() -> None:
    """NaN keeps centre and height; behaviour 5 keeps where it looks."""
    follower = orbit(15.0, yaw_behaviour=3.0)
    follower.fly(25.0)
    ask(follower, 8.0, math.nan, 5.0)
    follower.fly(15.0)
    radius, speed, _ = flown_round(follower, 3.0)
    assert radius == pytest.approx(8.0, abs=0.5)
    assert speed == pytest.approx(3.0, abs=0.2)
    last = follower.topics.vehicle_local_position
    assert abs(math.remainder(last.heading - math.atan2(last.vy, last.vx), math.tau)) < math.radians(20.0)


@pytest.mark.parametrize("radius", [0.0, 1001.0])
def test_a_radius_that_is_not_flown_is_told_and_the_vehicle_stays(radius: float) -> None:
    follower = orbit(15.0)
    follower.fly(20.0)
    ask(follower, radius, 3.0, 0.0)
    place = follower.topics.vehicle_local_position
    last = follower.fly(5.0)[-1]
    assert math.dist((last.local.x, last.local.y), (place.x, place.y)) < 2.0
    assert last.setpoint.velocity == (0.0, 0.0, 0.0)
    assert [text.text for text in follower.texts.recent] == ["Orbit radius limit exceeded\t"]
    ask(follower, 10.0, 3.0, 0.0, HOME.lat0_deg, HOME.lon0_deg, ALTITUDE_M + 10.0)
    follower.fly(15.0)
    assert flown_round(follower, 3.0)[0] == pytest.approx(10.0, abs=0.5)


def test_a_command_that_is_older_than_the_mode_by_a_fifth_of_a_second_is_not_flown() -> None:
    follower = orbit(15.0)
    follower.now_us += 300_000
    follower.fly(10.0)
    assert abs(follower.topics.orbit_status.radius) == pytest.approx(1.0)


def test_sticks_change_radius_and_speed() -> None:
    """Pitch forward comes closer by MPC_XY_CRUISE, roll right turns faster by MPC_ACC_HOR."""
    follower = orbit(30.0, 2.0)
    follower.fly(20.0)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True, pitch=1.0)
    follower.fly(2.0)
    assert follower.topics.orbit_status.radius == pytest.approx(
        30.0 - 2.0 * follower.parameters["MPC_XY_CRUISE"], abs=0.1
    )
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True, roll=1.0)
    follower.fly(0.5)
    follower.topics.manual_control_setpoint = ManualControlSetpoint(1, True)
    follower.fly(10.0)
    expected = 2.0 + 0.5 * follower.parameters["MPC_ACC_HOR"]
    assert flown_round(follower, 3.0)[1] == pytest.approx(expected, abs=0.2)
