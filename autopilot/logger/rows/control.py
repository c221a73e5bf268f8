"""From set-points to actuators (topics/control.py)."""

import math
from collections.abc import Sequence

from sitl_emu.autopilot.control.mixer import OUTPUTS, PWM_DISARMED, all_pulses
from sitl_emu.autopilot.logger.packing import FORMATS, Pack, Row, by_name, row
from sitl_emu.autopilot.logger.ulog import array_length
from sitl_emu.autopilot.topics import (
    ActuatorControlsStatus,
    ActuatorOutputs,
    ActuatorTest,
    AutotuneAttitudeControlStatus,
    CollisionConstraints,
    ControlAllocatorStatus,
    HoverThrustEstimate,
    LandingGear,
    OffboardSetpoint,
    RateCtrlStatus,
    TakeoffStatus,
    TrajectorySetpoint,
    VehicleAttitudeSetpoint,
    VehicleConstraints,
    VehicleLocalPositionSetpoint,
    VehicleRatesSetpoint,
    VehicleThrustSetpoint,
    VehicleTorqueSetpoint,
)

NAN = math.nan
RELEASE, CONTROL = 0, 1
"""actuator_test ACTION."""


@row("trajectory_setpoint")
def trajectory_setpoint(pack: Pack, record: TrajectorySetpoint) -> bytes:
    """What the flight mode wants."""
    time_us, position, velocity, acceleration, yaw, yawspeed, jerk = record
    return pack(time_us, *position, *velocity, *acceleration, *jerk, yaw, yawspeed)


@row("vehicle_attitude_setpoint")
def vehicle_attitude_setpoint(pack: Pack, record: VehicleAttitudeSetpoint) -> bytes:
    """What attitude control tracks."""
    time_us, q_d, yaw_rate, thrust = record
    return pack(time_us, yaw_rate, *q_d, *thrust)


@row("vehicle_rates_setpoint")
def vehicle_rates_setpoint(pack: Pack, record: VehicleRatesSetpoint) -> bytes:
    """What rate control tracks."""
    time_us, rates, thrust = record
    return pack(time_us, *rates, *thrust, False)


@row("vehicle_thrust_setpoint")
def vehicle_thrust_setpoint(pack: Pack, record: VehicleThrustSetpoint) -> bytes:
    """What the allocation is asked for, along the body's axes."""
    return pack(record.timestamp, record.timestamp, *record.xyz)


@row("vehicle_torque_setpoint")
def vehicle_torque_setpoint(pack: Pack, record: VehicleTorqueSetpoint) -> bytes:
    """What the allocation is asked for, about the body's axes."""
    return pack(record.timestamp, record.timestamp, *record.xyz)


def actuators(
    topic: str,
    functions: Sequence[int],
    first: int,
    tail: tuple[int, ...] = (),
    thrust_model_factor: float = 0.0,
    unused: float = NAN,
) -> Row:
    """A row of the outputs that carry the functions from `first` on; `unused` where there is none, and NaN of one that
    stands still while others don't: it was told to, by that.

    `thrust_model_factor`: THR_MDL_FAC. PX4 logs what its allocator asks of a motor, and its outputs have the curve
    (FunctionMotors::updateValues in src/lib/mixer_module, v1.18); ours have it in `actuator_outputs`, so it is undone.
    """
    (length,) = (array_length(kind)[1] for kind, name in FORMATS[topic] if name == "control")
    channels = [functions.index(first + n) if first + n in functions else -1 for n in range(length)]
    while channels and channels[-1] < 0:
        channels.pop()
    rest = (unused,) * (length - len(channels)) + tail

    @row(topic)
    def actuator_controls(pack: Pack, record: ActuatorOutputs) -> bytes:
        controls, pulses = record.controls, record.pwm
        values = [controls[n] if 0 <= n < len(controls) else unused for n in channels]
        if PWM_DISARMED in pulses and not record.test_mode and any(pulse != PWM_DISARMED for pulse in pulses):
            values = [
                NAN if 0 <= n < len(pulses) and pulses[n] == PWM_DISARMED else value
                for n, value in zip(channels, values, strict=True)
            ]
        if thrust_model_factor:
            linear = 1.0 - thrust_model_factor
            values = [thrust_model_factor * value * abs(value) + linear * value for value in values]
        return pack(record.timestamp, record.timestamp, *values, *rest)

    return actuator_controls


@row("actuator_outputs")
def actuator_outputs(pack: Pack, record: ActuatorOutputs) -> bytes:
    """Microseconds of each output."""
    return pack(record.timestamp, OUTPUTS, *all_pulses(record))


@row("offboard_control_mode")
def offboard_control_mode(pack: Pack, record: OffboardSetpoint) -> bytes:
    """What an offboard setpoint sets."""
    trajectory = record.trajectory

    def given(vector: tuple[float, float, float] | None) -> bool:
        return vector is not None and any(math.isfinite(value) for value in vector)

    return pack(
        record.timestamp,
        given(trajectory and trajectory.position),
        given(trajectory and trajectory.velocity),
        given(trajectory and trajectory.acceleration),
        record.attitude is not None or (trajectory is not None and math.isfinite(trajectory.yaw)),
        record.rates is not None or (trajectory is not None and math.isfinite(trajectory.yawspeed)),
        record.thrust_and_torque is not None,
        record.direct_actuator is not None,
    )


actuator_controls_status_0 = by_name("actuator_controls_status_0", ActuatorControlsStatus)
rate_ctrl_status = by_name("rate_ctrl_status", RateCtrlStatus)
control_allocator_status = by_name("control_allocator_status", ControlAllocatorStatus)
vehicle_constraints = by_name("vehicle_constraints", VehicleConstraints, {"timestamp": 0})


@row("actuator_test")
def actuator_test(pack: Pack, record: ActuatorTest) -> bytes:
    """What an output is told by itself."""
    timeout_ms = record.timeout_us // 1000
    return pack(record.timestamp, record.value, timeout_ms, record.function, CONTROL if timeout_ms else RELEASE)


collision_constraints = by_name("collision_constraints", CollisionConstraints)
autotune_attitude_control_status = by_name(
    "autotune_attitude_control_status", AutotuneAttitudeControlStatus, {"kff": 0}
)
landing_gear = by_name("landing_gear", LandingGear)
vehicle_local_position_setpoint = by_name("vehicle_local_position_setpoint", VehicleLocalPositionSetpoint)
takeoff_status = by_name("takeoff_status", TakeoffStatus, {"takeoff_state": "state"})
hover_thrust_estimate = by_name("hover_thrust_estimate", HoverThrustEstimate, {"timestamp_sample": "timestamp"})
