"""Autotuning of a multicopter's rate and attitude gains, on DO_AUTOTUNE_ENABLE.

PX4's mc_autotune_attitude_control (v1.18), which MC_AT_EN starts: one axis after the other is shaken by steps of its
rate setpoint (MC_AT_SYSID_AMP) until a model of it has settled, and gains that look sane are taken over when the
vehicle has been disarmed (MC_AT_APPLY 1), at once and tried out (2), or not at all (0). Sticks, another mode and 20
seconds without progress end it. The command starts it, and is answered by how far it has come each time it is sent, as
PX4's MAVLink receiver does: what ground stations do once a second.
"""

import math
from enum import IntEnum, auto
from typing import ClassVar, Final

from sitl_emu.autopilot.commands.table import Owner, commands_of
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, obey_navigator
from sitl_emu.autopilot.constants import NavState, Severity
from sitl_emu.autopilot.control.system_identification import (
    COEFFICIENTS,
    FIRST_VARIANCE,
    PidGains,
    SystemIdentification,
    pid_gains,
)
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import AutotuneAttitudeControlStatus, Topics, Vector3, VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import quotient

TICK_S: Final = 0.004
STEP_US: Final = 100_000
"""Between two steps of the state machine, and of the signal."""
FILTERS_US: Final = 4_000_000
"""PX4 measures its loop's rate over 1000 samples before, once since its start (checkFilters)."""
LEAST_AXIS_US: Final = 5_000_000
PAUSE_US: Final = 2_000_000
TEST_US: Final = 4_000_000
RESULT_US: Final = 2_000_000
TEST_SETTLES_US: Final = 1_000_000
TIMEOUT_US: Final = 20_000_000
SETTLED_VARIANCE: Final = 50.0
MODEL_S = (0.002, 0.010)
SIGNAL_ALPHA: Final = 1.0 / 3.0
"""A low-pass of 0.2 s at the signal's 0.1 s takes its mean away."""
FIRST_STEP: Final = 5
LONGEST_STEP: Final = 10
LONGEST_STEP_LATER: Final = 5
YAW_RISE_S: Final = 0.2
DETUNING: Final = 0.7
STICKS_MOVED: Final = 0.05
MOST_CONTROL_POWER: Final = 0.1
AXES = ("ROLL", "PITCH", "YAW")
NO_MODEL = (0.0,) * COEFFICIENTS
NO_MODEL_VARIANCES = (FIRST_VARIANCE,) * COEFFICIENTS
NO_RATES = (0.0, 0.0, 0.0)
NO_FILTERED = (0.0, 0.0)
ON_DISARM: Final = 1
AT_ONCE: Final = 2
"""MC_AT_APPLY."""


class State(IntEnum):
    """How far it is, in the order of going on: what TOLD tells, as far as a multicopter has it."""

    IDLE = 0
    INIT = auto()
    ROLL = auto()
    ROLL_PAUSE = auto()
    PITCH = auto()
    PITCH_PAUSE = auto()
    YAW = auto()
    YAW_PAUSE = auto()
    VERIFICATION = auto()
    APPLY = auto()
    TEST = auto()
    WAIT_FOR_DISARM = auto()
    COMPLETE = auto()
    FAIL = auto()


SHAKES = {State.ROLL: 0, State.PITCH: 1, State.YAW: 2}
PROGRESS = {
    State.ROLL: 20,
    State.ROLL_PAUSE: 20,
    State.PITCH: 40,
    State.PITCH_PAUSE: 40,
    State.YAW: 60,
    State.YAW_PAUSE: 60,
    State.VERIFICATION: 80,
    State.APPLY: 85,
    State.TEST: 90,
    State.WAIT_FOR_DISARM: 95,
    State.COMPLETE: 100,
}
"""Percent, in COMMAND_ACK; 0 for all others."""
TOLD = {
    State.IDLE: 0,
    State.INIT: 1,
    State.ROLL: 3,
    State.ROLL_PAUSE: 4,
    State.PITCH: 6,
    State.PITCH_PAUSE: 7,
    State.YAW: 9,
    State.YAW_PAUSE: 10,
    State.VERIFICATION: 11,
    State.APPLY: 12,
    State.TEST: 13,
    State.COMPLETE: 14,
    State.FAIL: 15,
    State.WAIT_FOR_DISARM: 16,
}
"""autotune_attitude_control_status STATE."""
UNKNOWN_MODEL_S: Final = 0.01
"""dt_model before the filters are known (_model_update_scaler and _filter_dt at the start)."""
RESULTS = {State.COMPLETE: mavlink.MAV_RESULT_ACCEPTED, State.FAIL: mavlink.MAV_RESULT_FAILED}


class McAutotune:
    """Owner of DO_AUTOTUNE_ENABLE, writer of autotune_attitude_control_status; adds to the rate setpoint, and sets the
    gains in the end."""

    COMMANDS: ClassVar[frozenset[int]] = commands_of(Owner.AUTOTUNE)

    def __init__(self, topics: Topics, parameters: Parameters, say: Say) -> None:
        self._topics, self._parameters, self._say = topics, parameters, say
        self._runs = int(parameters["MC_AT_EN"]) == 1
        self._wanted = False
        self.state = State.IDLE
        self._since_us = self._step_us = 0
        self._mode = NavState.AUTO_LOITER
        self._model: SystemIdentification | None = None
        self._model_s, self._fit_every, self._samples = UNKNOWN_MODEL_S, 1, 0
        self._scale = 1.0
        self._gains: list[tuple[PidGains, float]] = []
        self._high, self._steps, self._longest, self._mean = False, 0, 0, 0.0
        self.rates: Vector3 | None = None
        """What is added to the rate setpoint; None while nothing is."""
        self._before: dict[str, float] = {}
        self._commands_seen = 0

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult:
        """param1 1: begin, or say how far it is; param2 would be axes, which cannot be chosen.

        A number that is none is neither 1 nor another one (MavlinkReceiver::handle_message_command_both).
        """
        begins = abs(command.param1 - 1.0) < 1e-6 and abs(command.param2) < 1e-6
        if self.state is State.IDLE or not command.from_external:
            self._tell_what_is_not_supported(command)
        if self._runs and begins and self.state is State.IDLE:
            self._wanted = True
        if begins:
            result = RESULTS.get(self.state, mavlink.MAV_RESULT_IN_PROGRESS)
            return CommandResult(result, PROGRESS.get(self.state, 0))
        if abs(command.param1 - 1.0) > 1e-6 or abs(command.param2) > 1e-6:
            return CommandResult(mavlink.MAV_RESULT_DENIED)
        return CommandResult(mavlink.MAV_RESULT_UNSUPPORTED)

    def _tell_what_is_not_supported(self, command: VehicleCommand) -> None:
        """Of a command from a link PX4's navigator, which says so, hears only while nothing is being tuned."""
        if abs(command.param1 - 1.0) > 1e-6:
            self._say(Severity.WARNING, "", "navigator_autotune_unsupported_input")
        elif abs(command.param2) > 1e-6:
            self._say(Severity.WARNING, "", "navigator_autotune_unsupported_ax")

    def update(self, now_us: int) -> None:
        """At 50 Hz: what a mission commands, and every 0.1 s a step."""
        self._commands_seen = obey_navigator(self, now_us, self._topics, self._commands_seen)
        if (self._wanted or self.state is not State.IDLE) and now_us - self._step_us >= STEP_US:
            self._step_us = now_us
            self._advance(now_us)
            self._abort(now_us)
            self.rates = self._signal()
            self._publish(now_us)

    def on_torque(self, torque: Vector3, rates: Vector3) -> None:
        """After each rate control, while `rates` is not None."""
        axis = SHAKES.get(self.state)
        if axis is not None and self._model is not None:
            self._model.sample(self._scale * torque[axis], rates[axis])
            self._samples += 1
            if self._samples % self._fit_every == 0:
                self._model.fit()

    # --- the state machine ----------------------------------------------------------------------------------

    def _enter(self, now_us: int, state: State) -> None:
        self.state, self._since_us = state, now_us

    def _advance(self, now_us: int) -> None:
        state, for_us = self.state, now_us - self._since_us
        if state is State.IDLE:
            self._mode = self._topics.vehicle_status.nav_state
            self._gains = []
            self._before = {}
            self._enter(now_us, State.INIT)
        elif state is State.INIT:
            if self._model is None and for_us >= FILTERS_US:
                self._model = self._new_model()
            if self._model is not None:
                self._shake(now_us, State.ROLL)
        elif state in SHAKES:
            if self._settled and for_us > LEAST_AXIS_US:
                rise_s = YAW_RISE_S if state is State.YAW else float(self._parameters["MC_AT_RISE_TIME"])
                self._gains.append(self._design(rise_s))
                self._enter(now_us, State(state + 1))
        elif state in (State.ROLL_PAUSE, State.PITCH_PAUSE):
            if for_us > PAUSE_US:
                self._shake(now_us, State(state + 1))
        elif state is State.YAW_PAUSE:
            if for_us > PAUSE_US:
                self._enter(now_us, State.VERIFICATION)
        elif state is State.VERIFICATION:
            self._enter(now_us, State.APPLY if all(map(_good, self._gains)) else State.FAIL)
        elif state is State.APPLY:
            self._apply(now_us)
        elif state is State.WAIT_FOR_DISARM:
            if not self._topics.vehicle_status.armed:
                self._save(self._designed())
                self._enter(now_us, State.COMPLETE)
        elif state is State.TEST:
            if for_us > TEST_US:
                self._enter(now_us, State.COMPLETE)
            elif for_us > TEST_SETTLES_US and self._control_power > MOST_CONTROL_POWER:
                self._save(self._before)
                self._enter(now_us, State.FAIL)
        elif for_us > RESULT_US:
            self._enter(now_us, State.IDLE)
            self._wanted = False

    def _abort(self, now_us: int) -> None:
        """In case of a time-out, of moved sticks, or of another mode."""
        if self.state in (State.IDLE, State.WAIT_FOR_DISARM):
            return
        sticks, mode = self._topics.manual_control_setpoint, self._topics.vehicle_status.nav_state
        moved = abs(sticks.roll) > STICKS_MOVED or abs(sticks.pitch) > STICKS_MOVED
        if moved or mode is not self._mode or now_us - self._since_us > TIMEOUT_US:
            self._mode = mode
            self._enter(now_us, State.FAIL)

    def _apply(self, now_us: int) -> None:
        how = int(self._parameters["MC_AT_APPLY"])
        if how == ON_DISARM:
            self._enter(now_us, State.WAIT_FOR_DISARM)
        elif how == AT_ONCE:
            gains = self._designed()
            self._before = {name: float(self._parameters[name]) for name in gains}
            self._save(gains)
            self._begin_signal()
            self._enter(now_us, State.TEST)
        else:
            self._enter(now_us, State.COMPLETE)

    # --- model and gains ------------------------------------------------------------------------------------

    def _new_model(self) -> SystemIdentification:
        cutoff_hz = float(self._parameters["IMU_GYRO_CUTOFF"])
        shortest_s, longest_s = MODEL_S
        model_s = max(shortest_s, min(longest_s, max(quotient(0.5, cutoff_hz), TICK_S)))
        self._fit_every = max(int(model_s / TICK_S), 1)
        self._model_s = self._fit_every * TICK_S
        return SystemIdentification(TICK_S, self._model_s, cutoff_hz)

    def _shake(self, now_us: int, state: State) -> None:
        assert self._model is not None
        self._model.reset()
        axis = AXES[SHAKES[state]]
        present = float(self._parameters[f"MC_{axis}RATE_P"]) * float(self._parameters[f"MC_{axis}RATE_K"])
        self._scale = 1.0 / present if present else 0.0
        self._begin_signal()
        self._enter(now_us, state)

    @property
    def _settled(self) -> bool:
        return self._model is not None and max(self._model.variances) < SETTLED_VARIANCE

    def _design(self, rise_s: float) -> tuple[PidGains, float]:
        """Gains of the rate control and of the attitude control, by what the model is now."""
        gains = pid_gains(list(self._coefficients), self._model_s, rise_s, DETUNING)
        if -0.001 < gains.d < 0.0:
            gains = gains._replace(d=0.0)
        attitude = quotient(1.0, math.radians(60.0) * gains.k)
        return gains, max(2.0, min(6.5, attitude))

    @property
    def _coefficients(self) -> tuple[float, ...]:
        """Of the model, for torques as they are."""
        if self._model is None:
            return NO_MODEL
        a1, a2, *b = self._model.coefficients
        return a1, a2, *(self._scale * each for each in b)

    def _publish(self, now_us: int) -> None:
        model, yaws = self._model, self.state in (State.YAW, State.YAW_PAUSE)
        gains, attitude = self._design(YAW_RISE_S if yaws else float(self._parameters["MC_AT_RISE_TIME"]))
        self._topics.autotune_attitude_control_status = AutotuneAttitudeControlStatus(
            now_us,
            self._coefficients,
            NO_MODEL_VARIANCES if model is None else model.variances,
            0.0 if model is None else model.fitness,
            0.0 if model is None else model.innovation,
            self._model_s,
            *gains,
            attitude,
            NO_RATES if self.rates is None else self.rates,
            *(NO_FILTERED if model is None else model.filtered),
            TOLD[self.state],
        )

    def _designed(self) -> dict[str, float]:
        """The parameters, in parallel form."""
        values: dict[str, float] = {}
        for axis, (gains, attitude) in zip(AXES, self._gains, strict=True):
            rate = f"MC_{axis}RATE"
            values |= {f"{rate}_P": gains.k, f"{rate}_K": 1.0, f"{rate}_I": gains.k * gains.i}
            values |= {f"{rate}_D": gains.k * gains.d, f"MC_{axis}_P": attitude}
        return values

    def _save(self, values: dict[str, float]) -> None:
        for name, value in values.items():
            self._parameters.set(name, value)

    # --- the signal -----------------------------------------------------------------------------------------

    def _begin_signal(self) -> None:
        self._high, self._steps, self._longest, self._mean = True, FIRST_STEP, LONGEST_STEP, 0.0

    def _signal(self) -> Vector3 | None:
        """Steps of a length that changes, around zero; None where nothing is to be shaken."""
        axis = SHAKES.get(self.state)
        if axis is None and self.state is not State.TEST:
            return None
        if self._steps > self._longest:
            self._high, self._steps = not self._high, 0
            self._longest = self._longest - 1 if self._longest > 1 else LONGEST_STEP_LATER
        self._steps += 1
        step = float(self._parameters["MC_AT_SYSID_AMP"]) if self._high else 0.0
        signal = step - self._mean
        self._mean += SIGNAL_ALPHA * (step - self._mean)
        if axis is None:
            return signal, signal, 0.0
        return (signal if axis == 0 else 0.0, signal if axis == 1 else 0.0, signal if axis == 2 else 0.0)

    @property
    def _control_power(self) -> float:
        """Of all axes, as the length of a vector."""
        return math.hypot(*self._topics.actuator_controls_status.control_power)


def _good(designed: tuple[PidGains, float]) -> bool:
    """Gains that PX4 would take over."""
    (k, i, d), attitude = designed
    return 0.0 < k < 0.5 and 0.0 < i < 10.0 and 0.0 <= d < 0.1 and 0.0 < attitude < 12.0
