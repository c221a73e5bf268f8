"""The world process's side of ROS 2: what it tells, at every barrier, the process that publishes it.

Nobody waits for that process: where it can't follow, a barrier is left out, with the frames that arrived then.
"""

import math
from collections.abc import Sequence
from typing import Protocol

from sitl_emu.core.simulator_api import DistanceSensor, SimulatorMessage
from sitl_emu.run import poses
from sitl_emu.run.conductor import VehicleInRun
from sitl_emu.run.messages import FrameTaken, Message, RangeSeen, Seen, VehicleSeen


class Channel(Protocol):
    """A control channel that takes what there is room for."""

    def offer(self, message: Message) -> bool: ...  # noqa: D102


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

    def barrier(self, now_us: int, vehicles: Sequence[VehicleInRun], arrived: Sequence[tuple[FrameTaken, ...]]) -> None:
        """A barrier, with the frames that have reached each vehicle's companion."""
        seen = tuple(
            self._seen(place, vehicle, frames)
            for place, (vehicle, frames) in enumerate(zip(vehicles, arrived, strict=True))
        )
        self._channel.offer(Seen(now_us, seen))

    def _seen(self, place: int, vehicle: VehicleInRun, frames: tuple[FrameTaken, ...]) -> VehicleSeen:
        pose = poses.body(vehicle.simulator.pose())
        carried = any(feed.on_gimbal for feed in vehicle.feeds)
        head = poses.head_of(vehicle.gimbal, pose.q) if carried else None
        zoom = vehicle.zoom.percent if vehicle.zoom is not None else 0.0
        return VehicleSeen(pose, head, zoom, self._distances.pop(place, None), frames)


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
