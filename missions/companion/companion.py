"""What a companion computer's program is: a state machine on time that is handed to it.

One harness (`harness.py`) calls the methods below and sends what they return, on hardware and in a simulated run; it is
stepped by whoever has the clock, `main.py` or the run's companion process. The same program runs on both.

Two times: `now_us` is the runner's clock (simulated, or monotonic), good for time limits; `frame_time_us` is the
vehicle's boot time at which a frame was taken, good for finding the pose in the telemetry.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sitl_emu.core import dialect as mavlink
    from sitl_emu.missions.companion.camera import Image
    from sitl_emu.missions.companion.detector import Detection
    from sitl_emu.missions.companion.feeds import Cloud, Depth

AUTOPILOT_LINK = "autopilot"
PEER_LINK = "peer"
COMPONENT_ID = 191
"""MAV_COMP_ID_ONBOARD_COMPUTER."""

Outgoing = list[tuple[str, "mavlink.MAVLink_message"]]
"""Messages to send, each with the name of its link. One that was received is passed on as it came (`wire.py`)."""


class Status(NamedTuple):
    """How far a companion is. `outcome` is "success" or what failed, "" until it is known; `done`: nothing left to
    do."""

    phase: str
    progress: float
    done: bool
    outcome: str
    text: str
    counts: Mapping[str, int] = {}
    """Figures of a companion's own that summary.json and the report are to show, by what they count."""


class Event(NamedTuple):
    """Something worth a line in the run's events: what happened, for people, and its figures.

    `kind` is a word of the mission's own; every mission has phase, text, yielded and resumed (`onboard.py`). An event
    may name a frame (`frame_time_us`) and a box in it (`x`, `y`, `w`, `h` in pixels, centre and size): it gets a
    picture.
    """

    time_us: int
    kind: str
    text: str
    data: Mapping[str, float | int | str]

    @property
    def line(self) -> dict[str, float | int | str]:
        """As events.jsonl has it, but for its time and vehicle; a text that is empty is left out."""
        return {"event": self.kind, **({"text": self.text} if self.text else {}), **self.data}


class Companion(Protocol):
    """A program for a companion computer."""

    @property
    def system_id(self) -> int:
        """MAVLink system of its vehicle, 0 until the autopilot was heard; nothing is sent before."""
        ...

    @property
    def status(self) -> Status:
        """Where it stands now."""
        ...

    def on_message(self, now_us: int, link: str, msg: "mavlink.MAVLink_message") -> Outgoing:
        """A message came in on a link."""
        ...

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Whether a frame is worth running the detector on: its ground sampling distance in m a pixel, or None.

        0.0 stands for "yes, but the distance is not known". To be asked when the frame is there.
        """
        ...

    def detect(self, image: "Image", gsd_m: float) -> "Sequence[Detection]":
        """Runs the mission's detector on a picture that was wanted. The one method that another thread may call."""
        ...

    def on_detections(self, now_us: int, frame_time_us: int, detections: "Sequence[Detection]") -> Outgoing:
        """What the detector found in a frame that was wanted, also when it found nothing."""
        ...

    def on_time(self, now_us: int) -> Outgoing:
        """Time has passed; to be called at 20 Hz or more often."""
        ...

    def events(self) -> list[Event]:
        """The events since the last call."""
        ...


class Candidate(NamedTuple):
    """What may become a target: a place that was seen, and is not confirmed yet."""

    label: str
    score: float
    lat_deg: float
    lon_deg: float
    sigma_m: float
    """Standard deviation of the place, horizontally."""
    sightings: int
    """In how many frames it was seen."""


@runtime_checkable
class HasCandidates(Protocol):
    """What a companion has beside that can tell what it may confirm next; for those who look on."""

    def candidates(self) -> "Sequence[Candidate]":
        """As they are now."""
        ...


@runtime_checkable
class LooksAtTimes(Protocol):
    """What a companion has beside that does not want frames all the time; any other is taken to want them."""

    @property
    def looks(self) -> bool:
        """Whether it wants frames from now on."""
        ...


@runtime_checkable
class Fails(Protocol):
    """What a companion has beside that can end its mission early; any other goes on without its detector."""

    def fail(self, why: str) -> None:
        """It can't see any more: ends the mission, if it needs to see now, and brings the vehicle home."""
        ...


@runtime_checkable
class SeesRanges(Protocol):
    """What a companion has beside that wants depth images and point clouds; any other is not given them."""

    def on_ranges(self, now_us: int, ranges: "Depth | Cloud") -> Outgoing:
        """A depth image or a scan has come."""
        ...
