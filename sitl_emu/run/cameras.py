"""The one description of a vehicle's rendered camera, from the vehicle's data and the scenario.

Renderer, companion (as a calibration file in the run's folder) and MAVLink camera all have it from here.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitl_emu.missions.companion import calibration
from sitl_emu.missions.companion.camera_model import CameraModel
from sitl_emu.missions.companion.camera_model import Distortion as ModelDistortion
from sitl_emu.missions.companion.camera_model import Mount as ModelMount
from sitl_emu.run.configs import CameraDescription
from sitl_emu.vehicles import image_sensor, record
from sitl_emu.vehicles.description import Camera, Vehicle, zoomed
from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world.lens import MOUNTS, Distortion, Intrinsics, Mount

PLAIN = Intrinsics()
"""Of a vehicle whose data list no camera."""


def intrinsics_of_data(camera: Camera | None) -> Intrinsics:
    """Picture size and field of view by a vehicle's data."""
    if camera is None:
        return PLAIN
    hfov_deg = 2.0 * math.degrees(math.atan2(camera.sensor_width_mm, 2.0 * camera.focal_length_mm))
    return Intrinsics(camera.resolution_h_px, camera.resolution_v_px, hfov_deg)


def of_data(vehicle: Vehicle) -> CameraDescription:
    """A vehicle's camera as its data have it, for pictures alone; the vehicle has one."""
    assert vehicle.camera is not None
    own, place = intrinsics_of_data(vehicle.camera), MOUNTS[vehicle.camera.mount]
    return CameraDescription(
        width_px=own.width,
        height_px=own.height,
        hfov_deg=own.hfov_deg,
        distortion=Distortion(),
        place_m=place[:3],
        depression_deg=place.depression_deg,
        on_gimbal=vehicle.camera.mount == "gimbal",
        rate_hz=vehicle.camera.frame_rate_hz,
        latency_s=0.0,
        sensor=sensor(None, vehicle.camera),
        zoom_max=vehicle.camera.zoom_max,
    )


def sensor(given: str | Mapping[str, Any] | None, data: Camera | None) -> ImageSensor | None:
    """The image sensor that a scenario gives, else the data's; None: the plain one. Raises VehicleError."""
    if isinstance(given, Mapping):
        return record.read(ImageSensor, given, "sensor")
    own = data.sensor if data is not None else image_sensor.PLAIN
    chosen = own if given is None else given
    return image_sensor.named(chosen) if isinstance(chosen, str) else chosen


def intrinsics(camera: CameraDescription) -> Intrinsics:
    """For the renderer."""
    return Intrinsics(camera.width_px, camera.height_px, camera.hfov_deg, Distortion(*camera.distortion))


def mount(camera: CameraDescription) -> Mount:
    """For the renderer."""
    return Mount(*camera.place_m, camera.depression_deg)


def zoom(camera: CameraDescription, percent: float) -> float:
    """For the renderer: the focal length over that of `intrinsics`, at so many percent of the camera's range."""
    return zoomed(camera.zoom_max, percent)


def model(camera: CameraDescription) -> CameraModel:
    """For a companion: square pixels, the principal point in the middle; of a camera that has not zoomed."""
    seen = intrinsics(camera)
    middle = (seen.width - 1) / 2.0, (seen.height - 1) / 2.0
    return CameraModel(
        seen.width,
        seen.height,
        seen.focal_px,
        seen.focal_px,
        *middle,
        ModelDistortion(*seen.distortion),
        camera.sensor.readout_s if camera.sensor is not None else 0.0,
    )


def write_calibration(path: Path, camera: CameraDescription) -> None:
    """The file that a companion reads. Raises OSError."""
    calibration.write(path, model(camera), ModelMount(*mount(camera), camera.on_gimbal))
