"""vision_target_estimator: what it may use and whether it has a target (PX4: modules/vision_target_estimator)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command
from sitl_emu.autopilot.vision_target_estimator.vision_target_estimator import (
    MISSION_POSITION,
    PRECISION_LANDING,
    RECEIVER_VELOCITY,
    VISION,
)

NAME = "vision_target_estimator"
TARGETS_POSITION, TARGETS_VELOCITY = 1, 16
"""Bits of VTE_AID_MASK that are left out here (common.h)."""
POSITIONS = TARGETS_POSITION | VISION | MISSION_POSITION
"""Of which the position follows (VTEPosition::fusionEnabled)."""
DEBUG = 2
"""Bit of VTE_TASK_MASK."""


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`vision_target_estimator status`, without the states that PX4 prints of a filter that runs."""
    estimator = vehicle.vision_target_estimator
    if estimator is None or not estimator.was_started or list(arguments[:1]) != ["status"]:
        return (yield from default_command(NAME, estimator is not None and estimator.was_started, arguments))
    parameters = vehicle.parameters
    tasks, aids = int(parameters["VTE_TASK_MASK"]), int(parameters["VTE_AID_MASK"])
    runs = estimator.runs
    of_task = f"prec_land: {_has(tasks, PRECISION_LANDING)}, debug: {_has(tasks, DEBUG)}"
    by_place = (("vision pos", VISION), ("target gps pos", TARGETS_POSITION), ("mission pos", MISSION_POSITION))
    by_velocity = (("uav gps vel", RECEIVER_VELOCITY), ("target gps vel", TARGETS_VELOCITY))
    enabled = _yes(bool(parameters["VTE_POS_EN"]))
    for line in (
        "VTE running",
        "target model: static",
        "work queue: wq:vte",
        f"current task: {'prec_land' if runs else 'none'}",
        f"task mask: 0x{tasks:02x} ({of_task})",
        f"aid mask: 0x{aids:04x}",
        "  " + ", ".join(f"{name}: {_has(aids, bit)}" for name, bit in by_place),
        "  " + ", ".join(f"{name}: {_has(aids, bit)}" for name, bit in by_velocity),
        f"position vte: enabled: {enabled}, available: {enabled}, running: {_yes(runs)}, "
        f"fusing: {_has(aids, POSITIONS)}, timed out: no",
        f"orientation vte: enabled: {_yes(bool(parameters['VTE_YAW_EN']))}, available: no, running: no, "
        "fusing: no, timed out: no",
    ):
        yield info(NAME, line)
    return SUCCESS


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _has(mask: int, bit: int) -> str:
    return _yes(bool(mask & bit))
