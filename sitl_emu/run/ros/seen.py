"""The world's side of ROS 2: what it tells, at every barrier, the process that publishes it.

Nobody waits for that process: where it can't follow, a barrier is left out, with the frames that arrived then. A launch
has no barriers, and tells it as often (`ros_line`).
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

from sitl_emu.core.simulator_api import CameraZoom, DistanceSensor, GimbalState, SimulatorMessage
from sitl_emu.run import poses
from sitl_emu.run.messages import FrameTaken, Message, RangeSeen, Seen, VehicleSeen

if TYPE_CHECKING:
    from sitl_emu.run.conductor import VehicleInRun


class Channel(Protocol):
    """A control channel that takes what there is room for."""

    def offer(self, message: Message) -> bool: ...  # noqa: D102


class Shown(NamedTuple):
    """A vehicle as it is at a barrier."""

    pose: poses.MovingPose
    on_gimbal: bool
    """Whether its gimbal carries a feed."""
    gimbal: GimbalState | None
    zoom: CameraZoom | None
    frames: tuple[FrameTaken, ...]
    """Those that have arrived since the last."""


class SeenByRos:
    """An `Onlooker` of the conductor's."""

    def __init__(self, channel: Channel) -> None:
        """To the process that publishes."""
        self._channel = channel
        self._distances: dict[int, RangeSeen] = {}

    def sensed(self, sensed: Sequence[Sequence[SimulatorMessage]]) -> None:
        """What each vehicle's sensors have said in a tick."""
        for place, messages in enumerate(sensed):
            for message in messages:
                if isinstance(message, DistanceSensor):
                    self._distances[place] = range_seen(message)

    def barrier(
        self, now_us: int, vehicles: "Sequence[VehicleInRun]", arrived: Sequence[tuple[FrameTaken, ...]]
    ) -> None:
        """A barrier, with the frames that have reached each vehicle's companion. Raises ProcessLostError."""
        self.tell(
            now_us,
            (
                Shown(each.simulator.pose(), any(feed.on_gimbal for feed in each.feeds), each.gimbal, each.zoom, frames)
                for each, frames in zip(vehicles, arrived, strict=True)
            ),
        )

    def tell(self, now_us: int, vehicles: Iterable[Shown], told_us: Callable[[int], int] = int) -> None:
        """What is so now. Raises ProcessLostError.

        `told_us`: as what a simulated time is told, where that is another.
        """
        seen = tuple(self._seen(place, vehicle, told_us) for place, vehicle in enumerate(vehicles))
        self._channel.offer(Seen(told_us(now_us), seen))

    def _seen(self, place: int, vehicle: Shown, told_us: Callable[[int], int]) -> VehicleSeen:
        pose = poses.body(vehicle.pose)
        head = poses.head_of(vehicle.gimbal, pose.q) if vehicle.on_gimbal else None
        zoom = vehicle.zoom.percent if vehicle.zoom is not None else 0.0
        distance = self._distances.pop(place, None)
        if distance is not None:
            distance = distance._replace(time_us=told_us(distance.time_us))
        frames = tuple(each._replace(time_us=told_us(each.time_us)) for each in vehicle.frames)
        return VehicleSeen(pose, head, zoom, distance, frames)


def range_seen(told: DistanceSensor) -> RangeSeen:
    """What DISTANCE_SENSOR says, in metres; beyond its range it is told as more than the greatest."""
    seen = told.current_distance <= told.max_distance
    return RangeSeen(
        1000 * told.time_boot_ms,
        told.current_distance / 100.0 if seen else math.inf,
        told.min_distance / 100.0,
        told.max_distance / 100.0,
        told.horizontal_fov,
        told.covariance * 1e-4,
    )
