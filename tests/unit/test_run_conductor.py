"""The conductor on fakes: who is told what at a barrier, and that results don't depend on who is slow."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeVar

import pytest

from sitl_emu.core.radio import RadioSettings
from sitl_emu.core.simulator_api import (
    BesideMessage,
    CameraTrigger,
    CameraZoom,
    GimbalState,
    HilActuatorControls,
    HilSensor,
    PictureTaken,
    SimulatorMessage,
    SimulatorParameter,
    VideoState,
)
from sitl_emu.missions.companion.companion import Event, Status
from sitl_emu.run.conductor import Conductor, VehicleInRun
from sitl_emu.run.feed_in_run import Control, FeedInRun
from sitl_emu.run.messages import (
    BodyPose,
    FrameTaken,
    Message,
    ObstaclesSeen,
    Photograph,
    Photographed,
    Read,
    Render,
    Rendered,
    SendVideo,
    Sent,
    Step,
    Stepped,
)
from sitl_emu.world.contacts import Impact
from sitl_emu.world.description import Loose
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.parcels import ParcelTold
from tests.typed import now

Kind = TypeVar("Kind", bound=Message)


class FakePose(NamedTuple):
    north_m: float
    east_m: float = 0.0
    down_m: float = 0.0
    vn_m_s: float = 3.0
    ve_m_s: float = 0.0
    vd_m_s: float = 0.0
    q: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    rate_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.5)


class FakeSimulator:
    def __init__(self, north_m: float) -> None:
        self.north_m = north_m

    def pose(self) -> FakePose:
        return FakePose(self.north_m)


class FakeSimulation:
    def __init__(self) -> None:
        self.ticks = 0
        self.told: list[tuple[int, int, str, float]] = []
        self.met: dict[int, Impact] = {}
        """By tick."""

    def parcels_told(self) -> list[ParcelTold]:
        return []

    def impacts(self) -> list[Impact]:
        return [self.met[self.ticks]] if self.ticks in self.met else []

    def loose_poses(self) -> list[LoosePose]:
        return [LoosePose(Loose("barrel", 0.0, 0.0, mass_kg=9.0), (1.0, 2.0, -3.0), (1.0, 0.0, 0.0, 0.0))]

    def set_parameter(self, place: int, name: str, value: float) -> None:
        self.told.append((self.ticks, place, name, value))

    def tick(self, controls: Sequence[HilActuatorControls | None]) -> list[list[SimulatorMessage]]:
        assert all((last is None) == (self.ticks == 0) for last in controls)
        self.ticks += 1
        return [[HilSensor._make((self.ticks * 4000, *[0.0] * 13, 0, 0))] for _ in controls]


class FakeChannel:
    """An autopilot that arms on its tenth tick, and says `says` beside its answers."""

    def __init__(self, says: dict[int, BesideMessage] | None = None) -> None:
        self.time = 0
        self._says = says or {}
        self.pictures: list[tuple[int, PictureTaken]] = []

    def send(self, messages: list[SimulatorMessage]) -> None:
        assert isinstance(messages[-1], HilSensor)
        self.time = messages[-1].time_usec
        self.pictures += [(self.time, message) for message in messages if isinstance(message, PictureTaken)]

    def receive(self) -> HilActuatorControls:
        return HilActuatorControls(self.time, 1, (0.0,), 128 if self.time >= 40000 else 0)

    def beside(self) -> list[BesideMessage]:
        said = self._says.pop(self.time, None)
        return [] if said is None else [said]


class FakeControl:
    """Keeps what it was told; says what `answers` yields."""

    def __init__(self, answers: Any) -> None:
        self.told: list[Message] = []
        self._answers = answers

    def send(self, message: Message) -> None:
        self.told.append(message)

    def receive(self) -> Message:
        answer: Message = next(self._answers)
        return answer

    def expect(self, kind: type[Kind]) -> Kind:
        answer = next(self._answers)
        assert isinstance(answer, kind)
        return answer


class FakePeer:
    def __init__(self, to_radio: list[bytes]) -> None:
        self.to_radio, self.from_radio = deque(to_radio), list[bytes]()

    def receive(self, exactly: int | None) -> list[bytes]:
        count = len(self.to_radio) if exactly is None else exactly
        return [self.to_radio.popleft() for _ in range(count)]

    def send(self, data: bytes) -> None:
        self.from_radio.append(data)


class FakeRecorder:
    def __init__(self) -> None:
        self.events: list[tuple[int, str, str]] = []
        self.truths: list[tuple[int, str]] = []

    def event(self, vehicle: str, event: Event) -> None:
        self.events.append((event.time_us, vehicle, event.kind))

    def truth(self, now_us: int, vehicle: str, pose: Any) -> None:
        self.truths.append((now_us, vehicle))

    def loose(self, now_us: int, poses: Any) -> None:
        pass


def reply(
    autopilot: int = 0, peer: int = 0, done: bool = False, outcome: str = "success", looks: bool = True
) -> Stepped:
    return Stepped(autopilot, peer, Status("x", 0.0, done, outcome, ""), (), 0, looks)


def vehicle(
    name: str,
    replies: list[Stepped],
    north_m: float = 0.0,
    peer: FakePeer | None = None,
    says: dict[int, BesideMessage] | None = None,
) -> VehicleInRun:
    autopilot = FakeControl(Sent(n) for n in range(1, 100))
    return VehicleInRun(
        name, FakeSimulator(north_m), FakeChannel(says), autopilot, FakeControl(iter(replies)), peer=peer
    )


def told(control: Control | None, kind: type[Kind]) -> list[Kind]:
    """What a process was told, whose control is a fake: messages of one kind, and no others."""
    assert isinstance(control, FakeControl)
    assert all(isinstance(message, kind) for message in control.told)
    return [message for message in control.told if isinstance(message, kind)]


def run_ticks(conductor: Conductor, ticks: int) -> None:
    for _ in range(ticks):
        conductor.tick()


def test_a_companion_is_stepped_every_fifth_tick_with_what_its_autopilot_sent() -> None:
    one = vehicle("one", [reply(), reply()])
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 14)
    assert told(one.companion, Step) == [Step(20000, 1, 0, ()), Step(40000, 2, 0, ())]


def test_what_a_companion_sent_in_one_step_is_read_by_its_autopilot_at_the_next_barrier() -> None:
    one = vehicle("one", [reply(autopilot=3), reply(autopilot=0), reply(autopilot=5)])
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 20)
    assert told(one.autopilot, Read) == [Read(0), Read(3), Read(0), Read(5)]


def test_datagrams_cross_the_radio_after_its_latency() -> None:
    near, far = FakePeer([b"hello"]), FakePeer([])
    one = vehicle("one", [reply(peer=1)] + [reply()] * 9, peer=near)
    two = vehicle("two", [reply()] * 10, north_m=50.0, peer=far)
    settings = RadioSettings(range_m=100.0, latency_s=0.05, bandwidth_bit_s=1e9)
    run_ticks(Conductor([one, two], FakeSimulation(), settings, 1, FakeRecorder()), 25)
    assert [step.peer for step in told(two.companion, Step)] == [0, 0, 0, 0, 1]
    assert far.from_radio == [b"hello"] and not near.from_radio


def test_beyond_the_range_nothing_arrives() -> None:
    one = vehicle("one", [reply(peer=1)] + [reply()] * 9, peer=FakePeer([b"hello"]))
    two = vehicle("two", [reply()] * 10, north_m=101.0, peer=FakePeer([]))
    conductor = Conductor([one, two], FakeSimulation(), RadioSettings(range_m=100.0, latency_s=0.0), 1, FakeRecorder())
    run_ticks(conductor, 40)
    assert sum(step.peer for step in told(two.companion, Step)) == 0
    assert conductor.radio_counts == {"one>two": (1, 1), "two>one": (0, 0)}


def test_a_frame_is_delivered_at_the_first_barrier_after_its_latency_and_waited_for() -> None:
    one = vehicle("one", [reply()] * 20)
    camera = FeedInRun("camera", FakeControl(Rendered(index) for index in range(10)), 15.0, 100_000)
    one.feeds = [camera]
    conductor = Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder())
    run_ticks(conductor, 75)
    taken = {asked.index: asked.time_us for asked in told(camera.control, Render)}
    (loose,) = told(camera.control, Render)[0].loose
    assert loose.described["name"] == "barrel" and loose.place == (1.0, 2.0, -3.0)
    assert taken == {0: 68000, 1: 132000, 2: 200000, 3: 268000}
    delivered = [(frame, step.now_us) for step in told(one.companion, Step) for frame in step.frames]
    assert delivered == [
        (FrameTaken("camera", 0, 68000), 180000),
        (FrameTaken("camera", 1, 132000), 240000),
        (FrameTaken("camera", 2, 200000), 300000),
    ]


LOOKS_FROM_A_SECOND_ON = [*[reply(looks=False)] * 50, *[reply()] * 30]


def test_while_nobody_looks_only_what_is_kept_is_drawn_and_indices_count_what_was_drawn() -> None:
    one = vehicle("one", LOOKS_FROM_A_SECOND_ON)
    camera = FeedInRun("camera", FakeControl(Rendered(index) for index in range(20)), 5.0, 100_000)
    lidar = FeedInRun("lidar", FakeControl(Rendered(index) for index in range(20)), 5.0, 100_000)
    one.feeds = [camera, lidar]
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 375)
    drawn = [(asked.index, asked.time_us // 1000, asked.keep) for asked in told(camera.control, Render)]
    assert drawn == [(0, 200, True), (1, 1200, True), (2, 1400, False)]
    assert [asked.time_us // 1000 for asked in told(lidar.control, Render)] == [200, 400, 600, 800, 1000, 1200, 1400]
    delivered = [frame for step in told(one.companion, Step) for frame in step.frames if frame.feed == "camera"]
    assert [(frame.index, frame.time_us // 1000) for frame in delivered] == [(0, 200), (1, 1200), (2, 1400)]


class FakeOnlooker:
    def sensed(self, sensed: Sequence[Sequence[SimulatorMessage]]) -> None: ...
    def barrier(
        self, now_us: int, vehicles: Sequence[VehicleInRun], arrived: Sequence[tuple[FrameTaken, ...]]
    ) -> None: ...


@pytest.mark.parametrize(("video", "onlooker"), [(True, None), (False, FakeOnlooker())])
def test_for_a_ground_station_or_ros_all_are_drawn(video: bool, onlooker: FakeOnlooker | None) -> None:
    one = vehicle("one", LOOKS_FROM_A_SECOND_ON, says={4000: VideoState(True)} if video else None)
    camera = FeedInRun("camera", FakeControl(Rendered(index) for index in range(20)), 5.0, 100_000)
    one.feeds = [camera]
    conductor = Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder(), onlooker=onlooker)
    run_ticks(conductor, 250)
    assert camera.rendered == 5


def test_each_feed_has_a_rate_and_a_latency_of_its_own() -> None:
    one = vehicle("one", [reply()] * 20)
    lidar = FeedInRun("lidar", FakeControl(Rendered(index) for index in range(10)), 10.0, 40_000)
    depth = FeedInRun("depth", FakeControl(Rendered(index) for index in range(10)), 5.0, 0)
    one.feeds = [lidar, depth]
    conductor = Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder())
    run_ticks(conductor, 65)
    arrived = [
        (step.now_us, [(frame.feed, frame.time_us) for frame in step.frames]) for step in told(one.companion, Step)
    ]
    assert [row for row in arrived if row[1]] == [
        (140_000, [("lidar", 100_000)]),
        (200_000, [("depth", 200_000)]),
        (240_000, [("lidar", 200_000)]),
    ]
    conductor.finish()
    assert (lidar.finished, depth.finished) == (lidar.rendered - 1, depth.rendered - 1) == (1, 0)


class FakeObstacleLink:
    """Keeps what was told; sends that at once, and a heartbeat with it."""

    def __init__(self) -> None:
        self.told = list[tuple[FrameTaken, ObstaclesSeen]]()
        self._unsent = 0

    def tell(self, frame: FrameTaken, obstacles: ObstaclesSeen) -> None:
        self.told.append((frame, obstacles))
        self._unsent += 1

    def send(self, now_us: int) -> int:
        sent, self._unsent = self._unsent + 1, 0
        return sent


def test_an_autopilot_is_told_what_a_frame_shows_of_obstacles_when_it_has_arrived() -> None:
    one, seen = vehicle("one", [reply(autopilot=3)] * 20), ObstaclesSeen((100,) * 72, 50, 4000)
    made = (Rendered(index, seen if index != 1 else None) for index in range(10))
    one.feeds = [FeedInRun("lidar", FakeControl(made), 10.0, 40_000)]
    one.obstacle_link = link = FakeObstacleLink()
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 85)
    assert link.told == [
        (FrameTaken("lidar", 0, 100_000), seen),
        (FrameTaken("lidar", 2, 300_000), seen),
    ], "the second shows nothing"
    read = {20_000 * (barrier + 1): each.obstacles for barrier, each in enumerate(told(one.autopilot, Read))}
    assert [now_us for now_us, datagrams in read.items() if datagrams == 2] == [140_000, 340_000]
    assert sorted(set(read.values())) == [1, 2]


def test_a_camera_on_a_gimbal_is_drawn_as_that_looks_at_the_frames_time() -> None:
    turned = GimbalState((math.cos(0.2), 0.0, -math.sin(0.2), 0.0))
    one = vehicle("one", [reply()] * 20, says={132_000: turned})
    fixed = FeedInRun("depth", FakeControl(Rendered(index) for index in range(10)), 15.0, 0)
    carried = FeedInRun("camera", FakeControl(Rendered(index) for index in range(10)), 15.0, 0, on_gimbal=True)
    one.feeds = [fixed, carried]
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 50)
    assert [asked.head for asked in told(fixed.control, Render)] == [None] * 3
    assert [asked.head for asked in told(carried.control, Render)] == [(1.0, 0.0, 0.0, 0.0), turned.q, turned.q]


def test_a_camera_is_drawn_as_it_has_zoomed_at_the_frames_time_and_no_depth_camera() -> None:
    one = vehicle("one", [reply()] * 20, says={80_000: CameraTrigger(3), 132_000: CameraZoom(40.0)})
    depth = FeedInRun("depth", FakeControl(Rendered(index) for index in range(10)), 15.0, 0)
    camera = FeedInRun("camera", FakeControl(iter([Rendered(0), Photographed(3), Rendered(1), Rendered(2)])), 15.0, 0)
    one.feeds = [depth, camera]
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 50)
    assert [asked.zoom_percent for asked in told(depth.control, Render)] == [0.0] * 3
    assert isinstance(camera.control, FakeControl)
    asked = [message for message in camera.control.told if isinstance(message, Render | Photograph)]
    assert [(type(each).__name__, each.zoom_percent) for each in asked] == [
        ("Render", 0.0),
        ("Photograph", 0.0),
        ("Render", 40.0),
        ("Render", 40.0),
    ]


def test_a_picture_is_drawn_as_things_are_when_the_shutter_opens_and_told_at_a_set_time() -> None:
    """200 ms later, whatever it takes to draw it; frames between are not mixed up with it."""
    answers = [Rendered(0), Photographed(3), Rendered(1), Rendered(2), Rendered(3)]
    one = vehicle("one", [reply()] * 30, north_m=7.0, says={80_000: CameraTrigger(3)})
    camera = FeedInRun("camera", FakeControl(iter(answers)), 15.0, 0)
    one.feeds = [camera]
    channel = one.channel
    assert isinstance(channel, FakeChannel)
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 75)
    assert isinstance(camera.control, FakeControl)
    asked = [message for message in camera.control.told if isinstance(message, Photograph)]
    assert [each[:4] for each in asked] == [(3, 80_000, BodyPose(7.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0)), None)]
    assert [body.place for body in asked[0].loose] == [(1.0, 2.0, -3.0)]
    assert channel.pictures == [(284_000, PictureTaken(3, True))], "with the first sensors after 80 + 200 ms"


def test_video_is_sent_by_the_camera_while_its_autopilot_says_so() -> None:
    one = vehicle("one", [reply()] * 20, says={40_000: VideoState(True), 132_000: VideoState(False)})
    depth = FeedInRun("depth", FakeControl(Rendered(index) for index in range(10)), 15.0, 0)
    camera = FeedInRun("camera", FakeControl(Rendered(index) for index in range(10)), 15.0, 0)
    one.feeds = [depth, camera]
    run_ticks(Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder()), 50)
    assert isinstance(camera.control, FakeControl)
    asked = [message for message in camera.control.told if isinstance(message, SendVideo | Render)]
    kinds = [(type(each).__name__, each[0]) for each in asked]
    assert kinds == [("SendVideo", True), ("Render", 0), ("SendVideo", False), ("Render", 1), ("Render", 2)]
    assert len(told(depth.control, Render)) == 3, "and nothing else"


def test_arming_is_seen_in_the_actuator_controls() -> None:
    recorder = FakeRecorder()
    run_ticks(Conductor([vehicle("one", [reply()] * 5)], FakeSimulation(), RadioSettings(), 1, recorder), 26)
    assert recorder.events == [(40000, "one", "armed")]
    assert recorder.truths == [(100000, "one")]


def test_a_run_is_done_when_all_companions_are_and_fails_as_the_first_that_failed() -> None:
    one = vehicle("one", [reply(done=True)] * 5)
    two = vehicle("two", [reply(), reply(done=True, outcome="peer link lost")])
    conductor = Conductor([one, two], FakeSimulation(), RadioSettings(), 1, FakeRecorder())
    run_ticks(conductor, 10)
    assert not now(conductor.done)
    run_ticks(conductor, 5)
    assert conductor.done and conductor.outcome == "peer link lost"


def test_what_an_autopilot_says_of_its_simulator_counts_from_the_next_tick_on() -> None:
    wind = SimulatorParameter("SIH_WIND_N", 3.0)
    one, two = vehicle("one", [reply()] * 5), vehicle("two", [reply()] * 5, says={8000: wind})
    simulation = FakeSimulation()
    run_ticks(Conductor([one, two], simulation, RadioSettings(), 1, FakeRecorder()), 5)
    assert simulation.told == [(2, 1, "SIH_WIND_N", 3.0)]


def test_a_companion_that_is_killed_has_answered_and_is_not_stepped_again() -> None:
    one = vehicle("one", [reply(autopilot=3), reply(autopilot=4), reply()])
    autopilot, companion, killed = one.autopilot, one.companion, list[int]()
    conductor = Conductor([one], FakeSimulation(), RadioSettings(), 1, FakeRecorder())
    run_ticks(conductor, 7)
    conductor.lose("one", "companion", lambda: killed.append(conductor.now_us))
    run_ticks(conductor, 8)
    assert killed == [40000], "at the barrier, when it has answered"
    assert [step.now_us for step in told(companion, Step)] == [20000]
    assert told(autopilot, Read) == [Read(0), Read(3), Read(0)], "what it sent before is read"
    assert not conductor.done, "the vehicle is armed, and flies on"


def test_an_autopilot_that_is_killed_lets_its_motors_stop() -> None:
    one, two = vehicle("one", [reply()] * 5), vehicle("two", [reply()] * 5)
    autopilot, killed = one.autopilot, list[int]()
    recorder = FakeRecorder()
    conductor = Conductor([one, two], FakeSimulation(), RadioSettings(), 1, recorder)
    conductor.lose("one", "autopilot", lambda: killed.append(conductor.now_us))
    run_ticks(conductor, 15)
    assert killed == [20000] and told(autopilot, Read) == []
    assert one.controls == HilActuatorControls(20000, 0, (0.0,) * 16, 0)
    assert [step.autopilot for step in told(one.companion, Step)] == [1, 0, 0], "what it had sent before, and no more"
    assert recorder.events == [(40000, "two", "armed")]
    assert told(two.autopilot, Read) == [Read(0)] * 3


def test_a_crash_is_an_event_and_the_outcome_and_ends_its_companions_part() -> None:
    simulation, recorder = FakeSimulation(), FakeRecorder()
    simulation.met[3] = Impact(12_000, 0, "one", "house", None, 0.6, crash=False)
    simulation.met[7] = Impact(28_000, 0, "one", "house", None, 4.25, crash=True)
    conductor = Conductor([vehicle("one", [reply()] * 5)], simulation, RadioSettings(), 1, recorder)
    run_ticks(conductor, 6)
    assert not now(conductor.done)
    run_ticks(conductor, 4)
    assert conductor.done and conductor.outcome == "one crashed into house"
    assert [event for event in recorder.events if event[2] in ("touched", "crashed")] == [
        (12_000, "one", "touched"),
        (28_000, "one", "crashed"),
    ]


def test_a_crash_in_water_has_a_cause_of_its_own() -> None:
    simulation, recorder = FakeSimulation(), FakeRecorder()
    simulation.met[7] = Impact(28_000, 0, "one", "pond", None, 4.25, crash=True, in_water=True)
    conductor = Conductor([vehicle("one", [reply()] * 5)], simulation, RadioSettings(), 1, recorder)
    run_ticks(conductor, 10)
    assert conductor.outcome == "one came down in water (pond)"
    assert (28_000, "one", "crashed") in recorder.events


def sent_over_60_m(sees: bool | None, obstructed_range_m: float | None) -> int:
    """How many datagrams come, with or without something between the two."""
    one = vehicle("one", [reply(peer=1)] + [reply()] * 9, peer=FakePeer([b"hello"]))
    two = vehicle("two", [reply()] * 10, north_m=60.0, peer=FakePeer([]))
    settings = RadioSettings(range_m=100.0, latency_s=0.0, obstructed_range_m=obstructed_range_m)
    asked = list[tuple[Any, Any, float]]()

    def look(a: Any, b: Any, time_s: float) -> bool:
        asked.append((a, b, time_s))
        return bool(sees)

    simulation = FakeSimulation()
    run_ticks(Conductor([one, two], simulation, settings, 1, FakeRecorder(), None if sees is None else look), 40)
    needed = sees is not None and obstructed_range_m is not None and obstructed_range_m < 60.0
    assert asked == ([((0.0, 0.0, 0.0), (60.0, 0.0, 0.0), 0.04)] if needed else [])
    return sum(step.peer for step in told(two.companion, Step))


def test_through_what_is_solid_the_radio_reaches_less_far() -> None:
    assert sent_over_60_m(sees=False, obstructed_range_m=59.0) == 0
    assert sent_over_60_m(sees=True, obstructed_range_m=59.0) == 1
    assert sent_over_60_m(sees=False, obstructed_range_m=60.0) == 1
    assert sent_over_60_m(sees=False, obstructed_range_m=None) == 1
    assert sent_over_60_m(sees=None, obstructed_range_m=0.0) == 1


def test_one_air_for_all_carries_a_broadcast_to_each() -> None:
    peers = [FakePeer([b"hello"]), FakePeer([]), FakePeer([])]
    members = [vehicle(f"v{n}", [reply(peer=n == 0)] + [reply()] * 9, peer=peer) for n, peer in enumerate(peers)]
    settings = RadioSettings(latency_s=0.0, shared=True)
    conductor = Conductor(members, FakeSimulation(), settings, 1, FakeRecorder())
    run_ticks(conductor, 40)
    assert [peer.from_radio for peer in peers] == [[], [b"hello"], [b"hello"]]
    assert conductor.radio_counts["v0>v2"] == (1, 0)
