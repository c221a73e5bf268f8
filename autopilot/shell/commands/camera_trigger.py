"""camera_trigger: how it triggers (PX4: drivers/camera_trigger, which reads its arguments itself)."""

from collections.abc import Sequence

from sitl_emu.autopilot.payload.camera_trigger import TIME_ALWAYS, TIME_ON_COMMAND
from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, info, usage, warning

NAME = "camera_trigger"
COMMANDS = (("status", "how it triggers"),)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`camera_trigger status`."""
    trigger = vehicle.camera_trigger
    if arguments and trigger is None:
        yield warning(NAME, "not running")
        return FAILURE
    if trigger is None or list(arguments[:1]) != ["status"]:
        yield usage(NAME, COMMANDS)
        return FAILURE
    yield info(NAME, f"trigger enabled : {'enabled' if trigger.enabled else 'disabled'}")
    yield info(NAME, f"trigger paused : {'paused' if trigger.paused else 'active'}")
    yield info(NAME, f"mode : {trigger.mode}")
    if trigger.mode in (TIME_ON_COMMAND, TIME_ALWAYS):
        yield info(NAME, f"interval : {trigger.interval_ms:.2f} [ms]")
    else:
        yield info(NAME, f"distance : {trigger.distance_m:.2f} [m]")
    yield info(NAME, f"activation time : {vehicle.parameters['TRIG_ACT_TIME']:.2f} [ms]")
    return SUCCESS
