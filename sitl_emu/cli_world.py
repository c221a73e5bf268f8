"""The command line's `sitl-emu world`: serve a world to autopilots, look at it, write its truth."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from sitl_emu.cli_words import LAST_INSTANCE, MOST_SEED, PARCEL, finite, refuse, say, speed_of, wanted_of

SERVE = "serve"


class _Worlds(TyperGroup):
    """`world NAME …` is short for `world serve NAME …`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] not in ("--help", "-h"):
            args = [SERVE, *args]
        parsed: list[str] = super().parse_args(ctx, args)
        return parsed


app = typer.Typer(
    cls=_Worlds,
    short_help="Serve the simulator alone, for a real PX4, say; preview a world, or export its truth.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

World = Annotated[
    str,
    typer.Argument(
        metavar="WORLD",
        help="A kind (corn_field, urban_flood, ...), a world file (.yaml), or a Gazebo world (.sdf, .world).",
    ),
]
Seed = Annotated[
    int, typer.Option(min=0, max=MOST_SEED, metavar="S", help="Other seed, other world of this kind, and other noise.")
]
At = Annotated[float, typer.Option(min=0.0, callback=finite, metavar="S", help="The simulated time, s.")]
Options = Annotated[
    list[str] | None,
    typer.Option("--option", metavar="NAME=VALUE", help="An option of the kind; may be given several times."),
]


@app.callback()
def worlds() -> None:
    """Serve a world's simulator to autopilots, look at a world, or write its truth.

    `sitl-emu world WORLD --vehicle MODEL [--instance I] [--seed S] [--speed 1|N|max]` serves the simulator alone, on
    TCP 4560+instance; --speed is times real time. It is short for `sitl-emu world serve`, whose --help explains it.
    """


@app.command(short_help="The simulator alone, for a real PX4, say. `world WORLD` is short for it.")
def serve(
    name: World,
    vehicle: Annotated[
        list[str] | None, typer.Option(metavar="MODEL[:COUNT]", help="A vehicle in it; may be given several times.")
    ] = None,
    instance: Annotated[
        int, typer.Option(min=0, max=LAST_INSTANCE, metavar="I", help="Instance (and so port) of the first vehicle.")
    ] = 0,
    seed: Seed = 1,
    speed: Annotated[str, typer.Option(metavar="1|N|max", help="Times real time.")] = "1",
    parcel: Annotated[bool, typer.Option("--parcel", help=PARCEL)] = False,
) -> None:
    """Serve the simulator alone, on TCP 4560+instance, to any autopilot (a real PX4, say), until Ctrl-C.

    It starts when every vehicle's autopilot has connected, and ends when one leaves, or all were shut down. Our own
    autopilot connects too: `python -P -m sitl_emu.autopilot --help`.
    """
    if not vehicle:
        refuse(f"world {name}: name at least one vehicle in it: --vehicle iris")
    wanted, factor = wanted_of(vehicle, instance), speed_of(speed)

    from sitl_emu.run.serve_world import serve_world
    from sitl_emu.run.trouble import Trouble

    try:
        status = serve_world(name, wanted, instance, seed, factor, say, parcels=parcel)
    except Trouble as error:
        refuse(str(error))
    raise typer.Exit(status)


@app.command(short_help="What a world looks like: pictures, a map, its truth.")
def preview(
    name: World,
    seed: Seed = 1,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="A new folder. [default: preview-WORLD]")] = None,
    option: Options = None,
    at: At = 20.0,
) -> None:
    """Write pictures from above, from the side and from the street, a map, the truth and the world file."""
    from sitl_emu.run import preview as previewing
    from sitl_emu.run.trouble import Trouble, unwritable

    folder = out or Path(f"preview-{Path(name).stem}")
    try:
        previewing.preview(name, seed, _given(option), folder, at, say)
    except Trouble as error:
        refuse(str(error))
    except OSError as error:
        refuse(str(unwritable(folder, error)))


@app.command(short_help="Pictures of a world with boxes, masks and depth: COCO, YOLO, GeoJSON.")
def export(
    name: Annotated[
        str,
        typer.Argument(
            metavar="WORLD|RUN",
            help="A kind, a world file, or the folder of a finished run: what a camera of it saw, drawn anew.",
        ),
    ],
    survey: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            max=500.0,
            callback=finite,
            metavar="HEIGHT",
            help="Straight down from this height, m, all over the area.",
        ),
    ] = None,
    overlap: Annotated[
        float,
        typer.Option(
            min=0.0, max=0.95, callback=finite, metavar="SHARE", help="Of pictures of a survey with their neighbours."
        ),
    ] = 0.2,
    views: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A table (CSV) of views: north_m,east_m,above_m,heading_deg,depression_deg, and time_s, if you like. "
            "Without --survey or --views: those of `preview`.",
        ),
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a run: whose camera. [default: the first that has one]")
    ] = None,
    every: Annotated[
        float | None,
        typer.Option(
            min=0.02, callback=finite, metavar="S", help="Of a run: seconds from picture to picture. [default: 1.0]"
        ),
    ] = None,
    format_: Annotated[
        list[str] | None,
        typer.Option("--format", metavar="coco|yolo|geojson", help="May be given several times. [default: all]"),
    ] = None,
    label: Annotated[
        list[str] | None,
        typer.Option(metavar="LABEL", help="A class, in the order of their numbers; several times. [default: all]"),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Of pictures, px. [default: 640x480; of a run, its camera's]")
    ] = None,
    hfov: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            max=150.0,
            callback=finite,
            metavar="DEG",
            help="Field of view across. [default: 90; of a run, its own]",
        ),
    ] = None,
    seed: Seed = 1,
    option: Options = None,
    at: At = 20.0,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="A new folder. [default: export-WORLD]")] = None,
) -> None:
    """Draw pictures of a world and write with each what is in it: boxes, classes, what is hidden, masks, depth.

    images/, masks/, depth/ and frames.jsonl, annotations.json (COCO), labels/ and data.yaml (YOLO), truth.geojson.
    """
    from sitl_emu.run import export as exporting
    from sitl_emu.run.trouble import Trouble, unwritable

    folder = out or Path(f"export-{Path(name).stem}")
    try:
        asked = exporting.Asked(
            name, seed, _given(option), survey, overlap, views, vehicle, every, tuple(format_ or exporting.FORMATS),
            tuple(label or ()), _size(size), hfov, at,
        )  # fmt: skip
        plan = exporting.plan(asked, folder, say)
        count = len(plan.views) if plan.has_frames else 0
        with typer.progressbar(length=count, label=f"{count} pictures", file=sys.stderr) as bar:
            for _ in exporting.write(plan):
                bar.update(1)
    except Trouble as error:
        refuse(str(error))
    except OSError as error:
        refuse(str(unwritable(folder, error)))
    say(f"{plan.world.description.name}: {count} pictures, {', '.join(sorted(plan.formats))} are in {folder}")


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 16 <= int(width) <= 8192 and 16 <= int(height) <= 8192):
        refuse(f"--size {text}: give WIDTHxHEIGHT in pixels, 16 to 8192 each, such as 640x480")
    return int(width), int(height)


def _given(options: Sequence[str] | None) -> dict[str, Any]:
    from sitl_emu.world.description import yaml_text

    given = {}
    for each in options or ():
        key, equals, value = each.partition("=")
        try:
            given[key] = yaml_text.load(value)
        except yaml_text.YamlError:
            equals = ""
        if not equals:
            refuse(f"--option {each}: write NAME=VALUE, such as size_m=120")
    return given
