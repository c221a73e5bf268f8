"""DO_AUTOTUNE_ENABLE: what it is answered, how it goes on, and the gains that it finds."""

import math

import pytest

from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.control.control_power import ControlPower
from sitl_emu.autopilot.control.mc_autotune import McAutotune, State
from sitl_emu.autopilot.control.system_identification import PidGains, SystemIdentification, pid_gains
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import ManualControlSetpoint, Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from tests.typed import now
from tests.unit.vehicle_command import vehicle_command

from .test_actuator_test import Bench

AUTOTUNE, ARM_DISARM, TAKEOFF = 212, 400, 22
ACCEPTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = 0, 2, 3, 4, 5
NAN = math.nan


class Desk:
    """The module alone: nothing turns."""

    def __init__(self, **parameters: float) -> None:
        self.topics = Topics()
        parameters = {"MC_AT_EN": 1, **parameters}
        self.events: list[str] = []
        self.autotune = McAutotune(self.topics, Parameters(VehicleKind.MULTICOPTER, parameters), self._say)
        self.now_us = 0

    def _say(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        self.events.append(event)

    def ask(self, first: float = 1.0, second: float = 0.0) -> tuple[int, int]:
        """(result, progress)."""
        answer = self.autotune.handle_command(self.now_us, VehicleCommand(AUTOTUNE, first, second))
        return answer.result, answer.progress

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 50)):
            self.now_us += 20_000
            self.autotune.update(self.now_us)


@pytest.mark.parametrize(
    ("first", "second", "result", "events"),
    [
        (0.0, 0.0, DENIED, ["input"]),
        (2.0, 0.0, DENIED, ["input"]),
        (1.0, 1.0, DENIED, ["ax"]),
        (NAN, 1.0, DENIED, ["ax"]),
        (0.0, NAN, DENIED, ["input"]),
        (NAN, 0.0, UNSUPPORTED, []),
        (1.0, NAN, UNSUPPORTED, []),
    ],
)
def test_it_can_only_be_begun_for_all_axes(first: float, second: float, result: int, events: list[str]) -> None:
    """The navigator says what it does not do."""
    desk = Desk()
    assert desk.ask(first, second) == (result, 0)
    assert desk.events == [f"navigator_autotune_unsupported_{what}" for what in events]
    desk.run(1.0)
    assert desk.autotune.state is State.IDLE


def test_on_the_ground_nothing_settles_and_it_fails() -> None:
    desk = Desk()
    assert desk.ask() == (IN_PROGRESS, 0)
    desk.run(3.0)
    assert (desk.autotune.state, desk.ask()) == (State.INIT, (IN_PROGRESS, 0))
    desk.run(2.0)
    assert (desk.autotune.state, desk.ask()) == (State.ROLL, (IN_PROGRESS, 20))
    desk.run(20.5)
    assert (desk.autotune.state, desk.ask()) == (State.FAIL, (FAILED, 0))
    desk.run(2.5)
    assert (desk.autotune.state, desk.autotune.rates) == (State.IDLE, None)


def test_it_tells_how_far_it_is_ten_times_a_second() -> None:
    """What a real v1.18 (sihsim_hex) logged before it had a model; then the model's own numbers."""
    desk = Desk()
    desk.run(1.0)
    assert desk.topics.autotune_attitude_control_status.timestamp == 0
    desk.ask()
    times = set()
    for _ in range(100):
        desk.run(0.02)
        times.add(desk.topics.autotune_attitude_control_status.timestamp)
    told = desk.topics.autotune_attitude_control_status
    assert len(times) == 20
    assert (told.state, told.coeff, told.coeff_var, told.dt_model) == (1, (0.0,) * 5, (10e3,) * 5, 0.01)
    assert (told.kc, told.ki, told.att_p) == (0.0, -math.inf, 2.0) and math.isnan(told.kd)
    desk.run(3.0)
    desk.autotune.on_torque((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    desk.autotune.on_torque((0.1, 0.0, 0.0), (0.2, 0.0, 0.0))
    desk.run(0.2)
    told = desk.topics.autotune_attitude_control_status
    assert (told.state, told.dt_model) == (3, 0.008) and told.fitness > 9.0
    assert told.u_filt > 0.0 and told.y_filt > 0.0 and told.rate_sp[0] != 0.0
    desk.run(19.5)
    assert desk.topics.autotune_attitude_control_status.state == 15
    desk.run(3.0)
    assert desk.topics.autotune_attitude_control_status.state == 0


def test_the_second_time_it_shakes_at_once() -> None:
    desk = Desk()
    desk.ask()
    desk.run(5.0)
    desk.topics.vehicle_status = desk.topics.vehicle_status._replace(nav_state=NavState.AUTO_LAND)
    desk.run(3.0)
    assert now(desk.autotune.state) is State.IDLE
    desk.ask()
    desk.run(0.3)
    assert now(desk.autotune.state) is State.ROLL


def test_sticks_and_another_mode_end_it() -> None:
    desk = Desk()
    desk.ask()
    desk.run(5.0)
    desk.topics.manual_control_setpoint = ManualControlSetpoint(desk.now_us, roll=0.1)
    desk.run(0.2)
    assert desk.autotune.state is State.FAIL
    desk.topics.manual_control_setpoint = ManualControlSetpoint(desk.now_us)
    desk.run(3.0)
    desk.ask()
    desk.run(1.0)
    desk.topics.vehicle_status = desk.topics.vehicle_status._replace(nav_state=NavState.AUTO_LAND)
    desk.run(0.2)
    assert desk.autotune.state is State.FAIL


@pytest.mark.parametrize(("torque", "state"), [(0.25, State.COMPLETE), (0.28, State.FAIL)])
def test_gains_that_are_tried_out_may_not_take_much_of_the_motors(torque: float, state: State) -> None:
    """0.1, as the length of the three mean squares of the torques (McAutotuneAttitudeControl::updateStateMachine)."""
    desk = Desk(MC_AT_APPLY=2)
    desk.ask()
    desk.run(0.2)
    desk.autotune._gains = [(PidGains(0.1, 1.0, 0.001), 4.0)] * 3
    desk.autotune._enter(desk.now_us, State.VERIFICATION)
    power = ControlPower(desk.topics)
    for _ in range(230):
        desk.run(0.02)
        for _ in range(5):
            power.add(desk.now_us, (torque, -torque, 0.0), 0.004)
        if desk.autotune.state in (State.COMPLETE, State.FAIL):
            break
    assert desk.autotune.state is state


def test_without_the_module_the_answer_stays_the_same() -> None:
    """As PX4's receiver, which knows the parameters alone."""
    desk = Desk(MC_AT_EN=0)
    assert desk.ask() == (IN_PROGRESS, 0)
    desk.run(6.0)
    assert (desk.autotune.state, desk.ask()) == (State.IDLE, (IN_PROGRESS, 0))


def test_a_known_system_is_identified() -> None:
    """Five coefficients from a square wave; the filters are the same for input and output."""
    a1, a2, b0, b1, b2 = -1.5, 0.56, 0.02, 0.01, 0.005
    identification = SystemIdentification(0.008, 0.008, 40.0)
    u, y = [0.0] * 4, [0.0] * 3
    identification.sample(0.0, 0.0)
    for k in range(4000):
        u = [*u[1:], math.sin(0.13 * k) + math.sin(0.7 * k) + (1.0 if k // 37 % 2 else -1.0)]
        y = [*y[1:], -a1 * y[-1] - a2 * y[-2] + b0 * u[-2] + b1 * u[-3] + b2 * u[-4]]
        identification.sample(u[-1], y[-1])
        identification.fit()
    assert identification.coefficients == pytest.approx([a1, a2, b0, b1, b2], abs=0.002)
    assert max(identification.variances) < 50.0
    assert abs(identification.innovation) < 0.01 and identification.fitness < 0.1


def test_gains_of_an_integrator_with_lag() -> None:
    """For 1/(s(0.05 s + 1)) sampled at 8 ms, the faster the rise the higher the gain."""
    pole = math.exp(-0.008 / 0.05)
    system = [-1.0 - pole, pole, 6.2e-4, 5.8e-4, 0.0]
    slow, fast = pid_gains(system, 0.008, 0.3, 0.0), pid_gains(system, 0.008, 0.14, 0.0)
    assert 0.0 < slow.k < fast.k
    assert fast.i > 0.0 and fast.d > 0.0
    assert pid_gains([0.0] * 5, 0.008, 0.14, 0.0) == (0.0, 0.0, 0.0)


def test_a_hexacopter_tunes_itself_in_flight_and_keeps_the_gains_when_it_is_disarmed() -> None:
    bench = Bench("sihsim_hex")
    autopilot = bench.autopilot

    def give(number: int, *params: float) -> tuple[int, int]:
        answer = autopilot.commands.handle(autopilot.now_us, vehicle_command(number, *params, rest=0.0))
        assert answer is not None
        return answer.result, answer.progress

    bench.run(4.0)
    assert give(ARM_DISARM, 1, 21196) == (ACCEPTED, 0)
    assert give(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 509.0) == (ACCEPTED, 0)
    bench.run(20.0)
    before = autopilot.parameters["MC_ROLLRATE_P"]
    told = []
    for _ in range(70):
        told.append(give(AUTOTUNE, 1))
        if told[-1] == (IN_PROGRESS, 95):
            break
        bench.run(1.0)
    assert [progress for n, (_, progress) in enumerate(told) if told[n - 1] != told[n]] == [0, 20, 40, 60, 95]
    assert autopilot.topics.vehicle_local_position.z == pytest.approx(-20.0, abs=2.0)
    assert autopilot.parameters["MC_ROLLRATE_P"] == before
    assert give(ARM_DISARM, 0, 21196) == (ACCEPTED, 0)
    bench.run(0.5)
    assert give(AUTOTUNE, 1) == (ACCEPTED, 100)
    for axis in ("ROLL", "PITCH", "YAW"):
        assert 0.1 < autopilot.parameters[f"MC_{axis}RATE_P"] < 0.3
        assert 4.0 < autopilot.parameters[f"MC_{axis}_P"] < 6.6
    assert autopilot.parameters["MC_ROLLRATE_P"] != before
