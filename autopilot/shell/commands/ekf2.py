"""ekf2: what the estimator knows (PX4: modules/ekf2)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle
from sitl_emu.autopilot.shell.commands.module import default_command

TILT_ALIGN = 1
"""Bit of estimator_status.control_mode_flags."""


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`ekf2 status`."""
    if list(arguments[:1]) != ["status"]:
        return (yield from default_command("ekf2", True, arguments))
    topics = vehicle.topics
    aligned = bool(topics.estimator_status.control_mode_flags & TILT_ALIGN)
    local, global_position = topics.vehicle_local_position.xy_valid, topics.vehicle_global_position.valid
    yield (
        f"\nekf2:0 EKF dt: {vehicle.estimator.ekf.dt_s:.4f}s, attitude: {aligned:d}, "
        f"local position: {local:d}, global position: {global_position:d}\n"
    )
    return SUCCESS
