"""The detector at work: frames in, detections out, in a thread of its own.

One rule says which frames are left out: when `most_waiting` of them wait for the detector and one more comes, the
oldest that waits is dropped, and counted. On hardware one may wait, so that what is detected is as fresh as it can be.
In a simulated run any number may, and simulated time waits for the detector: a frame's detections are there
`latency_us` after it came, so that results don't depend on the CPU.

A frame at which the detector raises an exception is left out, too, and counted.
"""

import traceback
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

import cv2

from sitl_emu.missions.companion.camera import Frame, Image
from sitl_emu.missions.companion.detector import Detection

Detect = Callable[[Image, float], Sequence[Detection]]


def be_repeatable() -> None:
    """Makes OpenCV's results in this thread the same bits wherever a picture lies in memory, and on any run.

    Its IPP kernels (Intel's) are not so: with them detections came out an ulp different as memory was used differently
    (d33a35a6).
    """
    cv2.setNumThreads(1)
    cv2.ipp.setUseIPP(False)


MOST_FAILURES = 10
"""Frames in a row at which a detector may fail before it is taken to be of no use any more: a second or more of what
missions look at. Ours."""


class Looked(NamedTuple):
    """A frame, and what the detector found in it."""

    frame: Frame
    detections: Sequence[Detection]


class _Look(NamedTuple):
    frame: Frame
    due_us: int
    future: "Future[Sequence[Detection]]"


class Inference:
    """Runs a detector on the frames that it is given, one after the other."""

    def __init__(self, detect: Detect, latency_us: int = 0, most_waiting: int | None = 1) -> None:
        """`most_waiting` None: none is ever left out, and `due` waits for the detector."""
        self._detect, self._latency_us, self._most_waiting = detect, latency_us, most_waiting
        self._worker = ThreadPoolExecutor(1, "detector", initializer=be_repeatable)
        self._looks: deque[_Look] = deque()
        self.dropped = 0
        """Frames that were left out."""
        self.error = ""
        """How the detector has failed first, a line for people; "" while it has not."""
        self._failures = 0
        """At frames in a row, up to the last."""

    @property
    def has_failed(self) -> bool:
        """Whether the detector is of no use any more."""
        return self._failures >= MOST_FAILURES

    def look(self, now_us: int, frame: Frame, gsd_m: float) -> None:
        """Has the detector look at a frame; `gsd_m`: metres a pixel, 0 if that is not known."""
        if self._most_waiting is not None:
            waiting = [one for one in self._looks if not one.future.running() and not one.future.done()]
            for one in waiting[: len(waiting) + 1 - self._most_waiting]:
                if one.future.cancel():
                    self._looks.remove(one)
                    self.dropped += 1
        future = self._worker.submit(self._detect, frame.image, gsd_m)
        self._looks.append(_Look(frame, now_us + self._latency_us, future))

    def due(self, now_us: int) -> list[Looked]:
        """What was found in the frames that are due, in their order."""
        ready = list[Looked]()
        while self._looks and self._looks[0].due_us <= now_us:
            if self._most_waiting is not None and not self._looks[0].future.done():
                break
            one = self._looks.popleft()
            error = one.future.exception()
            if error is None:
                ready.append(Looked(one.frame, one.future.result()))
                self._failures = 0
            else:
                self._leave_out(error)
        return ready

    def close(self) -> None:
        """Ends the thread; what waits is left out."""
        self._worker.shutdown(cancel_futures=True)

    def _leave_out(self, error: BaseException) -> None:
        self.dropped, self._failures = self.dropped + 1, self._failures + 1
        if not self.error:
            self.error = " ".join(f"detector: {type(error).__name__}: {error}".split())
            traceback.print_exception(error)
