"""Multicopters fly in their world: climb, hold, a step of 20 m, land; as well as PX4's SIH hexacopter was measured."""

import math
import statistics

import pytest

from sitl_emu.autopilot.constants import NavState, TakeoffState
from sitl_emu.autopilot.topics import (
    NAN,
    ManualControlSetpoint,
    OffboardSetpoint,
    VehicleAttitudeSetpoint,
    VehicleRatesSetpoint,
)
from tests.flight.multicopter_rig import Rig, Sample, tilt


def spread(samples: list[Sample], field: str, axis: int) -> float:
    return statistics.pstdev(float(getattr(sample, field)[axis]) for sample in samples)


def first(samples: list[Sample], after: float) -> float:
    """Time until the first sample north of a place."""
    return next(s.t for s in samples if s.position[0] > after) - samples[0].t


@pytest.mark.parametrize(
    ("model", "parcel"),
    [("sihsim_hex", False), ("iris", False), ("m600", False), ("responder", False), ("responder", True)],
)
def test_climbs_holds_steps_and_lands(model: str, parcel: bool) -> None:
    rig = Rig(model, parcel=parcel)
    rig.take_off(10.0)
    assert rig.control._takeoff.state == TakeoffState.FLIGHT
    heading = rig.topics.vehicle_local_position.heading

    hold = rig.run(20.0)
    for axis in range(3):
        assert spread(hold, "position", axis) < 0.4
        assert spread(hold, "velocity", axis) < 0.3
    assert max(abs(s.position[2] + 10.0) for s in hold) < 0.5
    assert statistics.fmean(tilt(s) for s in hold) < math.radians(3.0)
    assert max(math.dist(s.position[:2], s.truth[:2]) for s in hold) < 1.5
    assert rig.topics.hover_thrust_estimate.valid

    rig.fly((20.0, 0.0, -10.0), yaw=heading)
    step = rig.run(10.0)
    assert first(step, 18.0) < 5.0
    assert max(s.position[0] for s in step) < 21.6
    assert math.dist(step[-1].position, (20.0, 0.0, -10.0)) < 0.8
    assert max(tilt(s) for s in step) < math.radians(52.0)
    assert max(abs(s.position[2] + 10.0) for s in step) < 0.6

    rig.fly((20.0, 0.0, NAN), (NAN, NAN, 0.7), heading)
    for _ in range(200):
        rig.run(0.1)
        if rig.topics.vehicle_land_detected.landed:
            break
    assert rig.topics.vehicle_land_detected.landed
    # SIH's sinks in while it brakes.
    within_m = 0.5 if model == "sihsim_hex" else 0.1
    assert rig.simulator.pose().down_m == pytest.approx(rig.ground_down_m, abs=within_m)
    assert tilt(rig.record[-1]) < math.radians(5.0)
    rig.arm(False)
    rig.run(0.1)
    assert set(rig.topics.actuator_outputs.controls) == {0.0}
    assert set(rig.topics.actuator_outputs.pwm) == {900}


def test_at_rest_the_estimate_is_as_still_as_px4s() -> None:
    rig = Rig("sihsim_hex")
    rig.run(3.0)
    rest = rig.run(20.0)
    assert max(spread(rest, "position", axis) for axis in (0, 1)) < 0.1
    assert max(spread(rest, "velocity", axis) for axis in range(3)) < 0.03
    assert max(spread(rest, "euler", axis) for axis in range(3)) < math.radians(0.3)


def test_offboard_position_flies_as_px4_does() -> None:
    """PX4, `offboard_position`: 20 m north, 10 m east, 4 m up, turning by 90 degrees; values measured there."""
    rig = Rig("sihsim_hex")
    rig.take_off(8.0)
    heading = rig.topics.vehicle_local_position.heading
    rig.fly((20.0, 10.0, -12.0), yaw=math.remainder(heading + math.pi / 2, math.tau))
    flown = rig.run(10.0)
    speeds = [math.hypot(*s.velocity[:2]) for s in flown]
    away = [math.dist(s.position[:2], (20.0, 10.0)) for s in flown]
    along = [(20.0 * s.position[0] + 10.0 * s.position[1]) / math.hypot(20.0, 10.0) for s in flown]
    arrival = next(s.t for s, d in zip(flown, away, strict=True) if d < 1.0) - flown[0].t
    assert max(speeds) == pytest.approx(8.5, abs=1.0)
    assert arrival == pytest.approx(3.9, abs=1.0)
    assert max(along) - math.hypot(20.0, 10.0) == pytest.approx(1.25, abs=0.75)
    assert math.degrees(max(tilt(s) for s in flown)) == pytest.approx(45.2, abs=5.5)
    assert math.degrees(max(abs(s.yaw_rate) for s in flown)) == pytest.approx(144.0, abs=30.0)
    assert max(-s.velocity[2] for s in flown) == pytest.approx(2.7, abs=0.45)


def test_offboard_velocity_flies_as_px4_does() -> None:
    """PX4, `offboard_velocity`: asked for 4 m/s, drag and a slow integrator leave 3.4 m/s."""
    rig = Rig("sihsim_hex")
    rig.take_off(10.0)
    rig.fly(velocity=(4.0, 0.0, 0.0))
    flown = rig.run(8.0)
    speeds = [math.hypot(*s.velocity[:2]) for s in flown]
    assert statistics.fmean(speeds[-30:]) == pytest.approx(3.42, abs=0.43)
    assert max(speeds) == pytest.approx(3.52, abs=0.45)


def test_offboard_attitude_is_flown_directly() -> None:
    rig = Rig("sihsim_hex")
    rig.take_off(10.0)
    yaw = rig.topics.vehicle_local_position.heading
    q = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    leaning = (q[0] * 0.9976, q[3] * 0.0698, -q[0] * 0.0698, q[3] * 0.9976)  # pitched by -8 degrees

    def lean() -> None:
        attitude = VehicleAttitudeSetpoint(rig.now_us, leaning, 0.0, (0.0, 0.0, -0.33))
        rig.topics.offboard_setpoint = OffboardSetpoint(rig.now_us, attitude=attitude)

    lean()
    rig.mode(NavState.OFFBOARD)
    flown = []
    for _ in range(40):  # as a companion streams it: what is followed takes a step with each
        lean()
        flown += rig.run(0.05)
    assert math.degrees(statistics.fmean(s.euler[1] for s in flown[10:])) == pytest.approx(-8.0, abs=2.0)


def test_offboard_rates_are_flown_directly() -> None:
    rig = Rig("sihsim_hex")
    rig.take_off(10.0)
    rates = VehicleRatesSetpoint(rig.now_us, (0.0, 0.0, 0.5), (0.0, 0.0, -0.33))
    rig.topics.offboard_setpoint = OffboardSetpoint(rig.now_us, rates=rates)
    rig.mode(NavState.OFFBOARD)
    flown = rig.run(3.0)
    assert statistics.fmean(s.yaw_rate for s in flown[-10:]) == pytest.approx(0.5, abs=0.05)


def test_sticks_tilt_in_stab_and_rotate_in_acro() -> None:
    rig = Rig("sihsim_hex")
    rig.take_off(10.0)
    rig.mode(NavState.STAB)
    rig.topics.manual_control_setpoint = ManualControlSetpoint(rig.now_us, True, roll=0.5)
    flown = rig.run(1.5)
    assert math.degrees(flown[-1].euler[0]) == pytest.approx(17.5, abs=3.0)
    rig.mode(NavState.ACRO)
    rig.topics.manual_control_setpoint = ManualControlSetpoint(rig.now_us, True, yaw=0.3)
    flown = rig.run(1.5)
    assert math.degrees(flown[-1].yaw_rate) == pytest.approx(30.0, abs=6.0)


def test_without_takeoff_the_motors_stay_low_and_the_vehicle_landed() -> None:
    rig = Rig("iris")
    rig.run(3.0)
    rig.arm()
    rig.fly((0.0, 0.0, -10.0), want_takeoff=False)
    rig.run(4.0)
    assert rig.topics.vehicle_land_detected.landed
    assert max(rig.topics.actuator_outputs.controls) < 0.1
    assert rig.simulator.pose().down_m == pytest.approx(rig.ground_down_m, abs=0.02)


def test_in_a_termination_nobody_speaks_and_the_motors_turn_on() -> None:
    """TERMINATION enables no controller (control_mode.cpp), so that PX4's simulated outputs stay (PWMSim.cpp)."""
    rig = Rig("iris")
    rig.take_off(10.0)
    topics = rig.topics
    rig.mode(NavState.TERMINATION)

    def told() -> tuple[object, ...]:
        setpoints = (topics.vehicle_local_position_setpoint, topics.vehicle_attitude_setpoint)
        return (topics.actuator_outputs, topics.vehicle_rates_setpoint, topics.vehicle_thrust_setpoint, *setpoints)

    before = told()
    rig.run(1.0)
    assert told() == before and min(topics.actuator_outputs.controls) > 0.3
    assert rig.topics.vehicle_local_position.z < -6.0


def test_no_position_no_fly_away() -> None:
    """When GPS is gone for longer than EKF2_NOAID_TOUT, an unflyable setpoint ends in a slow descent."""
    rig = Rig("sihsim_hex")
    rig.take_off(10.0)
    rig.simulator.gps_off = True
    rig.run(5.5)
    assert not rig.topics.vehicle_local_position.xy_valid
    rig.fly((0.0, 0.0, -10.0))
    flown = rig.run(6.0)
    assert statistics.fmean(s.velocity[2] for s in flown[-20:]) == pytest.approx(0.7, abs=0.2)
    assert max(tilt(s) for s in flown) < math.radians(12.0)


def test_same_seed_same_flight() -> None:
    ends = []
    for _ in range(2):
        rig = Rig("iris", seed=7)
        rig.run(3.0)
        rig.arm()
        rig.fly((0.0, 0.0, NAN), (NAN, NAN, -1.5))
        rig.run(4.0)
        ends.append((rig.topics.vehicle_local_position, rig.topics.actuator_outputs, rig.simulator.pose()))
    assert ends[0] == ends[1]


def test_nothing_that_is_published_is_nan_in_flight() -> None:
    rig = Rig("iris")
    rig.take_off(5.0)
    local = rig.topics.vehicle_local_position
    numbers = [v for v in local._replace(dist_bottom=0.0) if isinstance(v, float)]
    assert not any(map(math.isnan, numbers))  # limits where nothing limits are infinite, as PX4's are


def test_a_parameter_changed_in_flight_does_not_shake_it() -> None:
    rig = Rig("iris")
    rig.take_off(5.0)
    rig.fly(velocity=(0.0, 0.0, 0.0))
    rig.topics.vehicle_status = rig.topics.vehicle_status._replace(nav_state=NavState.OFFBOARD)
    rates = VehicleRatesSetpoint(rig.now_us, (0.0, 0.0, 1.0), (0.0, 0.0, -0.53))
    rig.topics.offboard_setpoint = OffboardSetpoint(rig.now_us, rates=rates)
    rig.run(2.0)
    before = rig.topics.vehicle_angular_velocity.xyz[2]
    rig.parameters.set("MPC_XY_CRUISE", 4.0)
    rig.step()
    assert rig.topics.vehicle_angular_velocity.xyz[2] == pytest.approx(before, abs=0.1)
