"""Plugs into an autopilot what its vehicle carries that speaks MAVLink by itself, as its data list it."""

from typing import Protocol

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.components.camera import Camera
from sitl_emu.components.card import Card
from sitl_emu.components.gimbal import Gimbal
from sitl_emu.components.video_stream import VideoStream
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles import description


class Carrier(Protocol):
    """Whoever says what a vehicle carries: its data."""

    @property
    def camera(self) -> description.Camera | None: ...  # noqa: D102
    @property
    def gimbal(self) -> description.Gimbal | None: ...  # noqa: D102


def plug_in(
    vehicle: Carrier, autopilot: Autopilot, card: Card | None = None, video: VideoStream | None = None
) -> tuple[Camera | Gimbal, ...]:
    """Camera and gimbal, where there are any; they are returned.

    `card`: where the camera's pictures are kept; `video`: its stream.
    """
    system_id = autopilot.mavlink.system_id
    devices: list[Camera | Gimbal] = []
    if vehicle.gimbal is not None:
        gimbal = Gimbal(vehicle.gimbal, system_id)
        autopilot.mavlink.plug_in("gimbal device", "gimbal", gimbal)
        devices.append(gimbal)
    if vehicle.camera is not None:
        on_gimbal = vehicle.gimbal is not None and vehicle.camera.mount == "gimbal"
        carried_by = mavlink.MAV_COMP_ID_GIMBAL if on_gimbal else 0
        camera = Camera(vehicle.camera, system_id, carried_by, card, video)
        autopilot.mavlink.plug_in("camera", "wire", camera)
        devices.append(camera)
    return tuple(devices)
