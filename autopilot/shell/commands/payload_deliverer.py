"""payload_deliverer: opens and closes the gripper (PX4: modules/payload_deliverer)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, WAIT, Output, Vehicle, info, usage, warning
from sitl_emu.autopilot.shell.commands.module import COMMANDS, HELP, default_command
from sitl_emu.autopilot.shell.vehicle_command import send
from sitl_emu.core import dialect as mavlink

NAME = "payload_deliverer"
NO_GRIPPER = -1
"""PD_GRIPPER_TYPE."""
ANY_GRIPPER = 0.0
TEST_US = 5_000_000
"""gripper_test closes it again after so long."""
GRIPPER_COMMANDS = (
    ("gripper_test", "open it and close it again"),
    ("gripper_open", ""),
    ("gripper_close", ""),
)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`payload_deliverer status`, `gripper_open`, `gripper_close` or `gripper_test`."""
    command = arguments[0] if arguments else ""
    has_gripper = vehicle.parameters["PD_GRIPPER_TYPE"] != NO_GRIPPER
    if command == "status":
        yield info(NAME, f"Gripper valid: {has_gripper}")
        return SUCCESS
    if command in ("start", "stop"):
        return (yield from default_command(NAME, True, arguments))
    if command not in dict(GRIPPER_COMMANDS):
        if command not in HELP:
            yield warning(NAME, "Unrecognized command\n")
        yield usage(NAME, (*COMMANDS, *GRIPPER_COMMANDS))
        return SUCCESS
    if not has_gripper:
        yield info(NAME, "Gripper is not initialized correctly!")
        return SUCCESS
    if command == "gripper_test":
        yield info(NAME, "Test: Opening the Gripper!")
    if command != "gripper_close":
        send(vehicle, mavlink.MAV_CMD_DO_GRIPPER, ANY_GRIPPER, float(mavlink.GRIPPER_ACTION_RELEASE))
    if command == "gripper_test":
        end_us = vehicle.now_us + TEST_US
        while vehicle.now_us < end_us:
            yield WAIT
        yield info(NAME, "Test: Closing the Gripper!")
    if command != "gripper_open":
        send(vehicle, mavlink.MAV_CMD_DO_GRIPPER, ANY_GRIPPER, float(mavlink.GRIPPER_ACTION_GRAB))
    return SUCCESS
