"""flight_mode_manager: which flight task is active (PX4: modules/flight_mode_manager, print_status)."""

from collections.abc import Mapping, Sequence

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, Task
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command, of_kind

NAME = "flight_mode_manager"
NUMBERS: Mapping[Task, int] = {
    Task.AUTO: 0,
    Task.DESCEND: 1,
    Task.MANUAL_POSITION: 3,
    Task.MANUAL_POSITION_SLOW: 4,
    Task.MANUAL_ALTITUDE: 6,
    Task.ALTITUDE_CRUISE: 9,
    Task.FOLLOW_TARGET: 10,
    Task.ORBIT: 11,
}
"""FlightTaskIndex, which flight_mode_manager's CMakeLists.txt numbers."""
DIRECT: Mapping[NavState, int] = {NavState.ALTCTL: 5, NavState.POSCTL: 7}
"""With MPC_POS_MODE 0."""


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`flight_mode_manager status`."""
    runs = of_kind(NAME)(vehicle)
    if not runs or list(arguments[:1]) != ["status"]:
        return (yield from default_command(NAME, runs, arguments))
    state = vehicle.topics.vehicle_status.nav_state
    task = FLIGHT_MODES[state].task
    number = NUMBERS.get(task) if task is not None else None
    if state in DIRECT and vehicle.parameters["MPC_POS_MODE"] == 0:
        number = DIRECT[state]
    active = "no flight task active" if number is None else f"active flight task: {number}"
    yield info(NAME, f"Running, {active}")
    return SUCCESS
