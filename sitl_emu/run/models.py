"""Vehicles as runs and launches need them: checked against PX4's parameters, with what a scenario changes."""

import dataclasses
import math
from typing import TYPE_CHECKING

from sitl_emu import vehicles
from sitl_emu.autopilot import parameters
from sitl_emu.vehicles import Vehicle, VehicleError
from sitl_emu.vehicles.description import Camera

if TYPE_CHECKING:  # a `launch` has no configs, and is up 20 ms sooner without them
    from sitl_emu.run.configs import CameraDescription, ModelData


def load(model: str) -> Vehicle:
    """A vehicle by its name or its folder, for an autopilot of ours: its airframe names only what PX4 knows.

    Raises VehicleError.
    """
    vehicle = vehicles.load(model)
    known = parameters.table()
    for name in vehicle.airframe:
        if name not in known:
            raise VehicleError(f"{vehicle.model}/{vehicles.AIRFRAME}: {name}: PX4 v1.18 knows no such parameter")
    return vehicle


def as_set(data: "ModelData") -> Vehicle:
    """A scenario's vehicle, with its own sensors, parcel and camera. Raises VehicleError."""
    vehicle = vehicles.with_sensors(vehicles.load(data.model), data.sensors)
    if data.parcel is not None:
        vehicle = vehicles.with_parcel(vehicle, data.parcel)
    if vehicle.camera is None or data.camera is None:
        return vehicle
    return dataclasses.replace(vehicle, camera=_rendered(vehicle.camera, data.camera))


def _rendered(data: Camera, camera: "CameraDescription") -> Camera:
    """The vehicle's MAVLink camera, which says of itself what is rendered: the sensor keeps its width."""
    width_mm = data.sensor_width_mm
    body_mount = data.mount if data.mount != "gimbal" else "nadir"
    return dataclasses.replace(
        data,
        mount="gimbal" if camera.on_gimbal else body_mount,
        resolution_h_px=camera.width_px,
        resolution_v_px=camera.height_px,
        frame_rate_hz=camera.rate_hz,
        focal_length_mm=width_mm / 2.0 / math.tan(math.radians(camera.hfov_deg) / 2.0),
        sensor_height_mm=width_mm * camera.height_px / camera.width_px,
    )
