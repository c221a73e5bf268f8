"""Vehicles: what each *is*, as data (`vehicles/<model>/`), and the dynamics that such data needs.

    from sitl_emu import vehicles
    iris = vehicles.load("iris")
    mine = vehicles.load("./my_quad")

A model is a folder with `vehicle.toml` (physics and sensors, read into `description.Vehicle`) and `airframe.json`
(PX4's parameters that differ from its defaults): one of those in here, by its name, or anybody's own, by its path. Not
here: the world, sensors' behaviour, autopilot.
"""

import dataclasses
import functools
import json
import math
import os
import pathlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from sitl_emu.core.c_types import FLOAT32_MAX
from sitl_emu.vehicles import inertia, record
from sitl_emu.vehicles.description import (
    Aerodynamics,
    Battery,
    Body,
    Camera,
    Chassis,
    Gear,
    Gimbal,
    Part,
    Propulsion,
    Release,
    Sensors,
    SihRover,
    Vector3,
    Vehicle,
)
from sitl_emu.vehicles.errors import UnknownModel, VehicleError

__all__ = [
    "UnknownModel",
    "Vehicle",
    "VehicleError",
    "is_folder",
    "load",
    "models",
    "with_parcel",
    "with_parcels",
    "with_sensors",
]

FOLDER = pathlib.Path(__file__).parent
TOML, AIRFRAME, RECEIVERS = "vehicle.toml", "airframe.json", "receivers.toml"


@dataclass(frozen=True, slots=True)
class _File:
    """The fields of a vehicle.toml: either mass and inertia, or the parts that they follow from."""

    description: str
    battery: Battery
    sensors: Sensors
    mass_kg: Annotated[float | None, record.Limits(0.001)] = None
    inertia_kg_m2: Annotated[Vector3 | None, record.Limits(1e-9)] = None
    parts: tuple[Part, ...] = ()
    propulsion: Propulsion | None = None
    aerodynamics: Aerodynamics | None = None
    gear: Gear | None = None
    chassis: Chassis | None = None
    sih_rover: SihRover | None = None
    camera: Camera | None = None
    gimbal: Gimbal | None = None
    depth: Mapping[str, Any] | None = None
    lidar: Mapping[str, Any] | None = None
    body: Body | None = None
    release: Release | None = None
    wind_is_px4s: bool = False
    ranging_beacons: bool = False
    motor_speed_max_rad_s: Annotated[float, record.Limits(0.0)] = 0.0


def models() -> list[str]:
    """Names of the vehicles that exist, sorted."""
    return sorted(path.parent.name for path in FOLDER.glob("*/vehicle.toml"))


@functools.cache
def load(model: str) -> Vehicle:
    """A vehicle by its name, or by the path of a folder of one's own, which is told by its `/` or its vehicle.toml.

    Raises UnknownModel, or VehicleError that names file, field, value and what is allowed.
    """
    if model in models():
        return read(FOLDER / model)
    folder = pathlib.Path(model)
    if not is_folder(folder) and os.sep not in model:
        raise UnknownModel(model, models())
    return read(folder)


def is_folder(path: pathlib.Path) -> bool:
    """Whether this is the folder of a model."""
    return (path / TOML).is_file()


def with_sensors(vehicle: Vehicle, figures: Mapping[str, Any], where: str = "sensors") -> Vehicle:
    """The same vehicle with other figures of its sensors, named and nested as in vehicle.toml. Raises VehicleError.

    `gps` may be a receiver's name instead, of those in receivers.toml.

    Other satellites change the airframe's SIM_GPS_USED, too, which is where the autopilot's shell shows them.
    """
    if isinstance(named := figures.get("gps"), str):
        figures = {**figures, "gps": _receiver(named, f"{where}: gps")}
    sensors = record.changed(vehicle.sensors, figures, where)
    _check_sensors(sensors, where)
    airframe = dict(vehicle.airframe)
    if sensors.gps.satellites != vehicle.sensors.gps.satellites:
        airframe["SIM_GPS_USED"] = sensors.gps.satellites
    return dataclasses.replace(vehicle, sensors=sensors, airframe=airframe)


def with_parcel(vehicle: Vehicle, figures: Mapping[str, Any], where: str = "parcel") -> Vehicle:
    """The same vehicle with a parcel on its release: the release's own, but for these figures. Raises VehicleError."""
    if vehicle.release is None or vehicle.gear is None:
        able = ", ".join(model for model in models() if load(model).release is not None)
        raise VehicleError(f"{where}: {vehicle.model} has no release that could hold one; of ours have one: {able}")
    parcel = record.changed(vehicle.release.parcel, figures, where)
    if parcel.centre_m[2] + 0.5 * parcel.size_m[2] > vehicle.gear.height_m:
        raise VehicleError(f"{where}: it would hang lower than the landing gear ({vehicle.gear.height_m:g} m)")
    loaded = dataclasses.replace(vehicle, parcel=parcel)
    try:
        inertia.laden(loaded)
    except ValueError as error:
        raise VehicleError(f"{where}: with it, {error}") from None
    return loaded


def with_parcels(fleet: Sequence[Vehicle]) -> list[Vehicle]:
    """The same vehicles, with a parcel on each that has a release. Raises VehicleError where none has one."""
    if not any(vehicle.release is not None for vehicle in fleet):
        with_parcel(fleet[0], {})
    return [vehicle if vehicle.release is None else with_parcel(vehicle, {}) for vehicle in fleet]


def read(folder: pathlib.Path) -> Vehicle:
    """A vehicle from a folder with `vehicle.toml` and `airframe.json`. Raises VehicleError."""
    toml, airframe = folder / TOML, folder / AIRFRAME
    where = str(toml)
    try:
        table = tomllib.loads(toml.read_text("utf-8"))
    except OSError as error:
        raise VehicleError(f"{toml}: {error.strerror}; a model's folder holds {TOML} and {AIRFRAME}") from None
    except ValueError as error:  # no UTF-8, no TOML, or a number of thousands of digits
        raise VehicleError(f"{where}: {error}") from None
    except RecursionError:
        raise VehicleError(f"{where}: nested too deeply; a vehicle needs tables in tables, and no more") from None
    file = record.read(_File, table, where)
    mass, moments = _mass_properties(file, where)
    if (file.propulsion is not None) + (file.chassis is not None) + (file.sih_rover is not None) != 1:
        raise VehicleError(f"{where}: there must be exactly one of the tables propulsion, chassis, sih_rover")
    if file.propulsion is not None and (file.gear is None or file.aerodynamics is None):
        raise VehicleError(f"{where}: with propulsion, the tables gear and aerodynamics are needed too")
    if file.propulsion is not None and not file.propulsion.rotors:
        raise VehicleError(f"{where}: propulsion: rotors = []; at least one is needed")
    if file.battery.cell_empty_v >= file.battery.cell_full_v:
        raise VehicleError(f"{where}: battery: cell_empty_v = {file.battery.cell_empty_v} must be below cell_full_v")
    _check_sensors(file.sensors, f"{where}: sensors")
    parameters = {"SIM_GPS_USED": file.sensors.gps.satellites, **_airframe(airframe)}
    return Vehicle(
        folder.name, file.description, mass, moments, file.battery, file.sensors, parameters,
        file.propulsion, file.aerodynamics, file.gear, file.chassis, file.sih_rover, file.camera, file.gimbal,
        file.depth, file.lidar, file.body, file.release, None, file.wind_is_px4s, file.ranging_beacons,
        file.motor_speed_max_rad_s,
    )  # fmt: skip


def _check_sensors(sensors: Sensors, where: str) -> None:
    """Raise VehicleError for figures that do not fit each other."""
    beam = sensors.lidar
    if beam is not None and beam.min_distance_m >= beam.max_distance_m:
        raise VehicleError(f"{where}: lidar: min_distance_m = {beam.min_distance_m} must be below max_distance_m")


def _receiver(name: str, where: str) -> Mapping[str, Any]:
    """All figures of a GNSS receiver. Raises VehicleError for an unknown one."""
    known: dict[str, dict[str, Any]] = tomllib.loads((FOLDER / RECEIVERS).read_text("utf-8"))
    if name not in known:
        raise VehicleError(f"{where} = {name!r}: known are {', '.join(known)}, or give its figures as a table")
    return known[name]


def _mass_properties(file: _File, where: str) -> tuple[float, Vector3]:
    if file.parts:
        if file.mass_kg is not None or file.inertia_kg_m2 is not None:
            raise VehicleError(f"{where}: mass_kg and inertia_kg_m2 follow from parts; give one or the other")
        try:
            whole = inertia.total(inertia.Cuboid(part.mass_kg, part.size_m, part.centre_m) for part in file.parts)
        except ValueError as error:
            raise VehicleError(f"{where}: parts: {error}") from None
        if not all(0.0 < moment < math.inf for moment in whole.inertia_kg_m2):
            raise VehicleError(f"{where}: parts: their inertia is {whole.inertia_kg_m2} kg m²; give them sizes")
        return whole.mass_kg, whole.inertia_kg_m2
    if file.mass_kg is None or file.inertia_kg_m2 is None:
        raise VehicleError(f"{where}: mass_kg and inertia_kg_m2 are needed, or parts")
    return file.mass_kg, file.inertia_kg_m2


def _airframe(path: pathlib.Path) -> dict[str, float | int]:
    where = str(path)
    try:
        table: Any = json.loads(path.read_text())
    except OSError as error:
        raise VehicleError(f"{path}: {error.strerror}; a model's folder holds {TOML} and {AIRFRAME}") from None
    except ValueError as error:
        raise VehicleError(f"{where}: {error}") from None
    except RecursionError:
        raise VehicleError(f"{where}: nested too deeply; it is a mapping of parameters' names to numbers") from None
    if not isinstance(table, dict):
        raise VehicleError(f"{where}: must be a mapping of parameters' names to their values")
    for name, value in table.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise VehicleError(f"{where}: {name} = {value!r} must be a number")
        if not abs(value) <= FLOAT32_MAX:  # NaN neither
            raise VehicleError(f"{where}: {name} = {value!r} must be a finite number, as a float32 too")
    return dict(table)
