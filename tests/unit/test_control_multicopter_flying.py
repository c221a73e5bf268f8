"""Multicopter control in the air, all of it together: filters of the velocity, the battery, motors that fail."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.control.mc_states import VehicleStates
from sitl_emu.autopilot.control.multicopter import MulticopterControl
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    BatteryStatus,
    FailureDetectorStatus,
    ManualControlSetpoint,
    OffboardSetpoint,
    Quaternion,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleAttitude,
    VehicleAttitudeSetpoint,
    VehicleConstraints,
    VehicleLandDetected,
    VehicleLocalPosition,
    VehicleRatesSetpoint,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.attitude import heading, quaternion
from sitl_emu.vehicles import load


class FlyingControl:
    """In the air, velocities controlled, 125 times a second."""

    def __init__(self, **values: float) -> None:
        at_once = {"COM_SPOOLUP_TIME": 0.0, "MPC_TKO_RAMP_T": 0.0}
        self.parameters = Parameters(VehicleKind.MULTICOPTER, {**load("sihsim_hex").airframe, **at_once, **values})
        self.topics, self.texts = Topics(), Texts()
        topics = self.topics
        self.control = MulticopterControl(topics, self.parameters, self.texts)
        self.now_us = 0
        topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.POSCTL)
        topics.actuator_armed = ActuatorArmed(armed=True)
        topics.vehicle_land_detected = VehicleLandDetected(ground_contact=False, maybe_landed=False, landed=False)
        topics.vehicle_constraints = VehicleConstraints(want_takeoff=True)

    def fly(self, steps: int, north: float = 0.0, heading_resets: int = 0, delta_heading: float = 0.0) -> None:
        """`north`: its velocity; how often the estimate of its heading has jumped, and by how much the last time."""
        for _ in range(steps):
            self.now_us = now_us = self.now_us + 8000
            self.topics.trajectory_setpoint = TrajectorySetpoint(now_us, velocity=(0.0, 0.0, 0.0))
            self.topics.vehicle_attitude = self.topics.vehicle_attitude._replace(timestamp=now_us)
            self.topics.vehicle_local_position = VehicleLocalPosition(
                now_us, now_us, True, True, True, True, z=-5.0, vx=north,
                heading_reset_counter=heading_resets, delta_heading=delta_heading,
            )  # fmt: skip
            self.control.update_position(now_us)
            self.control.update_rate(now_us)


@pytest.mark.parametrize(("cutoff_hz", "after_80_ms"), [(0.0, 1.0), (2.0, 0.62)])
def test_the_velocity_passes_a_low_pass_where_mpc_vel_lp_has_one(cutoff_hz: float, after_80_ms: float) -> None:
    """MulticopterPositionControl::set_vehicle_states; here velocity is all that is controlled, by its gain alone."""
    flown = FlyingControl(MPC_VEL_LP=cutoff_hz, MPC_XY_VEL_I_ACC=0.0, MPC_XY_VEL_D_ACC=0.0)
    flown.fly(200)
    flown.fly(10, north=1.0)
    told = flown.topics.vehicle_local_position_setpoint
    assert told.acceleration[0] == pytest.approx(-after_80_ms * flown.parameters["MPC_XY_VEL_P_ACC"], rel=0.03)


def test_a_mode_that_controls_the_velocity_begins_without_a_kick_whatever_it_was_before() -> None:
    """MulticopterPositionControl::Run: set_vehicle_states follows the velocity in every mode."""
    flown = FlyingControl(MPC_XY_VEL_I_ACC=0.0)
    topics = flown.topics
    flown.fly(50)
    topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.STAB)
    flown.fly(100, north=4.0)
    topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.POSCTL)
    flown.fly(1, north=4.0)
    asked = topics.vehicle_local_position_setpoint.acceleration[0]
    assert asked == pytest.approx(-4.0 * flown.parameters["MPC_XY_VEL_P_ACC"], rel=1e-3)


def test_a_jump_of_the_velocity_kicks_its_derivative_both_ways() -> None:
    """MulticopterPositionControl::Run filters a velocity before it moves the filters along."""
    states = VehicleStates(Parameters(VehicleKind.MULTICOPTER, {"MPC_VEL_LP": 0.0, "MPC_VELD_LP": 0.0}))
    local = VehicleLocalPosition(1, 1, True, True, True, True)
    jumped = local._replace(vx=2.0, vxy_reset_counter=1, delta_vxy=(2.0, 0.0))
    seen = [states.update(each, 0.008).acceleration[0] * 0.008 for each in (local, jumped, jumped, jumped)]
    assert seen == pytest.approx([0.0, 2.0, -2.0, 0.0])


@pytest.mark.parametrize(("bandwidth_hz", "left"), [(0.0, 1.0), (2.0, 0.0)])
def test_a_velocity_that_shakes_is_filtered_where_mpc_vel_nf_frq_has_a_notch(bandwidth_hz: float, left: float) -> None:
    """MulticopterPositionControl::set_vehicle_states; what is steady passes."""
    gains = {"MPC_XY_VEL_I_ACC": 0.0, "MPC_XY_VEL_D_ACC": 0.0}
    flown = FlyingControl(MPC_VEL_NF_FRQ=5.0, MPC_VEL_NF_BW=bandwidth_hz, **gains)
    seen = []
    for step in range(500):
        flown.fly(1, north=1.0 + math.sin(math.tau * 5.0 * step * 0.008))
        seen.append(flown.topics.vehicle_local_position_setpoint.acceleration[0])
    gain = flown.parameters["MPC_XY_VEL_P_ACC"]
    assert max(seen[-50:]) - min(seen[-50:]) == pytest.approx(2.0 * left * gain, abs=0.02)
    assert sum(seen[-50:]) / 50 == pytest.approx(-gain, rel=0.02)


@pytest.mark.parametrize(("enabled", "factor"), [(0, 1.0), (1, 1.2)])
def test_of_an_empty_battery_more_thrust_and_torque_are_asked_where_mc_bat_scale_en_says_so(
    enabled: int, factor: float
) -> None:
    """MulticopterRateControl::Run: battery_status.scale of a battery that is there."""
    flown = FlyingControl(MC_BAT_SCALE_EN=enabled)
    topics = flown.topics
    flown.fly(10)
    asked = topics.vehicle_rates_setpoint.thrust_body[2]
    assert topics.vehicle_thrust_setpoint.xyz[2] == pytest.approx(asked)
    topics.battery_status = BatteryStatus(connected=True, scale=1.2)
    topics.vehicle_angular_velocity = topics.vehicle_angular_velocity._replace(xyz=(0.1, 0.0, 0.0))
    flown.fly(10)
    scaled = topics.vehicle_rates_setpoint.thrust_body[2]
    assert topics.vehicle_thrust_setpoint.xyz[2] == pytest.approx(factor * scaled)
    motors = topics.actuator_outputs.controls
    assert sum(motor**2 for motor in motors) / len(motors) == pytest.approx(-factor * scaled, rel=1e-3)
    topics.battery_status = BatteryStatus(connected=False)
    flown.fly(10)
    assert topics.vehicle_thrust_setpoint.xyz[2] == pytest.approx(factor * topics.vehicle_rates_setpoint.thrust_body[2])


STICKS = ManualControlSetpoint(1, True, roll=-0.8, pitch=0.5, yaw=0.6)
RATES = OffboardSetpoint(1, rates=VehicleRatesSetpoint(1, (0.3, -0.2, 0.5), (0.0, 0.0, -0.4)))


@pytest.mark.parametrize(
    ("nav_state", "offboard", "asked"),
    [
        (NavState.STAB, OffboardSetpoint(), (-1.81, -1.37, 1.15)),
        (NavState.OFFBOARD, RATES, (0.3, -0.2, 0.5)),
    ],
)
def test_who_is_disarmed_controls_attitude_and_rates_and_its_outputs_rest(
    nav_state: NavState, offboard: OffboardSetpoint, asked: Vector3
) -> None:
    """MulticopterAttitudeControl::Run and MulticopterRateControl::Run ask for the mode's flags alone."""
    flown = FlyingControl()
    topics = flown.topics
    topics.actuator_armed, topics.manual_control_setpoint, topics.offboard_setpoint = ActuatorArmed(), STICKS, offboard
    topics.vehicle_status = VehicleStatus(nav_state=nav_state)
    flown.fly(150)
    rates, now_us = topics.vehicle_rates_setpoint, flown.now_us
    assert rates.rates == pytest.approx(asked, abs=0.02)
    torque, status = topics.vehicle_torque_setpoint, topics.control_allocator_status
    assert abs(torque.xyz[0]) > 0.01 and now_us - torque.timestamp <= 40_000 and now_us - status.timestamp <= 400_000
    assert now_us - topics.vehicle_thrust_setpoint.timestamp <= 8_000
    assert max(map(abs, topics.rate_ctrl_status[1:])) < 0.01, "what it learnt is forgotten"
    assert topics.actuator_controls_status.control_power[0] > 0.0
    assert set(topics.actuator_outputs.controls) == {0.0} and set(topics.actuator_outputs.pwm) == {900}
    assert topics.actuator_outputs.timestamp == now_us


@pytest.mark.parametrize("q_d", [(0.0, 0.0, 0.0, 0.0), (1.0, math.nan, 0.0, 0.0)])
def test_after_an_attitude_without_a_direction_none_is_flown_any_more(q_d: Quaternion) -> None:
    """AttitudeControl::setAttitudeSetpoint: the reference stays NaN, in any mode; rates are held as they are."""
    flown = FlyingControl()
    topics = flown.topics
    flown.fly(10)
    topics.vehicle_angular_velocity = topics.vehicle_angular_velocity._replace(xyz=(0.1, 0.2, 0.3))
    attitude = VehicleAttitudeSetpoint(flown.now_us + 1, q_d, 0.0, (0.0, 0.0, -0.4))
    topics.offboard_setpoint = OffboardSetpoint(flown.now_us + 1, attitude=attitude)
    for nav_state in (NavState.OFFBOARD, NavState.POSCTL):
        topics.vehicle_status = VehicleStatus(armed=True, nav_state=nav_state)
        flown.fly(10)
        assert all(map(math.isnan, topics.vehicle_rates_setpoint.rates))
        assert topics.vehicle_torque_setpoint.xyz == pytest.approx((0.0, 0.0, 0.0), abs=2e-3)
        assert all(map(math.isfinite, topics.actuator_outputs.controls))


def test_a_rate_that_is_no_number_is_the_one_that_was_when_it_was_told() -> None:
    """MulticopterRateControl::Run."""
    flown = FlyingControl()
    topics = flown.topics
    topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.OFFBOARD)
    topics.vehicle_angular_velocity = topics.vehicle_angular_velocity._replace(xyz=(0.3, 0.0, 0.0))
    rates = VehicleRatesSetpoint(1, (math.nan, 0.0, math.inf), (0.0, 0.0, -0.4))
    topics.offboard_setpoint = OffboardSetpoint(1, rates=rates)
    flown.fly(5)
    assert topics.vehicle_torque_setpoint.xyz == pytest.approx((0.0, 0.0, 0.0))
    topics.vehicle_angular_velocity = topics.vehicle_angular_velocity._replace(xyz=(0.0, 0.0, 0.0))
    flown.fly(5)
    assert topics.vehicle_torque_setpoint.xyz[0] > 0.01


@pytest.mark.parametrize(("thrust", "scaled"), [(math.nan, 0), (math.nan, 1), (-math.inf, 0)])
def test_a_thrust_that_is_no_number_stops_the_motors(thrust: float, scaled: int) -> None:
    """ActuatorEffectiveness::stopMotorsBasedOnThrustSetpoint; the next one that is one starts them again."""
    flown = FlyingControl(MC_BAT_SCALE_EN=scaled)
    topics = flown.topics
    topics.battery_status = BatteryStatus(connected=True, scale=1.2)
    topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.OFFBOARD)
    topics.offboard_setpoint = OffboardSetpoint(1, rates=VehicleRatesSetpoint(1, (0.0, 0.0, 0.0), (0.0, 0.0, thrust)))
    flown.fly(5)
    assert set(topics.actuator_outputs.controls) == {0.0} and set(topics.actuator_outputs.pwm) == {900}
    topics.offboard_setpoint = RATES
    flown.fly(5)
    assert min(topics.actuator_outputs.controls) > 0.3


@pytest.mark.parametrize("nav_state", [NavState.OFFBOARD, NavState.TERMINATION])
def test_a_mode_without_controllers_tells_nothing(nav_state: NavState) -> None:
    """control_mode.cpp: OFFBOARD whose setpoint has not come, and TERMINATION."""
    flown = FlyingControl()
    topics = flown.topics

    def told() -> tuple[object, ...]:
        rates, torque = topics.vehicle_rates_setpoint, topics.vehicle_torque_setpoint
        places = (topics.vehicle_attitude_setpoint, topics.vehicle_local_position_setpoint)
        return (*places, rates, torque, topics.vehicle_thrust_setpoint, topics.actuator_outputs)

    for armed in (False, True):
        topics.actuator_armed = ActuatorArmed(armed=armed)
        topics.vehicle_status = VehicleStatus(nav_state=NavState.POSCTL)
        flown.fly(10)
        before, topics.vehicle_status = told(), VehicleStatus(nav_state=nav_state)
        flown.fly(50)
        assert told() == before


@pytest.mark.parametrize("handled", [0, 1])
def test_a_motor_that_is_off_stands_still_where_ca_failure_mode_handles_it(handled: int) -> None:
    """ControlAllocator::handle_stopped_motors: NaN, at the output the disarmed pulse, and in all that is told of it."""
    flown = FlyingControl(CA_FAILURE_MODE=handled)
    topics = flown.topics
    topics.failure_detector_status = FailureDetectorStatus(motor_stop_mask=0b100)
    flown.fly(51)
    pulses = list(topics.actuator_outputs.pwm)
    assert (pulses.pop(2) == 900) is bool(handled) and min(pulses) > 1000
    assert (topics.actuator_outputs.controls[2] == 0.0) is bool(handled)
    status = topics.control_allocator_status
    assert [said.line for said in flown.texts.lines] == ["[control_allocator] Stopping motors (4)"] * handled
    assert (status.handled_motor_failure_mask, status.motor_stop_mask) == (0, 0b100 * handled)
    assert status.torque_setpoint_achieved is not bool(handled)
    assert math.isnan(status.unallocated_torque[0]) is math.isnan(status.unallocated_thrust[2]) is bool(handled)
    topics.failure_detector_status = FailureDetectorStatus()
    flown.fly(10)
    assert min(topics.actuator_outputs.pwm) > 1000


@pytest.mark.parametrize(
    ("knows", "failsafes"),
    [
        ((True, True), ["stop and wait"]),
        ((False, True), ["blind land"]),
        ((False, False), ["blind land", "blind descent"]),
    ],
)
def test_the_log_is_told_of_setpoints_that_cannot_be_flown(knows: tuple[bool, bool], failsafes: list[str]) -> None:
    """MulticopterPositionControl::generateFailsafeSetpoint, every two seconds at most."""
    flown = FlyingControl()
    flown.now_us = 10_000_000
    for _ in range(300):
        flown.now_us += 8000
        flown.topics.trajectory_setpoint = TrajectorySetpoint(flown.now_us)
        flown.topics.vehicle_local_position = VehicleLocalPosition(
            flown.now_us, flown.now_us, *knows, *knows, vx=math.nan if not knows[0] else 0.0
        )
        flown.control.update_position(flown.now_us)
    expected = ["invalid setpoints", *(f"Failsafe: {each}" for each in failsafes)]
    assert [said.line for said in flown.texts.lines] == [f"[mc_pos_control] {line}" for line in expected] * 2


def step(flown: FlyingControl) -> None:
    """8 ms in which nobody tells a setpoint."""
    flown.now_us += 8000
    local = flown.topics.vehicle_local_position
    flown.topics.vehicle_local_position = local._replace(timestamp=flown.now_us, timestamp_sample=flown.now_us)
    flown.control.update_position(flown.now_us)


def test_until_somebody_asks_it_waits_and_the_log_says_nothing() -> None:
    """From a mode that controls no position, before the new one's task has run (generateFailsafeSetpoint, warn)."""
    flown = FlyingControl()
    flown.fly(10)
    flown.topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.STAB)
    step(flown)
    flown.topics.trajectory_setpoint = TrajectorySetpoint(flown.now_us)
    step(flown)
    flown.topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.POSCTL)
    for _ in range(3):
        step(flown)
    assert not flown.texts.lines
    target = flown.topics.vehicle_local_position_setpoint
    assert (target.vx, target.vy, target.vz) == (0.0, 0.0, 0.0)


def test_a_setpoint_that_was_flown_is_flown_for_a_fifth_of_a_second_from_when_it_was_told() -> None:
    flown = FlyingControl()
    flown.now_us = 10_000_000
    flown.fly(10)
    told_us = flown.now_us
    while flown.now_us < told_us + 160_000:
        step(flown)
    flown.topics.trajectory_setpoint = TrajectorySetpoint(flown.now_us)
    step(flown)
    assert not flown.texts.lines
    while flown.now_us < told_us + 200_000:
        step(flown)
    assert next(said.line for said in flown.texts.lines) == "[mc_pos_control] invalid setpoints"


def test_what_touched_the_ground_has_no_thrust_until_the_next_setpoint() -> None:
    flown = FlyingControl()
    flown.fly(100)
    for contact in (True, False, False):
        flown.topics.vehicle_land_detected = VehicleLandDetected(
            landed=False, maybe_landed=False, ground_contact=contact
        )
        step(flown)
        assert flown.topics.vehicle_attitude_setpoint.thrust_body[2] == pytest.approx(0.0, abs=0.2), contact
    flown.fly(1)
    assert flown.topics.vehicle_attitude_setpoint.thrust_body[2] < -0.3


def test_a_setpoint_moves_along_where_the_estimate_jumps_until_the_next_one_comes() -> None:
    """MulticopterPositionControl::adjustSetpointForEKFResets: whoever flies OFFBOARD learns of it late."""
    flown, told = FlyingControl(), TrajectorySetpoint(8000, (3.0, 0.0, -5.0), (0.1, 0.0, 0.2), yaw=3.0)
    topics = flown.topics
    local = VehicleLocalPosition(8000, 8000, True, True, True, True, z=-5.0)

    def tracked(setpoint: TrajectorySetpoint, here: VehicleLocalPosition) -> tuple[float, float, float, float]:
        flown.now_us += 8000
        topics.trajectory_setpoint = setpoint
        topics.vehicle_local_position = here._replace(timestamp=flown.now_us)
        flown.control.update_position(flown.now_us)
        target = topics.vehicle_local_position_setpoint
        return target.x, target.y, target.z, target.yaw

    assert tracked(told, local) == (3.0, 0.0, -5.0, 3.0)
    jumped = local._replace(
        x=10.0, delta_xy=(10.0, 2.0), xy_reset_counter=1, delta_z=1.5, z_reset_counter=1,
        delta_heading=0.5, heading_reset_counter=1,
    )  # fmt: skip
    for _ in range(3):
        assert tracked(told, jumped) == pytest.approx((13.0, 2.0, -3.5, 3.5 - math.tau))
    assert tracked(told._replace(timestamp=flown.now_us), jumped) == (3.0, 0.0, -5.0, 3.0)


@pytest.mark.parametrize("jump", [0.6, -2.9])
def test_a_jump_of_the_heading_does_not_turn_a_vehicle_that_sticks_fly(jump: float) -> None:
    """MulticopterAttitudeControl::Run: the heading that is held in STABILIZED moves along."""
    flown = FlyingControl()
    topics = flown.topics
    topics.manual_control_setpoint = ManualControlSetpoint(0, True)
    topics.vehicle_status = VehicleStatus(armed=True, nav_state=NavState.STAB)
    before = 0.5
    topics.vehicle_attitude = VehicleAttitude(q=quaternion(0.0, 0.0, before), euler=(0.0, 0.0, before))
    for resets in (0, 0, 1, 1):
        now = math.remainder(before + resets * jump, math.tau)
        topics.vehicle_attitude = VehicleAttitude(q=quaternion(0.0, 0.0, now), euler=(0.0, 0.0, now))
        flown.fly(100, heading_resets=resets, delta_heading=jump)
    assert math.remainder(heading(topics.vehicle_attitude_setpoint.q_d) - now, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_attitude_is_controlled_with_each_that_is_told() -> None:
    """MulticopterAttitudeControl runs on vehicle_attitude, at 250 Hz, and not without."""
    flown = FlyingControl()
    flown.fly(2)
    topics, told_us = flown.topics, []
    for tick in range(6):
        flown.now_us += 4000
        if tick < 4:
            topics.vehicle_attitude = topics.vehicle_attitude._replace(timestamp=flown.now_us)
        flown.control.update_rate(flown.now_us)
        told_us.append(flown.now_us - topics.vehicle_rates_setpoint.timestamp)
    assert told_us == [0, 0, 0, 0, 4000, 8000]


def test_a_parameter_that_changes_in_flight_does_not_stop_motors_with_a_slew_rate() -> None:
    flown = FlyingControl(CA_R0_SLEW=5.0)
    flown.fly(1000)
    before = flown.topics.actuator_outputs.controls
    flown.parameters.set("MPC_TILTMAX_AIR", 40.0)
    flown.fly(100)
    assert before[0] > 0.3 and flown.topics.actuator_outputs.controls == pytest.approx(before, abs=0.02)
