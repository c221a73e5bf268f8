"""From torque and thrust of a multicopter to its outputs, or to those that somebody else asks for.

What PX4's control_allocator and its mixer library do around their maths (src/modules/control_allocator,
src/lib/mixer_module, v1.18): the rotors of CA_ROTORn_*, the outputs of PWM_MAIN_FUNCn, actuators that are tried out,
and motors that stop because a failure of theirs is injected, where CA_FAILURE_MODE handles failures. Such a motor stays
in the allocation: the others get what they got before, and nobody knows what is missing.

Left out: a motor that fails by itself and is taken out of the allocation. PX4 finds it by its controller's current,
which SIH tells none of.
"""

import math
from typing import Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.control.actuator_group_test import ActuatorGroupTest
from sitl_emu.autopilot.control.actuator_test import ActuatorTests
from sitl_emu.autopilot.control.control_allocator import ACHIEVED, ControlAllocator, rotors_of, saturation
from sitl_emu.autopilot.control.mixer import (
    CENTRED_PWM,
    CENTRED_PWM_RANGE,
    FIRST_MOTOR,
    MOTOR_PWM_MIN,
    MOTOR_PWM_RANGE,
    OUTPUTS,
    PWM_DISARMED,
    direct_outputs,
    is_motor,
    is_servo,
    mirrored,
    turns_both_ways,
)
from sitl_emu.autopilot.control.peripherals import carried, last_used, with_peripherals
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    ActuatorOutputs,
    ControlAllocatorStatus,
    DirectActuator,
    Topics,
    Vector3,
)

PSEUDO_INVERSE: Final = 0
"""CA_METHOD; Automatic is sequential desaturation for a multicopter (getDesiredAllocationMethod)."""
LEAST_DT_S: Final = 0.0002
MOST_DT_S: Final = 0.02
"""ControlAllocator::Run takes no other time to have passed."""


class MulticopterAllocation:
    """Writer of control_allocator_status and actuator_outputs."""

    def __init__(self, topics: Topics, parameters: Parameters, texts: Texts) -> None:
        """`texts`: what goes into the log."""
        self._topics, self._parameters, self._texts = topics, parameters, texts
        self._tests = ActuatorTests(topics)
        self.group_test = ActuatorGroupTest(topics, parameters, texts)
        self._allocator = ControlAllocator([], 0.0)
        self._allocated_us = 0
        self._stop_mask = 0
        """Bit per motor that a failure stops; it stays while CA_FAILURE_MODE is 0."""
        self._stopped_by_thrust = False
        """The thrust that is asked for is no number: all stop (stopMotorsBasedOnThrustSetpoint)."""
        self.refresh()

    def refresh(self) -> None:
        """Copy the parameters: they have changed."""
        parameters = self._parameters
        rotors = rotors_of(parameters)
        count = len(rotors)
        slew_s = tuple(float(parameters[f"CA_R{n}_SLEW"]) for n in range(count))
        factor, air_mode = float(parameters["THR_MDL_FAC"]), int(parameters["MC_AIRMODE"])
        turning = self._allocator.thrusts
        desaturates = int(parameters["CA_METHOD"]) != PSEUDO_INVERSE
        self._reversible_flags = flags = int(parameters["CA_R_REV"]) & (1 << count) - 1
        self._allocator = ControlAllocator(rotors, factor, air_mode, slew_s, flags, desaturates=desaturates)
        if len(turning) == count:
            self._allocator.thrusts = turning
        functions = [int(parameters[f"PWM_MAIN_FUNC{n}"]) for n in range(1, OUTPUTS + 1)]
        self._channels = output_channels(functions)
        self._functions = functions[: len(self._channels)]
        self._straight = self._channels == list(range(count))
        self._reversed = int(parameters["PWM_MAIN_REV"])
        self._peripherals = any(map(carried, self._functions))
        self._handles_failures = int(parameters["CA_FAILURE_MODE"]) > 0
        self._motors = count
        self._note_motors_off()
        self._stopped = (0.0,) * len(self._channels)
        self._stopped_pwm = (PWM_DISARMED,) * len(self._channels)

    def check_for_motor_failures(self) -> None:
        """The failure detector tells which motors stop; without CA_FAILURE_MODE nobody listens."""
        mask = self._topics.failure_detector_status.motor_stop_mask
        if self._handles_failures and mask != self._stop_mask:
            self._stop_mask = mask
            self._texts.note(Severity.WARNING, f"[control_allocator] Stopping motors ({mask})")
            self._note_motors_off()

    def _note_motors_off(self) -> None:
        self._motors_off = [n for n in range(self._motors) if self._stopped_by_thrust or self._stop_mask >> n & 1]
        self._outputs_off = [place for place, motor in enumerate(self._channels) if motor in self._motors_off]

    @property
    def unallocated(self) -> Vector3:
        """Torque that the last call could not give; NaN while a motor is off."""
        return NAN3 if self._motors_off else self._allocator.unallocated

    @property
    def unallocated_thrust(self) -> float:
        """Thrust along body z that it could not give; NaN while a motor is off."""
        return NAN if self._motors_off else self._allocator.unallocated_thrust

    def allocate(self, now_us: int, torque: Vector3, thrust: float, *, told: bool, status_told: bool) -> None:
        """From torque and thrust to the outputs; `told`: with their pulses, `status_told`: with the allocator's status,
        for those who look on."""
        topics, allocator = self._topics, self._allocator
        if not topics.actuator_armed.armed and not status_told:
            self._rest(now_us)  # nobody sees what would be allocated
            return
        roll, pitch, yaw = torque
        if self.group_test.test is not None:
            roll, pitch, yaw, thrust = self.group_test.applied(roll, pitch, yaw, thrust)
        stops = not math.isfinite(thrust)
        if stops != self._stopped_by_thrust:
            self._stopped_by_thrust = stops
            self._note_motors_off()
        if stops:
            thrust = 0.0
        dt_s = max(LEAST_DT_S, min(MOST_DT_S, (now_us - self._allocated_us) * 1e-6))
        self._allocated_us = now_us
        motors = allocator.allocate(roll, pitch, yaw, thrust, dt_s)
        if not math.isfinite(sum(motors)):
            motors = tuple([value if math.isfinite(value) else 0.0 for value in motors])  # as PX4's mixer: off
        if self._motors_off:
            motors = tuple([0.0 if n in self._motors_off else value for n, value in enumerate(motors)])
        controls = motors
        if not self._straight:
            controls = tuple([motors[n] if 0 <= n < len(motors) else 0.0 for n in self._channels])
        pwm = topics.actuator_outputs.pwm
        if told or self._reversed:
            pwm = tuple([MOTOR_PWM_MIN + MOTOR_PWM_RANGE * value for value in controls])
            if self._reversible_flags:
                pwm = self._centred(controls, pwm)
            if self._outputs_off:
                pwm = tuple([PWM_DISARMED if n in self._outputs_off else pulse for n, pulse in enumerate(pwm)])
        if status_told:
            topics.control_allocator_status = self._status(now_us)
        if self._rests:
            self._rest(now_us)
            return
        outputs = ActuatorOutputs(now_us, controls, pwm)
        if self._peripherals:
            outputs = with_peripherals(topics, self._functions, outputs)
        topics.actuator_outputs = self._mirrored(outputs) if self._reversed else outputs

    def _centred(self, controls: tuple[float, ...], pwm: tuple[float, ...]) -> tuple[float, ...]:
        """The pulses, those of motors that turn both ways about the middle (FunctionMotors::updateValues)."""
        flags = self._reversible_flags
        both_ways = [turns_both_ways(function, flags) for function in self._functions]
        return tuple(
            [
                CENTRED_PWM + CENTRED_PWM_RANGE * value if centred else pulse
                for value, pulse, centred in zip(controls, pwm, both_ways, strict=True)
            ]
        )

    def _status(self, now_us: int) -> ControlAllocatorStatus:
        x, y, z = torque = self.unallocated
        thrust = self.unallocated_thrust
        thrusts = [NAN if n in self._motors_off else value for n, value in enumerate(self._allocator.thrusts)]
        return ControlAllocatorStatus(
            now_us,
            torque,
            NAN3 if self._motors_off else (0.0, 0.0, thrust),
            x * x + y * y + z * z < ACHIEVED,
            thrust * thrust < ACHIEVED,
            saturation(thrusts, self._reversible_flags),
            0,
            self._stop_mask,
            self.group_test.test is not None,
        )

    def obey(self, now_us: int, told: DirectActuator) -> None:
        """Outputs as ROS 2 tells them: nothing is allocated."""
        if self._rests:
            self._rest(now_us)
            return
        outputs = direct_outputs(now_us, self._functions, told, self._allocator.signal)
        self._topics.actuator_outputs = self._mirrored(with_peripherals(self._topics, self._functions, outputs))

    @property
    def _rests(self) -> bool:
        """No output is to move (MixingOutput::update)."""
        actuators = self._topics.actuator_armed
        return not actuators.armed or actuators.kill or actuators.lockdown

    def _rest(self, now_us: int) -> None:
        """All outputs to their disarmed values but those that are tried out."""
        actuators = self._topics.actuator_armed
        if not actuators.armed:
            self._allocator.rest()
            if self._tests.due:
                self._test(now_us, held=actuators.kill)
                return
        self._topics.actuator_outputs = ActuatorOutputs(now_us, self._stopped, self._stopped_pwm)

    def _test(self, now_us: int, *, held: bool) -> None:
        """Disarmed, and some actuators are tried out; `held`: it is killed, none moves."""
        ended = not self._tests.update(now_us, self._functions)
        if ended:
            self._tests.stop()
        if ended or held:
            self._topics.actuator_outputs = ActuatorOutputs(now_us, self._stopped, self._stopped_pwm, test_mode=True)
            return
        outputs = [
            self._tests.outputs(function, self._allocator.signal, self._reversible_flags)
            for function in self._functions
        ]
        controls, pwm = zip(*outputs, strict=True)
        self._topics.actuator_outputs = self._mirrored(ActuatorOutputs(now_us, controls, pwm, test_mode=True))

    def _mirrored(self, outputs: ActuatorOutputs) -> ActuatorOutputs:
        return mirrored(outputs, self._functions, self._reversed, reversible_flags=self._reversible_flags)


def output_channels(functions: list[int]) -> list[int]:
    """Which motor (0-based; -1 none) each output carries, up to the last that carries something: PWM_MAIN_FUNCn."""
    motors = [function - FIRST_MOTOR if is_motor(function) else -1 for function in functions]
    return motors[: last_used(functions, [is_motor(function) or is_servo(function) for function in functions])]
