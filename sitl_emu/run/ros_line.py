"""A launch's line to the process that tells ROS 2 of its world: `ros_process`, as a run has it.

As in a run nobody waits for that process; what it is told are dates, as PX4's topics bear them there: simulated time,
moved to the computer's clock at the speed 1 (`AutopilotHost.dds_start_us`); but where these jump back, here they go on
(`Dates`). It is told nothing while the vehicles run unthrottled: their clocks jump when that ends. When it has died the
launch flies on, and says so.
"""

import bisect
import socket
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from sitl_emu.core.simulator_api import SimulatorMessage
from sitl_emu.run.children import STOP_S, end_all, obituary_of_lost, start_process
from sitl_emu.run.configs import RosConfig, RosVehicleData
from sitl_emu.run.control import ControlChannel, ProcessLostError
from sitl_emu.run.messages import FrameTaken, Start
from sitl_emu.run.photographer import Photographer
from sitl_emu.run.range_feeds import RangeFeeds
from sitl_emu.run.ros.seen import SeenByRos, Shown
from sitl_emu.world.simulation import Simulation

EVERY_US = 20_000
"""A run's barriers."""
TITLE = "ros"
SLOWEST = 20
"""A date goes on by a twentieth of simulated time at least, until the clock that has jumped back is there, too."""
DATES_KEPT = 256
"""Five seconds of tellings: no frame is drawn as long."""


class Date(NamedTuple):
    """What a simulated time was told as."""

    time_us: int
    told_us: int


class Dates:
    """The dates of simulated times, by a clock that may jump; they themselves never go back.

    tf2 empties its buffer, and filters drop their state, where the time of a node goes back.
    """

    def __init__(self) -> None:
        self._known = deque[Date](maxlen=DATES_KEPT)

    def follow(self, now_us: int, clock_us: int) -> None:
        """That clock says `clock_us` now."""
        if self._known:
            last = self._known[-1]
            clock_us = max(clock_us, last.told_us + (now_us - last.time_us) // SLOWEST)
        self._known.append(Date(now_us, clock_us))

    def told_us(self, time_us: int) -> int:
        """The date of a time, once `follow` was called; between two of these calls it goes evenly."""
        place = bisect.bisect_left(self._known, time_us, key=lambda each: each.time_us)
        if place in (0, len(self._known)):
            nearest = self._known[max(0, place - 1)]
            return nearest.told_us + time_us - nearest.time_us
        before, after = self._known[place - 1], self._known[place]
        share_us = (after.told_us - before.told_us) * (time_us - before.time_us)
        return before.told_us + share_us // (after.time_us - before.time_us)


class RosLine:
    """Tells it, every 20 ms, of the vehicles that share a world."""

    def __init__(
        self,
        vehicles: Sequence[RosVehicleData],
        simulation: Simulation,
        photographer: Photographer | None,
        start_us: int,
        time_0_us: Callable[[], int | None],
        say: Callable[[str], None],
        ranges: RangeFeeds | None = None,
    ) -> None:
        """Start the process. Raises OSError.

        `vehicles` in the order of the simulation; `photographer` has frames drawn for those that have a camera,
        `ranges` measured for those that have a depth camera or a lidar, and is closed with the line.
        `start_us`: the date now; `time_0_us` tells that of simulated time 0, None where it is not known at the moment.
        """
        self._vehicles, self._simulation, self._photographer = vehicles, simulation, photographer
        self._start_us, self._time_0_us, self._say, self._ranges = start_us, time_0_us, say, ranges
        self._dates = Dates()
        self._due_us = self._began_us = 0
        self._ready = self._lost = False
        self._folder = tempfile.TemporaryDirectory(prefix="sitl_emu-")
        (Path(self._folder.name) / "logs").mkdir()
        config = RosConfig(
            folder=self._folder.name, start_us=start_us, seed=0, vehicles=tuple(vehicles), tells_clock=False
        )
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its:
            self._child = start_process(TITLE, "ros_process", config, its, Path(self._folder.name))
        self._control = ControlChannel(ours, TITLE)
        self._seen = SeenByRos(self._control)
        self._control.offer(Start())

    def begin(self) -> None:
        """From now on time goes at the asked speed."""
        self._began_us = self._now_us

    def sensed(self, sensed: Sequence[Sequence[SimulatorMessage]]) -> None:
        """What each vehicle's sensors have said in a tick."""
        if not self._lost:
            self._seen.sensed(sensed)

    def tell(self) -> None:
        """Tell what is so now, if that is due."""
        now_us = self._now_us
        if self._lost or now_us < self._due_us or (time_0_us := self._time_0_us()) is None:
            return
        self._due_us = max(self._due_us, now_us - EVERY_US) + EVERY_US
        self._dates.follow(now_us, now_us + time_0_us - self._start_us)
        frames = self._frames()
        shown = [self._shown(place, frames) for place in range(len(self._vehicles))]
        try:
            self._ready = self._ready or self._control.poll() is not None  # its Ready: else it would hear of old times
            if self._ready:
                self._seen.tell(now_us, shown, self._dates.told_us)
        except ProcessLostError:
            self._lose()
        if self._ranges is not None and self._ready and not self._lost:
            self._ranges.ask(now_us, self._photographer.gimbals if self._photographer is not None else {})

    def close(self) -> None:
        """End the process. May be called twice."""
        self._control.close()
        if self._ranges is not None:
            self._ranges.close()
        end_all([self._child], STOP_S)
        self._folder.cleanup()

    @property
    def _now_us(self) -> int:
        return self._simulation.simulators[0].time_usec

    def _frames(self) -> list[tuple[int, FrameTaken]]:
        """Those that were drawn or measured since this was asked last, with their vehicles' places."""
        frames = list[tuple[int, FrameTaken]]()
        if self._photographer is not None:
            frames += self._photographer.frames
            self._photographer.frames.clear()
        if self._ranges is not None:
            frames += self._ranges.measured()
            while self._ranges.complaints:
                self._say(self._ranges.complaints.pop())
        return [(place, frame) for place, frame in frames if frame.time_us >= self._began_us]

    def _shown(self, place: int, frames: Sequence[tuple[int, FrameTaken]]) -> Shown:
        pose, on_gimbal = self._simulation.simulators[place].pose(), self._vehicles[place].on_gimbal
        gimbal, zoom = None, None
        if self._photographer is not None:
            gimbal, zoom = self._photographer.gimbals.get(place), self._photographer.zooms.get(place)
        return Shown(pose, on_gimbal, gimbal, zoom, tuple(frame for whose, frame in frames if whose == place))

    def _lose(self) -> None:
        """The process has died: say so, and have nothing drawn for it."""
        self._lost = True
        self._control.close()
        self._say(f"ROS 2 hears nothing of the world any more: {obituary_of_lost(self._child)}")
        if self._photographer is not None:
            self._photographer.forget_frames()
        if self._ranges is not None:
            self._ranges.close()
