"""`sitl-emu run`: a scenario by its name or file, run, scored and reported."""

import contextlib
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from sitl_emu.missions import registry
from sitl_emu.missions.mission import Mission
from sitl_emu.run import (
    checks,
    dds_socket,
    flight_logs,
    folders,
    ground_picture,
    launcher,
    output,
    preflight,
    score,
    wiring,
    worlds,
)
from sitl_emu.run.campaign import arms
from sitl_emu.run.live_view import open_view
from sitl_emu.run.scenario import Scenario, ScenarioError, find, load, read
from sitl_emu.run.scenario_parts.world import WorldPart
from sitl_emu.run.trouble import Trouble, unwritable
from sitl_emu.run.view import opening
from sitl_emu.world.description import WorldError
from sitl_emu.world.world import World


def run_scenario(
    name_or_file: str,
    speed: float | None,
    seed: int | None,
    out: Path | None,
    gcs: tuple[str, int] | None,
    first_instance: int,
    *,
    page: bool = False,
    video: bool = False,
    world: str | None = None,
    vary: Sequence[str] = (),
    dds: bool = False,
    isolated: bool = False,
) -> int:
    """Run a scenario; the exit status.

    `page`: with a page for the browser, which goes on after the run until Ctrl-C. `video`: what its cameras see is sent
    to the ground station. `dds`: our autopilots speak to ROS 2. `world`: a kind or file that takes the place of the
    scenario's. `vary`: KEY=VALUE, other fields of it. `isolated`: without a ground station, on none of PX4's ports.
    Raises Trouble for what the user can put right.
    """
    path = find(name_or_file)
    scenario = arms.changed(read(path), [arms.single(each) for each in vary], path) if vary else load(path)
    scenario = scenario if world is None else in_world(scenario, world)
    seed = scenario.seed if seed is None else seed
    built = checks.check(scenario, seed, path) if world is None else _checked_in(world, scenario, seed, path)
    preflight.check(scenario, first_instance, isolated=isolated)
    if video:
        preflight.check_video(scenario)
    if dds:
        dds_socket.check(len(scenario.vehicles))
    folder = make_folder(out, scenario.name)
    wanted = wiring.Wanted(scenario, seed, speed, folder, gcs, first_instance, video, dds, isolated)
    console = output.console()
    write_inputs(wanted, built)
    for line in worlds.not_read(built):
        console.print(line, markup=False, highlight=False)
    with opening.page_of(folder, console) if page else contextlib.nullcontext():
        return fly(wanted, built, console)[0]


def write_inputs(wanted: wiring.Wanted, world: World) -> None:
    """Write what a run needs into its folder: scenario, world, calibrations, plans; options follow. Raises Trouble."""
    scenario, seed, folder = wanted.scenario, wanted.seed, wanted.folder
    as_run = {**scenario.model_dump(mode="json"), "seed": seed}
    if worlds.is_file(scenario.world.kind):
        as_run["world"] = worlds.KEPT_AS
    try:
        (folder / "scenario.yaml").write_text(yaml.safe_dump(as_run, sort_keys=False))
        worlds.keep(world, folder)
        checks.write_calibrations(scenario.vehicles, folder)
        _prepare_missions(scenario, world, folder, seed, wanted.first_instance)
    except OSError as error:
        text = f"can't write {error.filename}: {error.strerror}" if error.strerror else str(error)
        raise Trouble(f"{text}; name another place with --out") from None


def in_world(scenario: Scenario, world: str) -> Scenario:
    """A scenario in another world: by its kind, with the same options, or by its file, which has none."""
    options = {} if worlds.is_file(world) else scenario.world.options
    return scenario.model_copy(update={"world": WorldPart(kind=world, options=options)})


def _checked_in(world: str, scenario: Scenario, seed: int, path: Path) -> World:
    """See `checks.check`, for a scenario that the user has put into another world."""
    try:
        return checks.check(scenario, seed, path)
    except ScenarioError as error:
        told = str(error).removeprefix(f"{path}: ")
        remedy = ""
        if scenario.world.options and told.startswith("world: "):
            told = told.removeprefix("world: ")
            remedy = f"; its options are for a world of its own: copy {path}, and give it those of {world}"
        raise ScenarioError(f"--world {world}: {path.stem} does not fit it: {told}{remedy}") from None


def fly(wanted: wiring.Wanted, world: World, console: Console) -> tuple[int, launcher.Ending]:
    """From the first process to the report; the exit status, and how it ended. Raises Trouble."""
    scenario, seed, folder = wanted.scenario, wanted.seed, wanted.folder
    view = open_view(f"{scenario.name}, seed {seed}", console)
    try:
        ending = launcher.run(wanted, view)
    finally:
        view.close()
    programs = [vehicle.companion.mission for vehicle in scenario.vehicles if vehicle.companion is not None]
    missions = registry.missions_of([name for name in programs if name is not None])
    summary = score.summary(folder, scenario.name, seed, ending, missions, world)
    try:
        flight_logs.show(folder, [vehicle.name for vehicle in scenario.vehicles])
        (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
        _report(folder, summary, ending.truth, missions, world, console)
    except OSError as error:
        raise Trouble("; ".join(filter(None, (str(unwritable(folder, error)), ending.complaint)))) from None
    _tell(console, folder, summary, ending)
    return score.exit_status(summary), ending


def scenario_lines() -> list[str]:
    """The scenarios that missions bring, a line each, and what is wrong with missions that can't be loaded."""
    brought = registry.scenarios()
    width = max(map(len, brought), default=0)
    return [f"{name:<{width}}  {load(brought[name]).description}" for name in sorted(brought)] + registry.broken()


def _prepare_missions(scenario: Scenario, world: World, folder: Path, seed: int, first_instance: int) -> None:
    """Let the missions put what they need into the run's folder, and their options follow."""
    systems = checks.together(scenario, first_instance)
    for vehicle in scenario.vehicles:
        if vehicle.companion is not None and vehicle.companion.mission is not None:
            options = checks.prepared(vehicle, world, folder, seed, systems[vehicle.name])
            vehicle.companion.options.update(options)


def make_folder(out: Path | None, name: str) -> Path:
    """The run's folder, new or empty. Raises Trouble where it can't be written."""
    if out is None:
        return folders.make_new(Path("runs") / f"{name}-{time.strftime('%Y%m%d-%H%M%S')}")
    folders.make(out)
    return out


def _report(
    folder: Path,
    summary: dict[str, Any],
    truth: Mapping[str, Any],
    missions: list[Mission],
    world: World,
    console: Console,
) -> None:
    from sitl_emu.run import report

    photo = None
    try:
        photo = world.photo()
    except WorldError as error:
        console.print(
            f"the report is without the ground's photo: {error}", markup=False, highlight=False, soft_wrap=True
        )
    if photo is not None:
        ground_picture.write(photo, folder)
    report.write(folder, summary, truth, score.pages(missions, summary), photo, world.ground)


def _tell(console: Console, folder: Path, summary: dict[str, Any], ending: launcher.Ending) -> None:
    if ending.complaint:
        console.print(f"sitl-emu: {ending.complaint}", markup=False, highlight=False, soft_wrap=True)
    console.print(f"outcome: {summary['outcome']}", markup=False, highlight=False, soft_wrap=True)
    for line in score.lines(summary):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(f"report: {folder / 'report.html'}", markup=False, highlight=False, soft_wrap=True)
