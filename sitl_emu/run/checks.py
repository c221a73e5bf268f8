"""What of a scenario names nothing that exists, or can't be, is told before any process is started."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sitl_emu import vehicles
from sitl_emu.missions import registry
from sitl_emu.missions.mission import Setting
from sitl_emu.run import cameras, models, starts, worlds
from sitl_emu.run.scenario import Scenario, ScenarioError
from sitl_emu.run.scenario_parts.faults import FaultPart
from sitl_emu.run.scenario_parts.vehicle import VehiclePart
from sitl_emu.world.lens import MOUNTS, LensError, source_of
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.world import World


def check(scenario: Scenario, seed: int, path: Path) -> World:
    """The scenario's world. Raises ScenarioError for whatever names nothing that exists, before anything is started."""
    try:
        world = worlds.build(scenario.world.kind, seed, scenario.world.options, scenario.changes)
        if any(vehicle.parcel is not None for vehicle in scenario.vehicles):
            worlds.expect_parcels(world)
    except worlds.WorldError as error:
        raise ScenarioError(f"{path}: world: {error}") from None
    for number, vehicle in enumerate(scenario.vehicles):
        where = f"{path}: vehicles.{number}"
        _check_model(vehicle, where)
        if isinstance(vehicle.start, str) and vehicle.start not in world.places:
            known = ", ".join(world.places)
            raise ScenarioError(f"{where}.start: {vehicle.start!r}: no place of this world; known: {known}")
        _check_camera(vehicle, where)
        if vehicle.companion is not None and vehicle.companion.mission is not None:
            try:
                with tempfile.TemporaryDirectory() as folder:
                    write_calibrations([vehicle], Path(folder))
                    options = prepared(vehicle, world, Path(folder), seed, together(scenario)[vehicle.name])
                    registry.make_companion(vehicle.companion.mission, options)
            except registry.MissionError as error:
                raise ScenarioError(f"{where}.companion: {error}") from None
    _check_starts(scenario, world, seed, f"{path}: vehicles")
    for number, fault in enumerate(scenario.faults):
        _check_fault(scenario, fault, f"{path}: faults.{number}")
    return world


def _check_starts(scenario: Scenario, world: World, seed: int, where: str) -> None:
    """Raise ScenarioError where a vehicle would start in something."""
    parts = scenario.vehicles
    simulators = [starts.simulator(each.name, each.model_data, each.start, world, seed) for each in parts]
    if told := Simulation(simulators, world.solids, world.areas).begins_in([each.name for each in parts]):
        raise ScenarioError(f"{where}: {told}; give it another `start`")


def _check_model(vehicle: VehiclePart, where: str) -> None:
    """Raise ScenarioError for a model that can't be loaded, and for a wrong figure of its sensors or its parcel."""
    try:
        loaded = models.load(vehicle.model) if vehicle.autopilot is None else vehicles.load(vehicle.model)
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
        if vehicle.parcel is not None:
            vehicles.with_parcel(loaded, vehicle.parcel, f"{where}.parcel")
    except vehicles.VehicleError as error:
        raise ScenarioError(str(error)) from None


def _check_camera(vehicle: VehiclePart, where: str) -> None:
    """Raise ScenarioError for a camera or a depth camera that can't be."""
    for field, part in (("camera", vehicle.camera), ("depth", vehicle.depth)):
        mount = part.mount if part is not None else None
        if isinstance(mount, str) and mount not in MOUNTS:
            numbers = "{forward_m: …, right_m: …, down_m: …, depression_deg: …}"
            raise ScenarioError(f"{where}.{field}.mount: {mount!r}: known: {', '.join(MOUNTS)}, or {numbers}")
    depth, lidar = vehicle.depth_description, vehicle.lidar
    described = {"camera": vehicle.camera_description, "depth": depth.camera if depth is not None else None}
    carried = {field: camera.on_gimbal for field, camera in described.items() if camera is not None}
    carried["lidar"] = lidar is not None and lidar.mount.on_gimbal
    for field in (field for field, on_gimbal in carried.items() if on_gimbal):
        if field == "lidar" or vehicles.load(vehicle.model).gimbal is None:
            why = "a lidar is fixed to the body" if field == "lidar" else f"{vehicle.model} carries no gimbal"
            raise ScenarioError(f"{where}.{field}.mount: on a gimbal: {why}")
    if (camera := vehicle.camera_description) is not None and any(camera.distortion):
        try:
            source_of(cameras.intrinsics(camera))
        except LensError as error:
            raise ScenarioError(f"{where}.camera.distortion: {error}") from None


def _check_fault(scenario: Scenario, entry: FaultPart, where: str) -> None:
    """Raise ScenarioError for a fault of what is not there."""
    by_name = {vehicle.name: vehicle for vehicle in scenario.vehicles}
    named = [("vehicle", entry.vehicle)]
    if entry.when is not None and entry.when.vehicle is not None:
        named.append(("when.vehicle", entry.when.vehicle))
    for field, name in named:
        if name not in by_name:
            raise ScenarioError(f"{where}.{field}: {name!r}: there is no such vehicle; there are: {', '.join(by_name)}")
    vehicle, fault = by_name[entry.vehicle], entry.fault
    data = models.as_set(vehicle.model_data)
    rotors = len(data.propulsion.rotors) if data.propulsion is not None else 0
    if fault.motor is not None and fault.motor > rotors:
        allowed = f"1 to {rotors}" if rotors else "none, as it has no rotors"
        raise ScenarioError(f"{where}.fault.motor: {fault.motor}: allowed for {vehicle.model}: {allowed}")
    if fault.sensor == "lidar" and data.sensors.lidar is None:
        raise ScenarioError(f"{where}.fault.sensor: 'lidar': {vehicle.model} carries none")
    if fault.battery_drain_w is not None and data.battery.kind != "load":
        raise ScenarioError(
            f"{where}.fault.battery_drain_w: {vehicle.model} has PX4's simulated battery, which knows no load; "
            "give battery_charge"
        )
    talking = [other.name for other in scenario.vehicles if other.companion is not None]
    if fault.radio is not None and (vehicle.name not in talking or len(talking) < 2):
        raise ScenarioError(f"{where}.fault.radio: the companion of {vehicle.name} has no peer")
    if fault.kill == "companion" and vehicle.companion is None:
        raise ScenarioError(f"{where}.fault.kill: 'companion': {vehicle.name} has none")


def write_calibrations(parts: Sequence[VehiclePart], folder: Path) -> None:
    """The file of each camera and depth camera, for its companion. Raises OSError."""
    for vehicle in parts:
        path, camera = vehicle.calibration(folder), vehicle.camera_description
        if path is not None and camera is not None:
            cameras.write_calibration(path, camera)
        path, depth = vehicle.depth_calibration(folder), vehicle.depth_description
        if path is not None and depth is not None:
            cameras.write_calibration(path, depth.camera)


def together(scenario: Scenario, first_instance: int = 0) -> dict[str, list[int]]:
    """By vehicle: the MAVLink systems of all that fly its companion's mission with the same options."""
    flown = [(one.name, one.companion) for one in scenario.vehicles]
    return {
        name: [
            system
            for system, (_, other) in enumerate(flown, first_instance + 1)
            if companion is not None and other is not None and companion.mission is not None
            and (other.mission, other.options) == (companion.mission, companion.options)
        ]
        for name, companion in flown
    }  # fmt: skip


def prepared(vehicle: VehiclePart, world: World, folder: Path, seed: int, systems: Sequence[int]) -> dict[str, Any]:
    """The options of a vehicle's companion as its mission has prepared them. Raises MissionError."""
    assert vehicle.companion is not None and vehicle.companion.mission is not None
    outline_m = list(world.description.area_m)
    home = (world.home.lat_deg, world.home.lon_deg, world.home.alt_amsl_m)
    setting = Setting(vehicle.name, vehicle.calibration(folder), world.kind, home, outline_m, folder, seed, systems)
    return registry.prepare(vehicle.companion.mission, vehicle.companion.options, setting)
