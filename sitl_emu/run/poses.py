"""From where a vehicle's feeds look and what is there to be seen, as the processes that make their frames are told."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

from sitl_emu.core import attitude
from sitl_emu.core.attitude import Quaternion
from sitl_emu.core.simulator_api import CameraZoom, GimbalState
from sitl_emu.run.messages import BodyMotion, BodyPose, LooseAt, VehicleAt
from sitl_emu.world.description import plain
from sitl_emu.world.obstacles import LoosePose

LEVEL = GimbalState((1.0, 0.0, 0.0, 0.0))
"""A gimbal that was not heard of yet looks straight ahead."""


class SeenFrom(NamedTuple):
    """From where a frame is taken, and what moves: the last fields of `Render` and of `Photograph`."""

    pose: BodyPose
    head: Quaternion | None
    """Where the vehicle's gimbal looks, if that carries the feed."""
    loose: tuple[LooseAt, ...]
    others: tuple[VehicleAt, ...]
    motion: BodyMotion
    zoom_percent: float


class MovingPose(Protocol):
    """A simulator's true pose, NED, and how it changes."""

    @property
    def north_m(self) -> float: ...  # noqa: D102
    @property
    def east_m(self) -> float: ...  # noqa: D102
    @property
    def down_m(self) -> float: ...  # noqa: D102
    @property
    def q(self) -> Quaternion: ...  # noqa: D102
    @property
    def vn_m_s(self) -> float: ...  # noqa: D102
    @property
    def ve_m_s(self) -> float: ...  # noqa: D102
    @property
    def vd_m_s(self) -> float: ...  # noqa: D102
    @property
    def rate_rad_s(self) -> tuple[float, float, float]: ...  # noqa: D102


def body(pose: MovingPose) -> BodyPose:
    """The pose alone."""
    return BodyPose(pose.north_m, pose.east_m, pose.down_m, pose.q)


def seen_from(
    pose: MovingPose,
    on_gimbal: bool,
    gimbal: GimbalState | None,
    loose: Sequence[LoosePose],
    others: Iterable[VehicleAt],
    zoom: CameraZoom | None = None,
) -> SeenFrom:
    """What is seen from a vehicle: where it is, where its gimbal looks if that carries the feed, and all that moves.

    `zoom`: the feed's; None: it has none.
    """
    where = body(pose)
    head = head_of(gimbal, where.q) if on_gimbal else None
    bodies = tuple(LooseAt(plain(each), place, q) for each, place, q, _ in loose)
    motion = BodyMotion((pose.vn_m_s, pose.ve_m_s, pose.vd_m_s), pose.rate_rad_s)
    return SeenFrom(where, head, bodies, tuple(others), motion, zoom.percent if zoom is not None else 0.0)


def head_of(gimbal: GimbalState | None, vehicle: Quaternion) -> Quaternion:
    """The attitude (to NED) of a gimbal's head: it turns with the vehicle's heading alone."""
    turned = attitude.quaternion(0.0, 0.0, attitude.heading(vehicle))
    return attitude.product(turned, (gimbal or LEVEL).q)
