"""A feed of a vehicle in a run: frames and pictures asked of its process, and when they arrive.

A frame taken at t reaches the companion at t + latency: until then its process is at work on it, beside the ticks.
While nobody looks, only those are made that the run's folder keeps, one a second (`kept_frames`).
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from sitl_emu.core.simulator_api import PictureTaken
from sitl_emu.run import kept_frames
from sitl_emu.run.messages import (
    FrameTaken,
    Message,
    ObstaclesSeen,
    Photograph,
    Photographed,
    Render,
    Rendered,
)
from sitl_emu.run.poses import SeenFrom

Kind = TypeVar("Kind", bound=Message)
TICKS_PER_SECOND = 250
PICTURE_US = 200_000
"""From a MAVLink camera's shutter to its file: ours, as long as a frame and its JPEG take in wall time, and more."""


class Control(Protocol):
    """An end of a control channel."""

    def send(self, message: Message) -> None: ...  # noqa: D102
    def receive(self) -> Message: ...  # noqa: D102
    def expect(self, kind: type[Kind]) -> Kind: ...  # noqa: D102


@dataclass
class FeedInRun:
    """A vehicle's camera, depth camera or lidar, and its frames on their way to the companion."""

    feed: str
    """Which of these."""
    control: Control
    rate_hz: float
    latency_us: int
    on_gimbal: bool = False
    due: int = 0
    """How many frames have been due so far."""
    rendered: int = 0
    """How many of these were made: a frame's index counts them alone, as its ring does."""
    under_way: deque[FrameTaken] = field(default_factory=deque)
    """Frames asked for and not yet delivered."""
    finished: int = -1
    """Index of the last frame that its process has done."""
    photographs: deque[tuple[int, int]] = field(default_factory=deque)
    """Pictures of the MAVLink camera asked for: number, and when the autopilot is told that they are there."""
    photographed: int = 0
    """Number of the last of these that its process has done."""
    obstacles: dict[int, ObstaclesSeen] = field(default_factory=dict)
    """What frames that are not yet delivered show, by their index."""

    def due_tick(self) -> int:
        """The tick at which the next frame is taken."""
        return round((self.due + 1) * TICKS_PER_SECOND / self.rate_hz)

    @property
    def keeps_next(self) -> bool:
        """Whether the next frame is one that is kept."""
        return self.due % kept_frames.every(self.rate_hz) == 0

    def leave_out(self) -> None:
        """The next frame is not made."""
        self.due += 1

    def take(self, now_us: int, seen_from: SeenFrom) -> None:
        """Ask for the next frame."""
        self.control.send(Render(self.rendered, now_us, *seen_from, self.keeps_next))
        self.due += 1
        self.under_way.append(FrameTaken(self.feed, self.rendered, now_us))
        self.rendered += 1

    def arrived(self, now_us: int) -> Iterator[tuple[FrameTaken, ObstaclesSeen | None]]:
        """The frames whose latency is over, and what obstacles they show; waits until they are made."""
        while self.under_way and self.under_way[0].time_us + self.latency_us <= now_us:
            frame = self.under_way.popleft()
            self._wait_for_frame(frame.index)
            yield frame, self.obstacles.pop(frame.index, None)

    def photograph(self, number: int, now_us: int, seen_from: SeenFrom) -> None:
        """Ask for a picture of the MAVLink camera."""
        self.control.send(Photograph(number, now_us, *seen_from))
        self.photographs.append((number, now_us + PICTURE_US))

    def pictures_told(self, now_us: int) -> Iterator[PictureTaken]:
        """What the autopilot is told now of pictures that are there; waits until they are drawn."""
        while self.photographs and self.photographs[0][1] <= now_us:
            number, _ = self.photographs.popleft()
            while self.photographed < number:
                self._hear()
            yield PictureTaken(number, True)

    def finish(self) -> None:
        """Wait for all frames that were asked for."""
        self._wait_for_frame(self.rendered - 1)

    def _wait_for_frame(self, index: int) -> None:
        while self.finished < index:
            self._hear()

    def _hear(self) -> None:
        message = self.control.receive()
        if isinstance(message, Rendered):
            self.finished = message.index
            if message.obstacles is not None:
                self.obstacles[message.index] = message.obstacles
        elif isinstance(message, Photographed):
            self.photographed = message.number
