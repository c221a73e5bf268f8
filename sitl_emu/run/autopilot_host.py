"""The autopilot host: the computer that an emulated PX4 runs on, for `launch`, `run`, `python -m sitl_emu.autopilot`.

It opens the sockets of its links, plugs in what the vehicle carries, tells the simulator the parameters that are about
it, keeps telemetry logs, and does what MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN asks for: at a reboot the autopilot begins
anew, with what it had stored and with a time of its own; the simulator, its channel and the ports stay. It is stepped
by whoever has the channel.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.parameters import Value
from sitl_emu.components.camera import Camera
from sitl_emu.components.card import Card
from sitl_emu.components.gimbal import Gimbal
from sitl_emu.components.video_stream import VideoStream
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import (
    STATE_BOOT,
    STATE_POWEROFF,
    AutopilotChannel,
    AutopilotState,
    BesideMessage,
    CameraTrigger,
    CameraZoom,
    GimbalState,
    HilSensor,
    PictureTaken,
    SimulatorMessage,
    VideoState,
    later,
)
from sitl_emu.core.tcp_channel import TcpAutopilotChannel
from sitl_emu.run import components
from sitl_emu.run.dds_socket import DdsSocket, clock_sample
from sitl_emu.run.link_logs import LinkLogs
from sitl_emu.run.link_sockets import LinkSockets, Poll, PrivateSocket
from sitl_emu.run.loss_timeouts import loss_timeouts
from sitl_emu.run.pacing import TICKS_A_WAKING, clock_s, measure_load, unix_time_us
from sitl_emu.run.simulated_parameters import SimulatedParameters
from sitl_emu.vehicles import description

ONBOARD, PAYLOAD = 1, 2
"""Indexes of the onboard links to the companion and to the payload."""
DDS = -1
"""What stands for the line to the DDS agent, where the links have their index."""
TICK_US = 4000
CLOCK_US = 20_000
"""How often ROS 2 is told the time, as in a run (50 Hz)."""
STANDBY = 3
BOOT_LIMIT_US = 20_000_000
"""An autopilot that is not armable after so much time counts as booted all the same."""
REBOOT, SHUT_DOWN = 1, 2
"""PREFLIGHT_REBOOT_SHUTDOWN.param1."""
WAIT_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hosted:
    """An autopilot to be hosted."""

    instance: int
    airframe: Mapping[str, Value]
    """PX4's parameters that differ from their defaults."""
    camera: description.Camera | None = None
    gimbal: description.Gimbal | None = None
    """What the vehicle carries that speaks MAVLink by itself."""
    root: Path | None = None
    """The folder that stands for PX4's file system, as storage.prepare leaves it."""
    gcs: tuple[str, int] | None = None
    """Where the ground station listens; None: on this machine."""
    speed: float = 1.0
    """Times real time, for time-outs that PX4's start-up script stretches (PX4_SIM_SPEED_FACTOR)."""
    start_us: int | None = None
    """Microseconds since 1970 at which simulated time begins; None: the date at each boot."""
    tlog: Path | None = None
    """Telemetry logs are kept here, `TLOG-LINK.tlog`."""
    must_log: bool = False
    """Whether it ends where they can't be written any more; else they stop, and it flies on."""
    mates: int = 1
    """How many autopilots share the process, and so its processor time."""
    tells_gimbal: bool = False
    """Whether the simulator is told where the gimbal looks: somebody draws what a camera on it sees."""
    pictures: bool = False
    """Whether the simulator draws what the camera takes pictures of, into `root`."""
    video: bool = False
    """Whether the simulator sends what the camera sees as video to the ground station."""
    display: bool = False
    """Whether it speaks to what draws the vehicle, as with PX4's own simulation."""
    by_number: Collection[int] = ()
    """Links whose datagrams are announced, and read by number: lockstep."""
    dds: DdsSocket | None = None
    """The line to the DDS agent; None: it does not speak to ROS 2."""
    tells_clock: bool = False
    """Whether ROS 2 hears /clock from it."""
    isolated: Mapping[str, PrivateSocket] | None = None
    """In an isolated run: the sockets of the links that have somebody at their other end. None: all, on PX4's ports."""


class AutopilotHost:
    """One hosted autopilot, from power-on."""

    def __init__(self, hosted: Hosted, poll: "HostPoll") -> None:
        """Open its ports, which wake `poll`. Raises PortInUseError, and OSError for logs that can't be written."""
        self._hosted, self._poll = hosted, poll
        self.off = False
        """It was shut down: nothing may be called any more but `close`."""
        self.boots = 0
        self._dds_ticks = 0
        """Since ROS 2 was last told something."""
        makers = (hosted.camera.vendor, hosted.camera.model) if hosted.camera is not None else ("", "")
        self._card = Card(hosted.root, *makers) if hosted.pictures and hosted.root is not None else None
        self._began_us: int | None = 0
        """The simulator's time at this boot; None until the first tick after a reboot tells it."""
        self._lived_us = 0
        """Simulated time before this boot."""
        self._clock_us = 0
        """When it was time last to tell ROS 2 the time, since this boot."""
        self._power_on()
        links = self.autopilot.mavlink.links
        self._sockets = LinkSockets(links, hosted.gcs, hosted.isolated)
        for index, fileno in self._sockets.filenos().items():
            if index not in hosted.by_number:
                poll.watch(fileno, (self, index))
        if hosted.dds is not None:
            poll.watch(hosted.dds.fileno(), (self, DDS))
        self._logs: LinkLogs | None = None
        if hosted.tlog is not None:
            self._logs = LinkLogs(hosted.tlog, [link.name for link in links], must_log=hosted.must_log)

    @property
    def booted(self) -> bool:
        """Whether it is armable, or has had time enough for that."""
        autopilot = self.autopilot
        return autopilot.topics.vehicle_status.system_status >= STANDBY or autopilot.now_us > BOOT_LIMIT_US

    @property
    def dds_start_us(self) -> int | None:
        """The date of the simulator's time 0, as ROS 2 is told it; None where nothing is told, and while it reboots."""
        client = self.autopilot.uxrce_dds_client
        return client.time_offset_us - self._began_us if client is not None and self._began_us is not None else None

    def tick(self, channel: AutopilotChannel) -> None:
        """Step the autopilot: from what the simulator has sent to the answer. Raises ChannelClosed."""
        autopilot, messages = self.autopilot, channel.receive()
        if self._began_us is None:
            sensor = messages[-1]
            assert isinstance(sensor, HilSensor)
            self._began_us = sensor.time_usec - TICK_US
        if began_us := self._began_us:
            messages = [later(message, -began_us) for message in messages]
        if self._card is not None:
            self._take_in_pictures(messages)
        controls = autopilot.step(messages)
        if began_us:
            controls = later(controls, began_us)
        wanted = self._power_wanted()
        if wanted == REBOOT:
            channel.send(controls, [AutopilotState(STATE_BOOT)])
        elif wanted == SHUT_DOWN:
            still = controls._replace(controls=(0.0,) * len(controls.controls), mode=0)
            channel.send(still, [AutopilotState(STATE_POWEROFF)])
        else:
            channel.send(controls, self._beside())
        self.flush()
        self._dds_ticks += 1
        if self._dds_ticks >= TICKS_A_WAKING:
            self._flush_dds()
        if wanted == REBOOT:
            self._reboot()
        elif wanted == SHUT_DOWN:
            self._power_off()

    def keep_time(self) -> None:
        """What goes by the clock, in real time: to be called often. Not for logs that have to repeat."""
        measure_load(self.autopilot, self._hosted.mates)
        if self.autopilot.uxrce_dds_client is not None:
            if self._hosted.start_us is None:
                self.autopilot.uxrce_dds_client.synchronize(self.autopilot.now_us, unix_time_us())
            self._flush_dds()
        for device in self._devices:
            device.keep_alive(clock_s())

    def read(self, link: int, exactly: int | None = None) -> None:
        """Hand a link's datagrams to the autopilot, those that wait or `exactly` so many, and send its answers."""
        if link == DDS:
            self._read_dds()
            return
        for datagram in self._sockets.receive(link, exactly):
            self._log(link, datagram)
            self.autopilot.on_datagram(link, datagram)
        self.flush()

    def drop(self, link: int) -> None:
        """Lose a link's datagrams."""
        if link == DDS:
            return
        self._sockets.receive(link)

    def flush(self) -> None:
        """Send what the autopilot has to say."""
        if self._logs is not None:
            for index, link in enumerate(self.autopilot.mavlink.links):
                for datagram in link.outbox:
                    self._log(index, datagram)
        self._sockets.flush()

    def take_sent(self, link: int) -> int:
        """How many datagrams were sent on a link since this was asked last."""
        return self._sockets.take_sent(link)

    def close(self) -> None:
        """End in good order: parameters are saved, logs are whole, ports are free. May be called twice."""
        try:
            if not self.off:
                self._power_off()
        finally:
            if self._logs is not None:
                self._logs.close()
                self._logs = None

    def _power_on(self) -> None:
        hosted = self._hosted
        self.autopilot = Autopilot(hosted.airframe, hosted.instance, hosted.root, display=hosted.display)
        for name, value in loss_timeouts(hosted.speed).items():
            self.autopilot.parameters.set(name, value)
        boot_us = unix_time_us() if hosted.start_us is None else hosted.start_us + self._lived_us
        self.autopilot.mavlink.context.boot_unix_us = self._boot_unix_us = boot_us
        video = VideoStream(ports.video(hosted.instance)) if hosted.video else None
        self._devices = components.plug_in(hosted, self.autopilot, self._card, video)
        self._gimbal = next((each for each in self._devices if isinstance(each, Gimbal)), None)
        self._camera = next((each for each in self._devices if isinstance(each, Camera)), None)
        self._looked: GimbalState | None = None
        """Where the simulator was told last that the gimbal looks."""
        self._zoomed: CameraZoom | None = None
        """How far the simulator was told last that the camera has zoomed."""
        self._video, self._video_told = video, VideoState(False)
        if hosted.dds is not None:
            self.autopilot.start_uxrce_dds_client()
        self._simulated_parameters = SimulatedParameters(self.autopilot.parameters)
        self._commands_seen = 0
        self.boots += 1

    def _reboot(self) -> None:
        self._lived_us += self.autopilot.now_us
        self.autopilot.close()
        self._power_on()
        self._began_us, self._clock_us = None, 0
        self._sockets.restart(self.autopilot.mavlink.links)

    def _power_off(self) -> None:
        self.off = True
        try:
            self.autopilot.close()
        finally:
            for fileno in self._sockets.filenos().values():
                self._poll.forget(fileno)
            self._sockets.close()
            if self._hosted.dds is not None:
                self._poll.forget(self._hosted.dds.fileno())
                self._hosted.dds.close()

    def _power_wanted(self) -> int | None:
        """REBOOT or SHUT_DOWN where a command that was accepted since the last tick asks for it."""
        commands = self.autopilot.topics.vehicle_commands
        if not commands or commands[-1].number == self._commands_seen:
            return None
        new = [record.command for record in commands if record.number > self._commands_seen]
        self._commands_seen = commands[-1].number
        wanted = [int(each.param1) for each in new if each.command == mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN]
        return wanted[-1] if wanted else None

    def _beside(self) -> list[BesideMessage]:
        """What the simulator is to know now, beside the answer."""
        return [
            *self._simulated_parameters.changed(),
            *self._gimbal_turned(),
            *self._zoom_changed(),
            *self._triggers(),
            *self._video_changed(),
        ]

    def _gimbal_turned(self) -> list[GimbalState]:
        """Where the gimbal looks, if that has changed since the simulator was told."""
        if self._gimbal is None or not self._hosted.tells_gimbal:
            return []
        looks = GimbalState(self._gimbal.looks(self.autopilot.now_us))
        if looks == self._looked:
            return []
        self._looked = looks
        return [looks]

    def _zoom_changed(self) -> list[CameraZoom]:
        """How far the camera has zoomed, if that has changed since the simulator was told."""
        if self._camera is None or not self._camera.zooms or not self._hosted.pictures:
            return []
        zoom = CameraZoom(self._camera.zoom_percent(self.autopilot.now_us))
        if zoom == self._zoomed:
            return []
        self._zoomed = zoom
        return [zoom]

    def _triggers(self) -> list[CameraTrigger]:
        """The pictures that the camera takes now."""
        if self._card is None or self._camera is None or not self._camera.triggers:
            return []
        numbers, self._camera.triggers = self._camera.triggers, []
        return [CameraTrigger(number) for number in numbers]

    def _video_changed(self) -> list[VideoState]:
        """Whether video is to be sent, if that has changed since the simulator was told."""
        if self._video is None or self._video.running == self._video_told.running:
            return []
        self._video_told = VideoState(self._video.running)
        return [self._video_told]

    def _take_in_pictures(self, messages: list[SimulatorMessage]) -> None:
        for message in messages:
            if isinstance(message, PictureTaken) and self._camera is not None:
                self._camera.picture_taken(self.autopilot.now_us, *message)

    def _read_dds(self) -> None:
        """Hand what came from ROS 2 to the autopilot, and send its answers."""
        dds, client = self._hosted.dds, self.autopilot.uxrce_dds_client
        if dds is None or client is None:
            return
        for sample in dds.receive():
            client.on_sample(self.autopilot.now_us, sample)
        if dds.lost:
            self._poll.forget(dds.fileno())
        self.flush()
        self._flush_dds()

    def _flush_dds(self) -> None:
        """Send what ROS 2 is to hear, that of all ticks of a waking at once: to wake the agent costs as much again."""
        self._dds_ticks = 0
        client = self.autopilot.uxrce_dds_client
        if client is None or self._hosted.dds is None or self.off:
            return
        now_us = self.autopilot.now_us
        if self._hosted.tells_clock and now_us - self._clock_us >= CLOCK_US:
            self._clock_us = now_us - now_us % CLOCK_US
            client.outbox.append(clock_sample(now_us + client.time_offset_us))
        self._hosted.dds.send(client.outbox)

    def _log(self, link: int, datagram: bytes) -> None:
        if self._logs is not None:
            self._logs.write(self._boot_unix_us + self.autopilot.now_us, link, datagram)


HostPoll = Poll[tuple[AutopilotHost, int] | None]
"""Tells on which link of which host datagrams wait; None is the simulator's channel."""


def wait_for_tick(poll: HostPoll, channel: TcpAutopilotChannel) -> None:
    """Answer whoever speaks on the links until the simulator's next tick is there, or it has left."""
    while True:
        ready = poll.wait(0.0 if channel.ready else WAIT_S)
        for key in ready:
            if key is not None:
                host, link = key
                host.read(link)
        if channel.ready or None in ready:
            return
