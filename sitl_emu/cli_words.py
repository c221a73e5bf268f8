"""What the commands of the command line have in common: how they speak, and how they read speeds and vehicles."""

import math
import sys
from typing import NoReturn

import typer

BAD_INPUT = 2
LAST_INSTANCE = 249
"""Its system id is 250, PX4's largest."""
MOST_SEED = 2**53
"""A scenario's, too: options carry whole numbers exactly up to here."""
PARCEL = "Vehicles with a release (responder) carry a parcel; MAV_CMD_DO_GRIPPER or DO_SET_ACTUATOR drops it."


def say(text: str, nl: bool = True) -> None:
    """To standard output; once nobody reads it any more (`| head`, a full disk), to nobody."""
    try:
        typer.echo(text, nl=nl)
    except OSError:
        from sitl_emu.run.output import to_nobody

        to_nobody(sys.stdout)


def refuse(text: str) -> NoReturn:
    """End for wrong input: a line that says what is wrong, and exit status 2."""
    typer.echo(f"sitl-emu: {text}", err=True)
    raise typer.Exit(BAD_INPUT)


def given_options(ctx: typer.Context) -> list[str]:
    """The options that the user has given to a command, in the order of its help."""
    return [
        param.opts[0]
        for param in ctx.command.params
        if param.param_type_name == "option"
        and param.name is not None
        and (source := ctx.get_parameter_source(param.name)) is not None
        and source.name == "COMMANDLINE"
    ]


def finite(param: typer.CallbackParam, value: float | None) -> float | None:
    """An option's callback: a number that is one, which NaN passes every range for."""
    if value is not None and not math.isfinite(value):
        refuse(f"{param.opts[0]} {value}: give a finite number")
    return value


def speed_of(text: str) -> float | None:
    """Times real time; None for max."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.0 < speed < 1e6:
        refuse(f"--speed {text}: give a number above 0 (times real time), or max")
    return speed


def wanted_of(models: list[str], instance: int) -> list[str]:
    """Models, each as often as it is asked for, from this instance on."""
    wanted = list[str]()
    for text in models:
        model, colon, count = text.partition(":")
        if colon and not (count.isascii() and count.isdigit() and 1 <= int(count) <= LAST_INSTANCE + 1):
            refuse(f"{text}: give MODEL or MODEL:COUNT, such as iris:3; COUNT is 1 to {LAST_INSTANCE + 1}")
        wanted += [model] * (int(count) if colon else 1)
    if instance + len(wanted) > LAST_INSTANCE + 1:
        refuse(
            f"{len(wanted)} vehicles from instance {instance} on: the last instance is {LAST_INSTANCE}, "
            "as PX4's system ids end at 250; launch fewer, or choose a smaller --instance"
        )
    return wanted
