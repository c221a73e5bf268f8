"""What the processes of a run say to one another on their control channels, a record each, and its form as JSON.

They carry simulated time and counts of datagrams, so that every process steps when, and reads what, it should
(lockstep). The channel itself is in `control.py`.

====================  =====================================================================================
any → world           `Waiting`: set up, but for what others must have ready; answered by `Start`
any → world           `Ready`: set up
autopilot → world     `Sent` after every fifth tick; answered by `Read`
world → companion     `Step`; answered by `Stepped`
world → a feed        `Render`; answered by `Rendered`. `Photograph`, to a camera; answered by `Photographed`
world → camera        `SendVideo`
world → ros           `Seen` at every barrier, where there is room; nobody waits for it
world → any           `End`: the run is over
world → launcher      `Listening`, `Progress`, `EventTold`, `Over`
launcher → world      `Stop`, `CommandEnded`
world → launcher      `Kill`: a fault of the scenario; answered by `Killed` when the process is dead
====================  =====================================================================================
"""

import functools
import json
import types
import typing
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from sitl_emu.missions.companion.companion import Event, Status


class Waiting(NamedTuple):
    """Set up, but for what others must have ready."""


class Start(NamedTuple):
    """That is ready: an autopilot's simulator, a companion's camera."""

    simulator_port: int = 0
    """Where an autopilot finds its simulator."""


class Ready(NamedTuple):
    """Set up."""

    peer_port: int | None = None
    """Where a companion hears its peers, if it has any."""


class End(NamedTuple):
    """The run is over."""


class Sent(NamedTuple):
    """What an autopilot has sent to its companion since it said so last."""

    datagrams: int


class Read(NamedTuple):
    """What an autopilot is to read of its companion before its next tick."""

    datagrams: int
    obstacles: int = 0
    """Datagrams on its payload link, of those who tell it of obstacles."""


class FrameTaken(NamedTuple):
    """A frame of one of its feeds that has reached a companion, by its number in the ring."""

    feed: str
    """"camera", "depth" or "lidar"."""
    index: int  # type: ignore[assignment]  # hides tuple.index, which no frame needs
    time_us: int


class Step(NamedTuple):
    """A companion is to read so many datagrams and these frames, and to act."""

    now_us: int
    autopilot: int | None
    """None: whatever is there, of an autopilot from outside."""
    peer: int
    frames: tuple[FrameTaken, ...] = ()


class Stepped(NamedTuple):
    """What a companion did in a step: datagrams sent, where it stands, its events, and frames it lost in all."""

    autopilot: int
    peer: int
    status: Status
    events: tuple[Event, ...]
    dropped: int
    looks: bool = True
    """Whether it takes its camera's frames now."""


class BodyPose(NamedTuple):
    """Where a vehicle is, metres NED from the world's origin; its attitude: quaternion (w, x, y, z), body to NED."""

    north_m: float
    east_m: float
    down_m: float
    q: tuple[float, float, float, float]


class BodyMotion(NamedTuple):
    """How a vehicle moves: velocity NED, m/s, and angular rate in body axes FRD, rad/s."""

    velocity_m_s: tuple[float, float, float]
    rate_rad_s: tuple[float, float, float]


class LooseAt(NamedTuple):
    """Where a loose body is."""

    described: Mapping[str, Any]
    """As a world file has it: it may have been released after the camera began."""
    place: tuple[float, float, float]
    """Of its centre of mass, NED, m."""
    q: tuple[float, float, float, float]


class VehicleAt(NamedTuple):
    """Another vehicle, as a camera or a lidar may see it."""

    name: str
    model: str
    """As `sitl_emu.vehicles.load` takes it."""
    pose: BodyPose
    turning: bool
    """Whether its motors turn."""


class Render(NamedTuple):
    """A camera, depth camera or lidar is to make a frame."""

    index: int  # type: ignore[assignment]
    time_us: int
    pose: BodyPose
    head: tuple[float, float, float, float] | None = None
    """Attitude of the gimbal's head that carries it: quaternion (w, x, y, z), to NED; None: none does."""
    loose: tuple[LooseAt, ...] = ()
    others: tuple[VehicleAt, ...] = ()
    motion: BodyMotion | None = None
    """None: it stands still."""
    zoom_percent: float = 0.0
    """Of a camera: how far it has zoomed, of its range."""
    keep: bool = False
    """Whether the run's folder is to have it (`kept_frames`)."""


class ObstaclesSeen(NamedTuple):
    """What a frame shows of the obstacles around, as OBSTACLE_DISTANCE has it; cm."""

    distances: tuple[int, ...]
    nearest: int
    farthest: int


class Rendered(NamedTuple):
    """It has made it."""

    index: int  # type: ignore[assignment]
    obstacles: ObstaclesSeen | None = None
    """None where the autopilot is not told of any, or none can be seen."""


class Photograph(NamedTuple):
    """A camera is to draw a picture of its MAVLink camera's card, as JPEG."""

    number: int
    time_us: int
    pose: BodyPose
    head: tuple[float, float, float, float] | None
    """As of `Render`."""
    loose: tuple[LooseAt, ...] = ()
    others: tuple[VehicleAt, ...] = ()
    motion: BodyMotion | None = None
    zoom_percent: float = 0.0


class Photographed(NamedTuple):
    """It is there."""

    number: int


class SendVideo(NamedTuple):
    """A camera is to send its frames as video from now on, or no more."""

    running: bool


class RangeSeen(NamedTuple):
    """What a range finder has said."""

    time_us: int
    range_m: float
    """inf: nothing is within its range."""
    nearest_m: float
    farthest_m: float
    field_of_view_rad: float
    variance_m2: float


class VehicleSeen(NamedTuple):
    """What ROS 2 is told of a vehicle at a barrier."""

    pose: BodyPose
    head: tuple[float, float, float, float] | None
    """As of `Render`."""
    zoom_percent: float
    distance: RangeSeen | None
    """What its range finder has said since the last barrier, if anything."""
    frames: tuple[FrameTaken, ...]
    """Those that arrived, as at its companion."""


class Seen(NamedTuple):
    """What ROS 2 is told at a barrier: the time, and of each vehicle, in their order."""

    now_us: int
    vehicles: tuple[VehicleSeen, ...]


class Listening(NamedTuple):
    """The world stands, and waits for its autopilots."""

    truth: Mapping[str, Any]
    """`World.truth` of the start."""
    home: tuple[float, ...]
    """`World.home`."""


class VehicleProgress(NamedTuple):
    """How far a vehicle is."""

    armed: bool
    status: Status | None
    """Its companion's; None of one from outside, and before the first step."""
    position_m: tuple[float, float, float]
    """North, east and up of the world's origin."""
    frames: int | None
    """Taken by its camera; None where it has none."""


class Progress(NamedTuple):
    """How far a run is: simulated time, the time it took, and its vehicles."""

    time_s: float
    wall_s: float
    vehicles: Mapping[str, VehicleProgress]


class EventTold(NamedTuple):
    """An event of a vehicle, when it was told."""

    time_s: float
    vehicle: str
    event: Event


class RadioCounts(NamedTuple):
    """Datagrams of one direction of a radio link."""

    sent: int
    lost: int


class Figures(NamedTuple):
    """What a run was, in numbers."""

    simulated_s: float
    wall_s: float
    speed_factor: float | None
    """From the first arming to the last disarming; None where nothing armed."""
    frames_rendered: int
    frames_dropped: int
    radio: Mapping[str, RadioCounts]
    armed_at_end: tuple[str, ...]
    companions: Mapping[str, Status | None]


class Over(NamedTuple):
    """How a run ended."""

    outcome: str
    lost: str = ""
    """Which process has gone; empty where none has."""
    faults: tuple[str, ...] = ()
    """Of the scenario: those that came, and those whose events did not."""
    faults_left: tuple[str, ...] = ()
    figures: Figures | None = None
    """None of a run that never began."""


class Stop(NamedTuple):
    """The run is to end now."""

    why: str


class CommandEnded(NamedTuple):
    """A companion that is a command of the user's has ended."""

    vehicle: str
    exit_status: int


class Kill(NamedTuple):
    """A process is to be killed, "companion uas" say."""

    title: str


class Killed(NamedTuple):
    """It is dead."""

    title: str


FromWorld = Listening | Progress | EventTold | Kill | Over
"""To the launcher."""
FromLauncher = Stop | CommandEnded | Killed
Message = (
    Waiting
    | Start
    | Ready
    | End
    | Sent
    | Read
    | Step
    | Stepped
    | Render
    | Rendered
    | Photograph
    | Photographed
    | SendVideo
    | Seen
    | FromWorld
    | FromLauncher
)
KINDS: dict[str, Any] = {kind.__name__: kind for kind in typing.get_args(Message)}


def encoded(message: Message) -> bytes:
    """A message as JSON: the name of its kind, and its fields in their order."""
    return json.dumps((type(message).__name__, message), separators=(",", ":")).encode()


def decoded(data: bytes | bytearray) -> Message:
    """The message that `encoded` wrote, its parts records again."""
    name, fields = json.loads(data)
    message: Message = _built(KINDS[name], fields)
    return message


Build = Callable[[Any], Any]


def _built(record: Any, values: list[Any]) -> Any:
    """A record from its fields' values in JSON."""
    builders = _builders(record)
    return record._make(
        [value if build is None else build(value) for build, value in zip(builders, values, strict=True)]
    )


@functools.cache
def _builders(record: Any) -> tuple[Build | None, ...]:
    hints = typing.get_type_hints(record)
    return tuple(_builder(hints[name]) for name in record._fields)


def _builder(hint: Any) -> Build | None:
    """What makes a value of a type from JSON's; None where they are the same."""
    if hasattr(hint, "_fields"):
        return functools.partial(_built, hint)
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        built = next(filter(None, map(_builder, inner)), None)
        return None if built is None else functools.partial(_if_any, built)
    if origin is tuple:
        return functools.partial(_sequence, _builder(inner[0]))
    built = _builder(inner[1]) if origin in (dict, Mapping) else None
    return None if built is None else functools.partial(_mapping, built)


def _if_any(build: Build, value: Any) -> Any:
    return None if value is None else build(value)


def _sequence(build: Build | None, values: list[Any]) -> tuple[Any, ...]:
    return tuple(values) if build is None else tuple([build(value) for value in values])


def _mapping(build: Build, values: dict[str, Any]) -> dict[str, Any]:
    return {name: build(value) for name, value in values.items()}
