"""simulator_sih: PX4's own simulator, in airframes that fly in it (PX4: modules/simulation/simulator_sih, sih.cpp).

What it tells is true. Left out of its status: how fast it runs, the vehicle's kind, forces and moments.
"""

import math
from collections.abc import Iterator, Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command
from sitl_emu.autopilot.shell.matrix_text import lines
from sitl_emu.core.attitude import euler

NAME = "simulator_sih"
SIGNALS = 8


def runs(vehicle: Vehicle) -> bool:
    """Whether the airframe is one of SIH's, whose barometer PX4 simulates itself, too: an outside simulator has one."""
    return bool(vehicle.parameters.default("SENS_EN_BAROSIM"))


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`simulator_sih status`."""
    if not runs(vehicle) or list(arguments[:1]) != ["status"]:
        return (yield from default_command(NAME, runs(vehicle), arguments))
    truth = vehicle.topics.groundtruth
    controls = (*vehicle.topics.actuator_outputs.controls, *(0.0,) * SIGNALS)[:SIGNALS]
    yield info(NAME, "Running in lockstep mode")
    yield from _told("local position NED (m)", [(truth.x, truth.y, truth.z)])
    yield from _told("local velocity NED (m/s)", [(truth.vx, truth.vy, truth.vz)])
    yield from _told("attitude roll-pitch-yaw (deg)", [(math.degrees(angle),) for angle in euler(truth.q)])
    yield from _told("angular acceleration roll-pitch-yaw (deg/s)", [(math.degrees(rate),) for rate in truth.xyz])
    yield from _told("actuator signals", [controls])
    return SUCCESS


def _told(title: str, rows: Sequence[Sequence[float]]) -> Iterator[str]:
    yield info(NAME, title)
    yield from lines(rows)
