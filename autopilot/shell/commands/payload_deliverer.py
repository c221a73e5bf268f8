"""payload_deliverer: opens and closes the gripper (PX4: modules/payload_deliverer)."""

from collections.abc import Sequence

from sitl_emu.autopilot.payload.payload_deliverer import GRAB, RELEASE
from sitl_emu.autopilot.shell.command import SUCCESS, WAIT, Output, Vehicle, info, usage, warning
from sitl_emu.autopilot.shell.commands.module import COMMANDS, HELP, default_command

NAME = "payload_deliverer"
NO_GRIPPER = -1
"""PD_GRIPPER_TYPE."""
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
        if has_gripper:
            yield info(NAME, f"Gripper state: {vehicle.payload_deliverer.state}")
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
        vehicle.payload_deliverer.command_itself(vehicle.now_us, RELEASE)
    if command == "gripper_test":
        end_us = vehicle.now_us + TEST_US
        while vehicle.now_us < end_us:
            yield WAIT
        yield info(NAME, "Test: Closing the Gripper!")
    if command != "gripper_open":
        vehicle.payload_deliverer.command_itself(vehicle.now_us, GRAB)
    return SUCCESS
