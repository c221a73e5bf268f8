"""What a vehicle carries, camera and gimbal, beside an autopilot from outside: at the far ends of PX4's own links.

An autopilot of ours has them on its wires (`components`). A real PX4 has a link for a payload and one for a gimbal,
each with a port for what is at its other end: there the same state machines speak, in simulated time.
"""

from dataclasses import dataclass, field
from pathlib import Path

from sitl_emu.components.camera import Camera
from sitl_emu.components.card import Card
from sitl_emu.components.gimbal import Gimbal
from sitl_emu.components.video_stream import VideoStream
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.ports import LinkPorts
from sitl_emu.core.simulator_api import BesideMessage, CameraTrigger, CameraZoom, GimbalState, PictureTaken, VideoState
from sitl_emu.run.link_sockets import LinkSockets
from sitl_emu.vehicles import Vehicle


@dataclass
class _End:
    """The far end of a link, and the device that sits there."""

    name: str
    ports: LinkPorts
    device: Camera | Gimbal
    outbox: list[bytes] = field(init=False)

    def __post_init__(self) -> None:
        self.outbox = self.device.outbox


class Carried:
    """Camera and gimbal of one vehicle."""

    def __init__(self, vehicle: Vehicle, instance: int, root: Path | None, *, video: bool = False) -> None:
        """`root`: where the camera's pictures are kept, in the autopilot's file system; None: none are drawn.

        `video`: whether what the camera sees is sent to the ground station.

        Raises PortInUseError and OSError.
        """
        system_id = ports.system_id(instance)
        self._gimbal = Gimbal(vehicle.gimbal, system_id) if vehicle.gimbal is not None else None
        self._camera: Camera | None = None
        if vehicle.camera is not None:
            on_gimbal = self._gimbal is not None and vehicle.camera.mount == "gimbal"
            card = Card(root, vehicle.camera.vendor, vehicle.camera.model) if root is not None else None
            stream = VideoStream(ports.video(instance)) if video else None
            carried_by = mavlink.MAV_COMP_ID_GIMBAL if on_gimbal else 0
            self._camera = Camera(vehicle.camera, system_id, carried_by, card, stream)
        far = {"payload": (ports.payload(instance), self._camera), "gimbal": (ports.gimbal(instance), self._gimbal)}
        self._ends = [
            _End(f"far end of its {name}", LinkPorts(link.remote, link.local), device)
            for name, (link, device) in far.items()
            if device is not None
        ]
        self._sockets = LinkSockets(self._ends)
        self._looked: GimbalState | None = None
        self._zoomed = CameraZoom(0.0)
        self._video_told = VideoState(False)

    @property
    def on_payload_link(self) -> list[bytes] | None:
        """What is to be sent to the autopilot on its payload link; None where nobody has the far end."""
        return self._camera.outbox if self._camera is not None else None

    def step(self, now_us: int, pictures: list[PictureTaken]) -> list[BesideMessage]:
        """Hear and speak, once a tick; what an autopilot of ours would say of them beside its answer."""
        for index, end in enumerate(self._ends):
            for datagram in self._sockets.receive(index):
                end.device.on_datagram(now_us, datagram)
        if self._camera is not None:
            for picture in pictures:
                self._camera.picture_taken(now_us, *picture)
        for end in self._ends:
            if now_us >= end.device.due_us:
                end.device.on_time(now_us)
        self._sockets.flush()
        said = list[BesideMessage]()
        if self._gimbal is not None and (looks := GimbalState(self._gimbal.looks(now_us))) != self._looked:
            self._looked = looks
            said.append(looks)
        if self._camera is not None:
            if (zoom := CameraZoom(self._camera.zoom_percent(now_us))) != self._zoomed:
                self._zoomed = zoom
                said.append(zoom)
            said += [CameraTrigger(number) for number in self._camera.triggers]
            self._camera.triggers.clear()
            video = self._camera.video
            if video is not None and video.running != self._video_told.running:
                self._video_told = VideoState(video.running)
                said.append(self._video_told)
        return said
