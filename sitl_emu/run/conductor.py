"""The conductor: steps the simulation of all vehicles, and beats time for autopilots, companions and cameras.

Lockstep, so that the same seed gives the same run at any speed on any machine. A tick is 4 ms: HIL_SENSOR goes to every
autopilot, then every HIL_ACTUATOR_CONTROLS is collected. Every fifth tick is a barrier, at which

1. every autopilot says how many datagrams it sent to its companion since the last barrier, and waits;
2. every companion has answered its last step: datagrams for its autopilot and for the peer radio, status, events;
3. every autopilot is told how many datagrams of its companion to read before its next tick, and how many of its
   sensors, which tell it of obstacles;
4. what companions sent by radio is read, and what the radio delivers by now is sent on;
5. every companion is told to step: the time, and how many datagrams and which frames to read before it does.

So companions, cameras and detectors work while the next five ticks are flown. What a companion sends in the step of one
barrier reaches its autopilot at the next, 20 ms later. An outside companion (any command, MAVSDK) or an outside
autopilot (a real PX4) takes no part in barriers: of its autopilot a companion of ours then reads what is there when it
steps. An autopilot that was shut down takes no part in anything. No clock is read and no socket opened in here.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from sitl_emu.core.radio import RadioSettings
from sitl_emu.core.simulator_api import (
    STATE_BOOT,
    STATE_POWEROFF,
    CameraTrigger,
    CameraZoom,
    GimbalState,
    HilActuatorControls,
    SimulatorChannel,
    SimulatorMessage,
    SimulatorParameter,
    VideoState,
)
from sitl_emu.missions.companion.companion import Event, Status
from sitl_emu.run import poses
from sitl_emu.run.feed_in_run import Control, FeedInRun
from sitl_emu.run.messages import (
    FrameTaken,
    ObstaclesSeen,
    Read,
    SendVideo,
    Sent,
    Step,
    Stepped,
    VehicleAt,
)
from sitl_emu.run.peer_radio import PeerRadio, PeerSocket, Sees
from sitl_emu.world.contacts import Impact
from sitl_emu.world.obstacles import LoosePose
from sitl_emu.world.parcels import ParcelTold

TICK_US = 4000
BARRIER_TICKS = 5
TRUTH_TICKS = 25
MODE_FLAG_SAFETY_ARMED = 128
OFF = (0.0,) * 16
"""HIL_ACTUATOR_CONTROLS.controls of an autopilot that drives nothing."""


class Simulator(Protocol):
    """One vehicle in the simulation."""

    def pose(self) -> Any:
        """The true pose."""
        ...


class Simulation(Protocol):
    """The simulation of all vehicles (`sitl_emu.world.simulation`)."""

    def tick(self, controls: Sequence[HilActuatorControls | None]) -> list[list[SimulatorMessage]]:
        """Advance 4 ms; what each vehicle's sensors say, HIL_SENSOR last."""
        ...

    def impacts(self) -> list[Impact]:
        """What vehicles have met since this was asked last."""
        ...

    def parcels_told(self) -> list[ParcelTold]:
        """What has happened to parcels since this was asked last."""
        ...

    def loose_poses(self) -> list[LoosePose]:
        """Where all loose bodies are."""
        ...

    def set_parameter(self, place: int, name: str, value: float) -> None:
        """Do as one vehicle's autopilot says by a parameter about its simulator."""
        ...


class ObstacleLink(Protocol):
    """Tells an autopilot of obstacles."""

    def tell(self, frame: FrameTaken, obstacles: ObstaclesSeen) -> None: ...  # noqa: D102
    def send(self, now_us: int) -> int:
        """Send what was told, and the heartbeat that is due; how many datagrams."""
        ...


class Recorder(Protocol):
    """Where events and true tracks are kept."""

    def event(self, vehicle: str, event: Event) -> None: ...  # noqa: D102
    def truth(self, now_us: int, vehicle: str, pose: Any) -> None: ...  # noqa: D102
    def loose(self, now_us: int, poses: Iterable[LoosePose]) -> None: ...  # noqa: D102


class Onlooker(Protocol):
    """Who is told how the run goes, and takes no part in it."""

    def sensed(self, sensed: Sequence[Sequence[SimulatorMessage]]) -> None:
        """What each vehicle's sensors have said in a tick."""
        ...

    def barrier(
        self, now_us: int, vehicles: "Sequence[VehicleInRun]", arrived: Sequence[tuple[FrameTaken, ...]]
    ) -> None:
        """A barrier, with the frames that have reached each vehicle's companion."""
        ...


@dataclass
class VehicleInRun:
    """One vehicle and whom it talks to."""

    name: str
    simulator: Simulator
    channel: SimulatorChannel
    autopilot: Control | None = None
    """None where the autopilot takes no part in barriers, or no more."""
    companion: Control | None = None
    """None where there is none, or one from outside."""
    feeds: Sequence[FeedInRun] = ()
    peer: PeerSocket | None = None
    controls: HilActuatorControls | None = None
    armed: bool = False
    crashed: str = ""
    """What crash it had, such as "crashed into wall"; empty while it had none."""
    off: bool = False
    """Its autopilot was shut down, or killed by a fault: its motors are off."""
    stepping: bool = False
    """The companion was told to step and has not answered yet."""
    status: Status | None = None
    """What its companion said last of itself."""
    frames_dropped: int = 0
    lost: set[str] = field(default_factory=set)
    """Which of its processes, "autopilot" or "companion", a fault has killed."""
    gimbal: GimbalState | None = None
    """Where its gimbal looks; None until it was told, or where it has none."""
    zoom: CameraZoom | None = None
    """How far its camera has zoomed; None until it was told, or where it can't."""
    looks: bool = True
    """Whether its companion takes its camera's frames now; nobody can say so of one from outside."""
    sends_video: bool = False
    outside: bool = False
    """Whether its autopilot is one from outside: how many datagrams it has sent, nobody knows."""
    model: str = ""
    """For those who look at it, as `sitl_emu.vehicles.load` takes it; empty: nobody sees it."""
    obstacle_link: ObstacleLink | None = None
    """None where none of its feeds tells the autopilot of obstacles."""


class Conductor:
    """All vehicles of a run, tick by tick."""

    def __init__(
        self,
        vehicles: Sequence[VehicleInRun],
        simulation: Simulation,
        radio: RadioSettings,
        seed: int,
        recorder: Recorder,
        sees: Sees | None = None,
        onlooker: Onlooker | None = None,
    ) -> None:
        """`simulation` steps the simulators of `vehicles`, in their order; `sees`: as for `PeerRadio`."""
        self._onlooker = onlooker
        self.vehicles = list(vehicles)
        self._simulation = simulation
        self.ticks = 0
        self._recorder = recorder
        self._doomed: list[tuple[str, str, Callable[[], None]]] = []
        peers = [vehicle for vehicle in vehicles if vehicle.peer is not None]
        self._radio = PeerRadio(peers, radio, seed, sees)

    @property
    def now_us(self) -> int:
        """Simulated time since boot."""
        return self.ticks * TICK_US

    @property
    def done(self) -> bool:
        """Every companion of ours has done its mission or crashed, and none flies on that has lost its companion."""
        if any(vehicle.armed for vehicle in self.vehicles if vehicle.lost and not vehicle.crashed):
            return False
        ours = [vehicle for vehicle in self.vehicles if vehicle.companion is not None]
        return all(vehicle.crashed or (vehicle.status and vehicle.status.done) for vehicle in ours)

    @property
    def outcome(self) -> str:
        """ "success", or who has crashed, or what the first companion says that failed."""
        if crashes := [f"{vehicle.name} {vehicle.crashed}" for vehicle in self.vehicles if vehicle.crashed]:
            return "; ".join(crashes)
        ours = [vehicle for vehicle in self.vehicles if vehicle.companion is not None]
        outcomes = [vehicle.status.outcome if vehicle.status else "" for vehicle in ours]
        return next((outcome for outcome in outcomes if outcome != "success"), "success")

    @property
    def radio_counts(self) -> dict[str, tuple[int, int]]:
        """Datagrams (sent, lost) of each direction."""
        return self._radio.air.counts

    def tick(self) -> None:
        """4 ms. Raises ChannelClosed or ProcessLostError when a process has died."""
        vehicles = self.vehicles
        sensed = self._simulation.tick([vehicle.controls for vehicle in vehicles])
        for vehicle, messages in zip(vehicles, sensed, strict=True):
            if not vehicle.off:
                told = [picture for feed in vehicle.feeds for picture in feed.pictures_told(self.now_us)]
                vehicle.channel.send([*told, *messages])
        if self._onlooker is not None:
            self._onlooker.sensed(sensed)
        self.ticks = ticks = self.ticks + 1
        for impact in self._simulation.impacts():
            self._note(impact)
        for news in self._simulation.parcels_told():
            self._note_parcel(news)
        for place, vehicle in enumerate(vehicles):
            if not vehicle.off:
                self._take_answer(place, vehicle)
            for feed in vehicle.feeds:
                if ticks >= feed.due_tick():
                    self._take_frame(vehicle, feed)
        if ticks % TRUTH_TICKS == 0:
            for vehicle in vehicles:
                self._recorder.truth(self.now_us, vehicle.name, vehicle.simulator.pose())
            self._recorder.loose(self.now_us, self._simulation.loose_poses())
        if ticks % BARRIER_TICKS == 0:
            self._barrier()

    def cut_radio(self, vehicle: str, cut: bool) -> None:
        """Cut a vehicle's peer radio off, or join it again."""
        self._radio.air.cut(vehicle, cut)

    def lose(self, vehicle: str, process: str, kill: Callable[[], None]) -> None:
        """Go on without a process of a vehicle ("autopilot", "companion") from the next barrier on.

        `kill` is called there, when the process waits: so that all it has done is the same in every run.
        """
        self._doomed.append((vehicle, process, kill))

    def _tell(self, vehicle: VehicleInRun, kind: str, text: str = "", **data: float | int | str) -> None:
        self._recorder.event(vehicle.name, Event(self.now_us, kind, text, data))

    def _note(self, impact: Impact) -> None:
        vehicle = self.vehicles[impact.place]
        if impact.crash:
            vehicle.crashed = impact.did
        kind, text = "crashed" if impact.crash else "touched", f"{impact.other} at {impact.speed_m_s:.1f} m/s"
        data: dict[str, Any] = {"other": impact.other, "speed_m_s": round(impact.speed_m_s, 3)}
        if impact.in_water:
            text, data = f"in water, {text}", data | {"cause": "in water"}
        self._tell(vehicle, kind, text, **data)

    def _note_parcel(self, told: ParcelTold) -> None:
        data: dict[str, Any] = {"name": told.name, **({"water": told.water} if told.water else {})}
        data |= {"north_m": round(told.north_m, 3), "east_m": round(told.east_m, 3), "down_m": round(told.down_m, 3)}
        self._tell(self.vehicles[told.place], told.what, told.text, **data)

    def finish(self) -> None:
        """Collect what companions and cameras are still at work on, so that nothing of the run is lost."""
        for vehicle in self.vehicles:
            self._collect(vehicle)
            for feed in vehicle.feeds:
                feed.finish()

    def _take_answer(self, place: int, vehicle: VehicleInRun) -> None:
        """The autopilot's controls, and what it says beside them. Raises ChannelClosed."""
        self._take_controls(vehicle, vehicle.channel.receive())
        for message in vehicle.channel.beside():
            if isinstance(message, SimulatorParameter):
                self._simulation.set_parameter(place, *message)
            elif isinstance(message, GimbalState):
                vehicle.gimbal = message
            elif isinstance(message, CameraZoom):
                vehicle.zoom = message
            elif isinstance(message, CameraTrigger):
                self._take_picture(vehicle, message.number)
            elif isinstance(message, VideoState):
                self._send_video(vehicle, message.running)
            elif message.system_status == STATE_BOOT:
                self._tell(vehicle, "autopilot rebooted")
            elif message.system_status == STATE_POWEROFF:
                self._tell(vehicle, "autopilot shut down")
                vehicle.off, vehicle.autopilot = True, None

    def _take_controls(self, vehicle: VehicleInRun, controls: HilActuatorControls) -> None:
        vehicle.controls = controls
        if bool(controls.mode & MODE_FLAG_SAFETY_ARMED) != vehicle.armed:
            vehicle.armed = not vehicle.armed
            self._tell(vehicle, "armed" if vehicle.armed else "disarmed")

    def _barrier(self) -> None:
        now_us = self.now_us
        sent_by_autopilot = [self._sent_by_autopilot(vehicle) for vehicle in self.vehicles]
        replies = [self._collect(vehicle) for vehicle in self.vehicles]
        self._end_the_doomed()
        arrived = [self._arrived(vehicle, now_us) for vehicle in self.vehicles]
        if self._onlooker is not None:
            self._onlooker.barrier(now_us, self.vehicles, arrived)
        for vehicle, (for_autopilot, _) in zip(self.vehicles, replies, strict=True):
            of_obstacles = 0
            if vehicle.obstacle_link is not None and not vehicle.off:
                of_obstacles = vehicle.obstacle_link.send(now_us)
            if vehicle.autopilot is not None:
                vehicle.autopilot.send(Read(for_autopilot, of_obstacles))
        delivered = self._radio.carry(
            now_us, {v.name: reply[1] for v, reply in zip(self.vehicles, replies, strict=True)}
        )
        for vehicle, from_autopilot, frames in zip(self.vehicles, sent_by_autopilot, arrived, strict=True):
            if vehicle.companion is not None:
                from_peer = delivered.get(vehicle.name, 0)
                vehicle.companion.send(Step(now_us, from_autopilot, from_peer, frames))
                vehicle.stepping = True

    @staticmethod
    def _sent_by_autopilot(vehicle: VehicleInRun) -> int | None:
        """Datagrams for its companion since the last barrier; None: as many as there are."""
        if vehicle.autopilot is not None:
            return vehicle.autopilot.expect(Sent).datagrams
        return None if vehicle.outside else 0

    def _end_the_doomed(self) -> None:
        """All processes wait for their next message now."""
        for name, process, kill in self._doomed:
            vehicle = next(each for each in self.vehicles if each.name == name)
            if process in vehicle.lost:
                continue
            kill()
            vehicle.lost.add(process)
            if process == "autopilot":
                vehicle.off, vehicle.autopilot = True, None
                self._take_controls(vehicle, HilActuatorControls(self.now_us, 0, OFF, 0))
            else:
                vehicle.companion = None
        self._doomed.clear()

    def _collect(self, vehicle: VehicleInRun) -> tuple[int, int | None]:
        """The companion's answer to its last step: datagrams (for its autopilot, for the radio).

        None for the radio where the companion is from outside: then whatever is there is read.
        """
        if "companion" in vehicle.lost:
            return 0, 0
        if vehicle.companion is None:
            return 0, None
        if not vehicle.stepping:
            return 0, 0
        reply = vehicle.companion.expect(Stepped)
        vehicle.stepping = False
        vehicle.status = reply.status
        vehicle.frames_dropped = reply.dropped
        vehicle.looks = reply.looks
        for event in reply.events:
            self._recorder.event(vehicle.name, event._replace(time_us=self.now_us))
        return reply.autopilot, reply.peer

    def _seen_from(self, vehicle: VehicleInRun, feed: FeedInRun) -> poses.SeenFrom:
        loose = self._simulation.loose_poses()
        others = (_seen(other) for other in self.vehicles if other is not vehicle and other.model)
        zoom = vehicle.zoom if feed.feed == "camera" else None
        return poses.seen_from(vehicle.simulator.pose(), feed.on_gimbal, vehicle.gimbal, loose, others, zoom)

    def _take_frame(self, vehicle: VehicleInRun, feed: FeedInRun) -> None:
        """The one that is due, if anybody looks at it."""
        seen = vehicle.looks or vehicle.sends_video or self._onlooker is not None
        if seen or feed.keeps_next or feed.feed != "camera":
            feed.take(self.now_us, self._seen_from(vehicle, feed))
        else:
            feed.leave_out()

    def _take_picture(self, vehicle: VehicleInRun, number: int) -> None:
        """Of the MAVLink camera; an autopilot of ours asks only where there is a camera that draws it."""
        camera = next((feed for feed in vehicle.feeds if feed.feed == "camera"), None)
        if camera is not None:
            camera.photograph(number, self.now_us, self._seen_from(vehicle, camera))

    @staticmethod
    def _send_video(vehicle: VehicleInRun, running: bool) -> None:
        """Have the camera send its frames to the ground station, or no more."""
        vehicle.sends_video = running
        for feed in vehicle.feeds:
            if feed.feed == "camera":
                feed.control.send(SendVideo(running))

    def _arrived(self, vehicle: VehicleInRun, now_us: int) -> tuple[FrameTaken, ...]:
        """The frames that reach the companion at this barrier, and what they show the autopilot's; waits until they
        are made.
        """
        frames = list[FrameTaken]()
        for feed in vehicle.feeds:
            for frame, obstacles in feed.arrived(now_us):
                frames.append(frame)
                if obstacles is not None and vehicle.obstacle_link is not None:
                    vehicle.obstacle_link.tell(frame, obstacles)
        return tuple(frames)


def _seen(vehicle: VehicleInRun) -> VehicleAt:
    turning = vehicle.armed and not vehicle.off and not vehicle.crashed
    return VehicleAt(vehicle.name, vehicle.model, poses.body(vehicle.simulator.pose()), turning)
