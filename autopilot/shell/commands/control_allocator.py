"""control_allocator: what each motor does (PX4: modules/control_allocator, ControlAllocator::print_status)."""

from collections.abc import Sequence

from sitl_emu.autopilot.control.control_allocator import effectiveness_of, rotors_of
from sitl_emu.autopilot.shell import matrix_text
from sitl_emu.autopilot.shell.command import SUCCESS, Output, Vehicle, info
from sitl_emu.autopilot.shell.commands.module import default_command, of_kind

NAME = "control_allocator"
METHODS = {-1: "None", 0: "Pseudo-inverse", 1: "Sequential desaturation", 2: "Auto"}
"""CA_METHOD; another is not told."""
AXES = ("Mx", "My", "Mz", "Fx", "Fy", "Fz")


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`control_allocator status`."""
    runs = of_kind(NAME)(vehicle)
    if not runs or list(arguments[:1]) != ["status"]:
        return (yield from default_command(NAME, runs, arguments))
    parameters = vehicle.parameters
    effectiveness = effectiveness_of(rotors_of(parameters))
    count = effectiveness.shape[1]
    turn_back = int(parameters["CA_R_REV"])
    yield info(NAME, "Running")
    if (method := METHODS.get(int(parameters["CA_METHOD"]))) is not None:
        yield info(NAME, f"Method: {method}")
    yield info(NAME, "Effectiveness Source: Multirotor")
    if count:
        for title, rows, labels in (
            ("Effectiveness", effectiveness.tolist(), AXES),
            ("minimum", [[-1.0 if turn_back >> n & 1 else 0.0 for n in range(count)]], (" ",)),
            ("maximum", [[1.0] * count], (" ",)),
        ):
            yield info(NAME, f"  {title} =")
            yield from matrix_text.lines(rows, labels)
    yield info(NAME, f"  Configured actuators: {count}")
    return SUCCESS
