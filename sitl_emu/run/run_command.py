"""`sitl-emu run`: a scenario by its name or file, run, scored and reported."""

import json
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

import vehicles
from missions import registry
from missions.mission import Mission, Setting
from sitl_emu.run import cameras, launcher, models, preflight, score, wiring, worlds
from sitl_emu.run.live_view import open_view
from sitl_emu.run.scenario import Scenario, ScenarioError, VehiclePart, find, load
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.lens import MOUNTS, LensError, source_of


def run_scenario(
    name_or_file: str,
    speed: float | None,
    seed: int | None,
    out: Path | None,
    gcs: tuple[str, int] | None,
    first_instance: int,
) -> int:
    """Run a scenario; the exit status. Raises Trouble for what the user can put right."""
    path = find(name_or_file)
    scenario = load(path)
    seed = scenario.seed if seed is None else seed
    check(scenario, seed, path)
    preflight.check(scenario, first_instance)
    console = Console()
    folder = make_folder(out, scenario.name)
    as_run = {**scenario.model_dump(mode="json"), "seed": seed}
    try:
        (folder / "scenario.yaml").write_text(yaml.safe_dump(as_run, sort_keys=False))
        _write_calibrations(scenario.vehicles, folder)
        _prepare_missions(scenario, seed, folder)
    except OSError as error:
        text = f"can't write {error.filename}: {error.strerror}" if error.strerror else str(error)
        raise Trouble(f"{text}; name another place with --out") from None
    wanted = wiring.Wanted(scenario, seed, speed, folder, gcs, first_instance)
    view = open_view(f"{scenario.name}, seed {seed}", console)
    try:
        ending = launcher.run(wanted, view)
    finally:
        view.close()
    programs = [vehicle.companion.mission for vehicle in scenario.vehicles if vehicle.companion is not None]
    missions = registry.missions_of([name for name in programs if name is not None])
    summary = score.summary(folder, scenario.name, seed, ending, missions)
    try:
        (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
        _report(folder, summary, ending.truth, missions, scenario, seed)
    except OSError as error:
        raise Trouble(f"can't write {error.filename or folder}: {error.strerror}; {ending.complaint}") from None
    _tell(console, folder, summary, ending)
    return score.exit_status(summary)


def scenario_lines() -> list[str]:
    """The scenarios that missions bring, a line each, and what is wrong with missions that can't be loaded."""
    brought = registry.scenarios()
    width = max(map(len, brought), default=0)
    return [f"{name:<{width}}  {load(brought[name]).description}" for name in sorted(brought)] + registry.broken()


def check(scenario: Scenario, seed: int, path: Path) -> None:
    """Raise ScenarioError for whatever names nothing that exists, before any process is started."""
    try:
        world = worlds.of(scenario.world_data, seed)
    except worlds.WorldError as error:
        raise ScenarioError(f"{path}: world: {error}") from None
    for number, vehicle in enumerate(scenario.vehicles):
        where = f"{path}: vehicles.{number}"
        _check_model(vehicle, where)
        if isinstance(vehicle.start, str) and vehicle.start not in world.places:
            known = ", ".join(world.places)
            raise ScenarioError(f"{where}.start: {vehicle.start!r}: no place of this world; known: {known}")
        if vehicle.camera is not None:
            _check_camera(vehicle, world, where)
        if vehicle.companion is not None and vehicle.companion.mission is not None:
            try:
                with tempfile.TemporaryDirectory() as folder:
                    _write_calibrations([vehicle], Path(folder))
                    options = _prepared(vehicle, vehicle.companion.mission, world, Path(folder))
                    registry.make_companion(vehicle.companion.mission, options)
            except registry.MissionError as error:
                raise ScenarioError(f"{where}.companion: {error}") from None


def _check_model(vehicle: VehiclePart, where: str) -> None:
    """Raise ScenarioError for a model that can't be loaded, and for a figure of its sensors that is no such."""
    try:
        loaded = models.load(vehicle.model)
    except vehicles.UnknownModel as error:
        known = ", ".join(error.models)
        raise ScenarioError(
            f"{where}.model: {vehicle.model!r}: there is no such model; known: {known}, or a folder of your own that "
            "holds vehicle.toml and airframe.json"
        ) from None
    except vehicles.VehicleError as error:
        raise ScenarioError(f"{where}.model: {error}") from None
    try:
        vehicles.with_sensors(loaded, vehicle.sensors, f"{where}.sensors")
    except vehicles.VehicleError as error:
        raise ScenarioError(str(error)) from None


def _check_camera(vehicle: VehiclePart, world: worlds.World, where: str) -> None:
    """Raise ScenarioError for a camera that can't be, or that has nothing to look at."""
    assert vehicle.camera is not None
    mount = vehicle.camera.mount
    if isinstance(mount, str) and mount not in MOUNTS:
        numbers = "{forward_m: …, right_m: …, down_m: …, depression_deg: …}"
        raise ScenarioError(f"{where}.camera.mount: {mount!r}: known: {', '.join(MOUNTS)}, or {numbers}")
    if world.field is None:
        raise ScenarioError(f"{where}.camera: world {world.kind} has nothing that a camera could see")
    if (camera := vehicle.camera_description) is not None and any(camera.distortion):
        try:
            source_of(cameras.intrinsics(camera))
        except LensError as error:
            raise ScenarioError(f"{where}.camera.distortion: {error}") from None


def _write_calibrations(parts: Sequence[VehiclePart], folder: Path) -> None:
    """The file of each camera, for its companion. Raises OSError."""
    for vehicle in parts:
        path, camera = vehicle.calibration(folder), vehicle.camera_description
        if path is not None and camera is not None:
            cameras.write_calibration(path, camera)


def _prepared(vehicle: VehiclePart, mission: str, world: worlds.World, folder: Path) -> dict[str, Any]:
    """The options of a vehicle's companion as its mission has prepared them. Raises MissionError."""
    assert vehicle.companion is not None
    outline_m = [(north, east) for north, east in world.truth["outline"]]
    home = (world.home.lat_deg, world.home.lon_deg, world.home.alt_amsl_m)
    setting = Setting(vehicle.name, vehicle.calibration(folder), world.kind, home, outline_m, folder)
    return registry.prepare(mission, vehicle.companion.options, setting)


def _prepare_missions(scenario: Scenario, seed: int, folder: Path) -> None:
    """Let the missions put what they need into the run's folder, and their options follow."""
    world = worlds.of(scenario.world_data, seed)
    for vehicle in scenario.vehicles:
        if vehicle.companion is not None and vehicle.companion.mission is not None:
            vehicle.companion.options.update(_prepared(vehicle, vehicle.companion.mission, world, folder))


def make_folder(out: Path | None, name: str) -> Path:
    """The run's folder, new or empty. Raises Trouble where it can't be written."""
    folder = out if out is not None else Path("runs") / f"{name}-{time.strftime('%Y%m%d-%H%M%S')}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise Trouble(f"--out {folder}: this folder is not empty; name a new one")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(None, "Permission denied")
    except OSError as error:
        raise Trouble(f"{folder}: can't write there: {error.strerror}; name another folder with --out") from None
    return folder


def _report(
    folder: Path,
    summary: dict[str, Any],
    truth: dict[str, Any],
    missions: list[Mission],
    scenario: Scenario,
    seed: int,
) -> None:
    from sitl_emu.run import report

    photo = worlds.photo(worlds.of(scenario.world_data, seed))
    pages = [one.page(summary) for one in missions if one.page is not None]
    report.write(folder, summary, truth, pages, photo)


def _tell(console: Console, folder: Path, summary: dict[str, Any], ending: launcher.Ending) -> None:
    if ending.complaint:
        console.print(f"sitl-emu: {ending.complaint}", markup=False, highlight=False, soft_wrap=True)
    console.print(f"outcome: {summary['outcome']}", markup=False, highlight=False, soft_wrap=True)
    for line in score.lines(summary):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(f"report: {folder / 'report.html'}", markup=False, highlight=False, soft_wrap=True)
