"""The command line: `sitl-emu run`, `campaign`, `view`, `rerun`, `launch`, `world`, `detect` and `conformance`.

Whatever a command needs is imported when it is called.
"""

import math
import signal
from pathlib import Path
from typing import Annotated

import typer

from sitl_emu import __version__, cli_campaign, cli_world
from sitl_emu.cli_words import LAST_INSTANCE, MOST_SEED, PARCEL, finite, given_options, refuse, say, speed_of, wanted_of

app = typer.Typer(
    name="sitl-emu",
    help="PX4 vehicles, their simulated world and their missions, from one install. "
    "Start with `sitl-emu run`, which names the missions there are, or with `sitl-emu launch iris` and connect "
    "QGroundControl.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(cli_world.app, name="world")
app.command("campaign", short_help="Fly a scenario many times, in several arms, with tables and a report.")(
    cli_campaign.campaign
)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"sitl-emu {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_show_version, help="Show the version and exit.")
    ] = False,
) -> None:
    """Options before the command."""
    # A script starts what it does not wait for with SIGINT ignored, and Python leaves it so. PX4 hears it there, too.
    signal.signal(signal.SIGINT, signal.default_int_handler)


Gcs = Annotated[
    str | None,
    typer.Option(
        metavar="HOST[:PORT]",
        help="Where the ground station listens, if not on this machine (Docker, WSL); port 14550 unless given.",
    ),
]


VIDEO = "H.264 video, UDP 5600 + instance (QGroundControl finds it by itself). Needs PyAV."


DDS = (
    "Publish and take PX4's topics in ROS 2 (/fmu/out/…, /fmu/in/…; /px4_I/fmu/… for instance I), without an agent, "
    "and the world's sensors as ROS's own messages; domain ROS_DOMAIN_ID. Needs Cyclone DDS."
)


@app.command(short_help="Run a mission, with a report at the end.")
def run(
    ctx: typer.Context,
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="A scenario that a mission brings, by its name, or a .yaml file. Without it, lists their names.",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        str, typer.Option(metavar="1|N|max", help="Times real time; max: as fast as this machine can.")
    ] = "1",
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, max=MOST_SEED, metavar="S", help="Other seed, other world and noise. [default: the scenario's]"
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the run. [default: runs/SCENARIO-TIME]")
    ] = None,
    gcs: Gcs = None,
    instance: Annotated[
        int,
        typer.Option(
            min=0,
            max=LAST_INSTANCE,
            metavar="I",
            help="Instance (and so ports) of the first vehicle: 2 or 4 for a second run beside this one.",
        ),
    ] = 0,
    page: Annotated[
        bool,
        typer.Option(
            "--view",
            help="Show it in the browser while it goes on: map, vehicles, camera pictures, events. On a terminal the "
            "page stays until Ctrl-C; `sitl-emu view` shows the run again.",
        ),
    ] = False,
    video: Annotated[
        bool, typer.Option("--video", "--camera", help="Send what cameras see to the ground station: " + VIDEO)
    ] = False,
    world: Annotated[
        str | None,
        typer.Option(metavar="WORLD", help="Another world: a kind, with the scenario's options for it, or a file."),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="Another value at a dotted key of the scenario, such as vehicles.uas.count=2. As often as wanted.",
        ),
    ] = None,
    isolated: Annotated[
        bool,
        typer.Option(
            "--isolated",
            help="Without a ground station and on none of PX4's ports, so that many runs go on side by side. For "
            "companions and autopilots of ours; the logs are the same.",
        ),
    ] = False,
    dds: Annotated[bool, typer.Option("--dds", help=DDS)] = False,
) -> None:
    """Run a mission with all its vehicles, companions and cameras, and write a report.

    Ends with exit status 0 when the mission succeeded. While it runs, a ground station on UDP 14550 sees the vehicles.
    """
    if scenario is None and (given := given_options(ctx)):
        refuse(f"{given[0]}: name a scenario to run; `sitl-emu run` alone lists those that missions bring")
    if isolated and (gcs is not None or video):
        refuse(f"--isolated and {'--gcs' if gcs is not None else '--video'}: an isolated run has no ground station")
    if isolated and instance:
        refuse("--isolated and --instance: an isolated run is on none of PX4's ports; leave out one of them")
    if isolated and dds:
        refuse("--isolated and --dds: an isolated run speaks to nobody outside")
    from sitl_emu.run import memory

    with memory.all_stays():
        from sitl_emu.run.run_command import run_scenario, scenario_lines
        from sitl_emu.run.trouble import Trouble

    try:
        if scenario is None:
            for line in scenario_lines():
                say(line)
            return
        status = run_scenario(
            scenario,
            speed_of(speed),
            seed,
            out,
            _gcs(gcs),
            instance,
            page=page,
            video=video,
            world=world,
            vary=vary or (),
            dds=dds,
            isolated=isolated,
        )
    except Trouble as error:
        refuse(str(error))
    raise typer.Exit(status)


@app.command(short_help="Show a run in the browser, also while it goes on.")
def view(
    folder: Annotated[Path, typer.Argument(metavar="RUN_FOLDER", help="The folder of a run, runs/… by default.")],
    port: Annotated[int, typer.Option(min=0, max=65535, metavar="P", help="TCP port of the page; 0: a free one.")] = 0,
) -> None:
    """Replay a run in the browser, or follow one that goes on: map, vehicles, camera pictures, events on a time line.

    Prints the page's address, opens the browser where there is a desktop, and serves until Ctrl-C, to this machine
    alone.
    """
    from sitl_emu.run.trouble import Trouble
    from sitl_emu.run.view import opening

    try:
        opening.show(folder, port, say)
    except Trouble as error:
        refuse(str(error))


@app.command(short_help="Write a run as a recording for the Rerun viewer.")
def rerun(
    folder: Annotated[Path, typer.Argument(metavar="RUN_FOLDER", help="The folder of a run, runs/… by default.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.rrd", help="The file to write. [default: RUN_FOLDER/run.rrd]")
    ] = None,
) -> None:
    """Write poses, tracks, frames, depth, point clouds, plots and events on simulated time: `rerun FILE.rrd` shows it.

    Needs the Rerun SDK: pip install rerun-sdk.
    """
    from sitl_emu.run.trouble import Trouble
    from sitl_emu.run.view import rerun_recording

    try:
        say(f"wrote {rerun_recording.record(folder, out)}")
    except Trouble as error:
        refuse(str(error))


@app.command(short_help="Launch vehicles for a ground station, MAVSDK or a swarm.")
def launch(
    models: Annotated[
        list[str],
        typer.Argument(
            metavar="MODEL[:COUNT]...",
            help="Vehicles to launch: iris, m600, responder, rover, sihsim_hex, sihsim_rover_ackermann, or a folder "
            "of your own (./my_quad); iris:3 rover:2 are five.",
        ),
    ],
    instance: Annotated[
        int, typer.Option(min=0, max=LAST_INSTANCE, metavar="I", help="Instance (and so ports) of the first vehicle.")
    ] = 0,
    speed: Annotated[str, typer.Option(metavar="1|N|max", help="Times real time.")] = "1",
    home: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON,ALT,HEADING", help="Where the first vehicle stands; degrees, metres AMSL, degrees."
        ),
    ] = None,
    gcs: Gcs = None,
    state: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Where vehicles keep parameters, missions and logs until the next launch, in a folder each "
            "(MODEL-INSTANCE). [default: ~/.local/state/sitl-emu]",
            show_default=False,
        ),
    ] = None,
    fresh: Annotated[
        bool,
        typer.Option(
            "--fresh",
            help="Forget the parameters, missions and signing keys of earlier launches of these vehicles; logs stay.",
        ),
    ] = False,
    world: Annotated[
        str | None,
        typer.Option(
            metavar="WORLD",
            help="The world that the vehicles share: a kind (corn_field, flat) or a file (.yaml). They stand side by "
            "side at its home, in one process unless --per-process says otherwise: those of different processes are "
            "in equal worlds, and never meet. [default: a level plain, for which nothing is loaded]",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, max=MOST_SEED, metavar="S", help="Other seed, other --world and noise.")
    ] = 1,
    per_process: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Vehicles that share a process: less memory and CPU each. What ends one of them leaves the others "
            "flying. [default: 1, as PX4; with --world all]",
            show_default=False,
        ),
    ] = None,
    tlog: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Keep a telemetry log of each link there, MODEL-INSTANCE-LINK.tlog. One that is there already is an "
            "error: name a new folder for each launch.",
        ),
    ] = None,
    camera: Annotated[
        bool,
        typer.Option(
            "--camera",
            "--video",
            help="Send what the vehicles' cameras see in the --world to the ground station: " + VIDEO,
        ),
    ] = False,
    parcel: Annotated[bool, typer.Option("--parcel", help=PARCEL)] = False,
    dds: Annotated[bool, typer.Option("--dds", help=DDS)] = False,
) -> None:
    """Launch emulated PX4 vehicles, with their simulator in the same process; they stay until Ctrl-C.

    Prints which ports they speak on. QGroundControl on this machine finds them by itself; MAVSDK connects to
    udpin://0.0.0.0:14540 (pymavlink: udpin:0.0.0.0:14540), the second vehicle to 14541, and so on; as with PX4, all
    from the tenth on share 14549.
    """
    wanted = wanted_of(models, instance)
    factor = speed_of(speed)
    if world is not None and home is not None:
        refuse("--home and --world: a world has its own home; give one of them")
    place = _home(home) if home is not None else None
    station = _gcs(gcs)

    from sitl_emu.run import memory

    with memory.all_stays():
        from sitl_emu import vehicles
        from sitl_emu.run import launch as launching
        from sitl_emu.run.state import default_folder
        from sitl_emu.run.trouble import Trouble
        from sitl_emu.world.home import Home

    numbered = [launching.Wanted(model, instance + place) for place, model in enumerate(wanted)]
    try:
        options = launching.Options(
            speed=math.inf if factor is None else factor,
            home=launching.PX4_HOME if place is None else Home(*place),
            gcs=station,
            state=default_folder() if state is None else state,
            fresh=fresh,
            per_process=per_process,
            world=world,
            seed=seed,
            tlog=tlog,
            video=camera,
            parcels=parcel,
            dds=dds,
        )
        status = launching.launch(numbered, options, say)
    except (vehicles.VehicleError, Trouble) as error:
        refuse(str(error))
    raise typer.Exit(status)


@app.command(short_help="Show what a trained network sees in a video, pictures or a camera.")
def detect(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="A video file, a folder of pictures named by their time in µs, rtsp://… or /dev/videoN.",
        ),
    ],
    model: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="The network: one that comes with the package (field, disaster), or an .onnx file of tools/detector.",
        ),
    ],
    score: Annotated[
        float, typer.Option(min=0.01, max=1.0, callback=finite, metavar="S", help="From which finds are shown.")
    ] = 0.25,
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write, a new one.")] = Path("detected"),
    frames: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Stop after so many. [default: when the source ends]")
    ] = None,
) -> None:
    """Write each frame with boxes, labels and scores into a folder, and all finds as lines of JSON."""
    from sitl_emu.run import detect as detecting
    from sitl_emu.run.trouble import Trouble

    try:
        detecting.detect(source, model, score, out, frames, say)
    except (Trouble, OSError) as error:
        refuse(str(error))


@app.command(short_help="Measure an autopilot against PX4, by the conformance tests.")
def conformance(
    url: Annotated[
        str,
        typer.Argument(
            metavar="URL",
            help="Where the autopilot is, as pymavlink writes it: udpout:127.0.0.1:18570 for a vehicle of `launch`, "
            "udpin:0.0.0.0:14550, /dev/ttyACM0, or /dev/ttyUSB0:57600 with a baud rate.",
        ),
    ],
    service: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Only this service (parameter, mission, camera, ...); may be given several times. [default: all]",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write what is tested, and what came out, as .html or .md."),
    ] = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Also where the autopilot is no PX4 v1.18: it may fly or move in a test."),
    ] = False,
) -> None:
    """Run the conformance tests against an autopilot: one of ours, a real PX4 SITL, or any other.

    It must stand disarmed and ready, without propellers; tests arm it for moments on the ground, and leave it as they
    found it, but for what can't be undone: a gripper lets go, and images stay on the card. Ends with exit status 0 when
    all passed, 1 when something failed, 2 when there was nothing to measure, or the autopilot was lost.
    """
    from sitl_emu.run import conformance as conforming
    from sitl_emu.run import conformance_report
    from sitl_emu.run.trouble import Trouble

    try:
        if report is not None:
            conformance_report.check(report)
        run = conforming.measure(url, service or (), lambda text: say(text, nl=False), force)
        for line in conforming.summary(run):
            say(line)
        if report is not None:
            conformance_report.write(report, run)
    except Trouble as error:
        refuse(str(error))
    if run.trouble:
        refuse(run.trouble)
    raise typer.Exit(run.status)


def _gcs(text: str | None) -> tuple[str, int] | None:
    """Address of the ground station."""
    if text is None:
        return None
    from sitl_emu.core import ports
    from sitl_emu.run.addresses import address_of
    from sitl_emu.run.trouble import Trouble

    try:
        return address_of(text, ports.GCS_REMOTE)
    except Trouble as error:
        refuse(str(error))


def _home(text: str) -> tuple[float, float, float, float]:
    """Latitude, longitude, altitude, heading."""
    try:
        lat, lon, alt, heading = (float(part) for part in text.split(","))
    except ValueError:
        refuse(f"--home {text}: give LAT,LON,ALT,HEADING, such as 47.397742,8.545594,488,0")
    inside = -90.0 <= lat <= 90.0 and -180.0 <= lon <= 180.0 and -1000.0 <= alt <= 10000.0 and abs(heading) <= 360.0
    if not inside:
        refuse(f"--home {text}: latitude is -90..90, longitude -180..180, altitude -1000..10000 m, heading -360..360")
    return lat, lon, alt, heading
