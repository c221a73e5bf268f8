"""pwm_out_sim: which function each output has, and what it carries (PX4: modules/simulation/pwm_out_sim)."""

from collections.abc import Sequence

from sitl_emu.autopilot.control.mixer import PWM_DISARMED, all_pulses
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command

NAME = "pwm_out_sim"
PWM_FAILSAFE, PWM_MIN, PWM_MAX, CENTRE = 600, 1000, 2000, 0
"""PWMSim.hpp; a centre of its own no output has."""
SHOWN = "{} events, {}0.00us avg, min 0us max 0us 0.000us rms\n"
"""Of counters: in lockstep no time passes while PX4 computes."""
TICK_US = 4_000
"""A multicopter's outputs are made anew with each sample of the gyroscope; a rover's are not counted."""


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`pwm_out_sim status`."""
    if list(arguments) != ["status"]:
        return (yield from default_command(NAME, True, arguments))
    flies = "mc_rate_control" in vehicle.topics.vehicle_status.vehicle_kind.traits.modules
    made = vehicle.now_us // TICK_US if flies else 0
    yield f"{NAME}: cycle: {SHOWN.format(0, '0us elapsed, ')}"
    yield f"{NAME}: interval: {SHOWN.format(0, '')}"
    yield info("mixer_module", "Param prefix: PWM_MAIN")
    yield f"control latency: {SHOWN.format(made, '0us elapsed, ')}"
    yield info("mixer_module", "Switched to rate_ctrl work queue")
    yield "Channel Configuration:\n"
    for channel, value in enumerate(all_pulses(vehicle.topics.actuator_outputs)):
        function = int(vehicle.parameters[f"PWM_MAIN_FUNC{channel + 1}"])
        yield (
            f"Channel {channel:2d}: func: {function:3d}, value: {value:.2f}, failsafe: {PWM_FAILSAFE:.2f}, "
            f"disarmed: {PWM_DISARMED:.0f}, min: {PWM_MIN}, max: {PWM_MAX}, center: {CENTRE}\n"
        )
    return SUCCESS
