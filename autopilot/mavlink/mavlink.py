"""The autopilot's MAVLink: its links, their streams, and the services that answer what comes in.

A state machine on simulated time, like PX4's mavlink module with its instances (px4-rc.mavlink): datagrams go in
by `on_datagram`, leave in each link's `outbox`. Messages for others are forwarded between links by the rules of
Mavlink::forward_message. Sockets are not known here.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.mavlink import forwarding, rates, silent_streams
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.encoder import Encoder
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.services import (
    adsb_vehicle,
    battery_status,
    command,
    command_sender,
    debug_values,
    event,
    follow_target,
    ftp,
    gimbal_manager,
    global_position_sensor,
    gps_global_origin,
    heartbeat,
    landing_target,
    log_streaming,
    log_transfer,
    manual_control,
    message_interval,
    message_request,
    mission,
    obstacle_distance,
    odometry,
    offboard,
    onboard_computer_status,
    optical_flow,
    parameter,
    ping,
    radio_status,
    rc_override,
    set_mode,
    shell,
    signing,
    statustext,
    system_time,
    timesync,
    velocity_limits,
)
from sitl_emu.autopilot.mavlink.services.service import Service
from sitl_emu.autopilot.mavlink.signature import LinkSigning, SigningStreams
from sitl_emu.autopilot.mavlink.stream import Stream
from sitl_emu.autopilot.mavlink.telemetry_status import TelemetryReports
from sitl_emu.autopilot.mavlink.wire import Device, Wire
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports

GIMBAL_MODE_MESSAGES = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT,
        mavlink.MAVLINK_MSG_ID_SETUP_SIGNING,
        mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_ATTITUDE,
        mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_MANUAL_CONTROL,
        mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION,
        mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS,
    }
)
"""All that PX4 listens to on a link in gimbal mode (MavlinkReceiver::handle_messages_in_gimbal_mode)."""
WIRE_ROUNDS: Final = 8
"""Questions and answers between the devices on the wires and the autopilot within a tick."""


class Modules(NamedTuple):
    """What the services ask of the autopilot's other modules; None: there is nobody to ask."""

    handle_command: Callable[[int, VehicleCommand], CommandResult | None]
    """Decides on a command and returns what the ack says, or None for no ack."""
    set_current_mission_item: Callable[[int, int], bool] | None = None
    """(now_us, seq): the navigator's; whether there is such an item."""
    mission_changed: Callable[[int], None] | None = None
    """(now_us): the navigator's; a mission can be started in the moment of its ack."""
    open_shell: Callable[[], shell.Console] | None = None
    logger: Logger | None = None


class Mavlink:
    """All MAVLink of one vehicle; `links` are gcs, onboard, payload, gimbal, and a display's where it has one."""

    def __init__(
        self,
        topics: Topics,
        parameters: Parameters,
        dataman: Dataman,
        texts: Texts,
        modules: Modules,
        instance: int,
        root: Path | None = None,
        outgoing: OutgoingCommands | None = None,
        *,
        display: bool = False,
    ) -> None:
        """`instance` gives the ports, MAV_SYS_ID the system id; FTP writes into `root` (None: nowhere).

        Commands that wait in `outgoing` are sent to other components. `display`: there is a link to what draws it.
        """
        self.system_id = int(parameters["MAV_SYS_ID"])
        self.context = Context(topics, parameters, dataman, root)
        self._encoder = Encoder(self.system_id)
        self.links = _links(instance, self._encoder, display=display)
        self._wires: list[Wire] = []
        self._all_links: tuple[Link, ...] = self.links
        self._streams: dict[str, Stream] = {}
        self._analysing: list[Stream] = []
        self._triggered = topics.camera_trigger
        self._telemetry = TelemetryReports(topics, self.links)
        for link in self.links:
            self._start_streams(link)
        self._intervals = message_interval.MessageInterval(self.stream)
        self.signing = signing.Signing(self.links, topics, texts.say, root)
        given = OutgoingCommands() if outgoing is None else outgoing
        services = self._services(topics, parameters, dataman, texts, modules, root, given)
        self._handlers: dict[int, list[Service]] = {}
        for service in services:
            for message_id in service.MESSAGES:
                self._handlers.setdefault(message_id, []).append(service)
        self._timed = tuple(service for service in services if service.HAS_TIMER)

    def _services(
        self,
        topics: Topics,
        parameters: Parameters,
        dataman: Dataman,
        texts: Texts,
        modules: Modules,
        root: Path | None,
        outgoing: OutgoingCommands,
    ) -> tuple[Service, ...]:
        """All services, in the order in which they hear and speak."""
        system_id = self.system_id
        streaming = log_streaming.LogStreaming(topics, texts.of("mavlink"), modules.logger)
        sender = command_sender.CommandSender(lambda: self._all_links, outgoing, system_id, topics)
        self.context.send_command = sender.send
        clocks = timesync.Timesync(topics)
        return (
            sender,
            command.Command(
                lambda: self._all_links,
                (message_request.MessageRequest(self.stream), self._intervals, streaming),
                modules.handle_command,
                topics,
                system_id,
                self.context.traits,
            ),
            set_mode.SetMode(lambda: self._all_links, modules.handle_command, topics, system_id),
            parameter.Parameter(self.links, topics, parameters, texts.of("mavlink"), system_id),
            mission.Mission(
                self.links,
                topics,
                dataman,
                texts,
                system_id,
                self.context.traits,
                modules.set_current_mission_item,
                modules.mission_changed,
            ),
            offboard.Offboard(topics, parameters, system_id, texts.of("mavlink")),
            landing_target.LandingTarget(topics, parameters, texts.of("mavlink"), clocks),
            obstacle_distance.ObstacleDistance(topics),
            odometry.Odometry(topics, texts.of("mavlink"), clocks),
            optical_flow.OpticalFlow(topics, parameters),
            manual_control.ManualControl(topics, self.links, system_id),
            rc_override.RcOverride(topics, system_id),
            heartbeat.Heartbeat(topics, system_id),
            adsb_vehicle.AdsbVehicle(topics),
            battery_status.BatteryStatus(topics, parameters, system_id),
            debug_values.DebugValues(topics),
            onboard_computer_status.OnboardComputerStatus(topics),
            radio_status.RadioStatus(self.links, topics, parameters, texts),
            follow_target.FollowTarget(topics),
            velocity_limits.VelocityLimits(topics),
            gimbal_manager.GimbalManager(topics),
            global_position_sensor.GlobalPositionSensor(topics),
            gps_global_origin.GpsGlobalOrigin(modules.handle_command, system_id),
            clocks,
            ping.Ping(system_id),
            system_time.SystemTime(),
            self.signing,
            statustext.StatusText(self.links, texts),
            statustext.ComponentTexts(texts, system_id),
            ftp.Ftp(system_id, root),
            log_transfer.LogTransfer(root),
            streaming,
            shell.Shell(texts, system_id, modules.open_shell),
            event.Event(self.links, texts.events),
        )

    def stream(self, name: str) -> Stream | None:
        """The stream of a message, or None if PX4 has none of that name."""
        found = self._streams.get(name)
        if found is None:
            try:
                found = self._streams[name] = Stream(name, self.context, self._encoder)
            except KeyError:
                return None
            if found.analyses:
                self._analysing.append(found)
        return found

    def configure_stream(self, now_us: int, link: Link, name: str, hz: float) -> bool:
        """Send a message so often on a link (0: never, negative: its default); whether there is such a message."""
        message_id = getattr(mavlink, f"MAVLINK_MSG_ID_{name}", None)
        if message_id is None:
            return False
        interval_us = 0 if hz < 0.0 else -1 if hz == 0.0 else rates.interval_us(hz)
        return self._intervals.set(now_us, message_id, interval_us, link)

    def plug_in(self, name: str, mode: str, device: Device) -> None:
        """Wire a device that speaks MAVLink to the autopilot; `mode` is the link's, as in `rates.RATES`."""
        wire = Wire(name, mode, device, self._encoder)
        self._start_streams(wire.link)
        self._wires.append(wire)
        self._all_links = (*self._all_links, wire.link)

    def on_datagram(self, now_us: int, link_index: int, data: bytes) -> None:
        """Act on what came in on a link; answers wait in the outbox when this returns."""
        link = self.links[link_index]
        for message in link.parse(data):
            self._dispatch(now_us, message, link)
        if self._wires:
            self._exchange(now_us)
        for each in self.links:
            each.flush()

    def update(self, now_us: int) -> None:
        """One tick: streams that are due, and what services have to say by themselves."""
        self.context.refresh()
        for service in self._timed:
            service.on_time(now_us)
        for stream in self._analysing:
            stream.analyse(now_us)
        trigger = self.context.topics.camera_trigger
        if trigger is not self._triggered:
            self._triggered = trigger
            for link in self._all_links:
                link.hurry(mavlink.MAVLINK_MSG_ID_CAMERA_TRIGGER)  # however long its stream had nothing to say
        for wire in self._wires:
            wire.link.update_streams(now_us)
        if self._wires:
            self._exchange(now_us)
        for link in self.links:
            link.update_streams(now_us)
            link.flush()
        if now_us >= self._telemetry.due_us:
            self._telemetry.publish(now_us)

    def _exchange(self, now_us: int) -> None:
        """Carry frames over the wires until nobody has anything to say, or the devices only talk to each other."""
        for _ in range(WIRE_ROUNDS):
            said = False
            for wire in self._wires:
                wire.link.flush()
                for data in wire.exchange(now_us):
                    said = True
                    for message in wire.link.parse(data):
                        self._dispatch(now_us, message, wire.link)
            if not said:
                return

    def _dispatch(self, now_us: int, message: Any, link: Link) -> None:
        forwarding.forward(message, link, self._all_links, self.system_id, self.context.forward_heartbeats)
        message_id = message.get_msgId()
        if link.statistics is not None:
            link.statistics.count(now_us, (message.get_srcSystem(), message.get_srcComponent()), message_id)
        if link.mode == "gimbal" and message_id not in GIMBAL_MODE_MESSAGES:
            return
        for service in self._handlers.get(message_id, ()):
            service.on_message(now_us, message, link)

    def _start_streams(self, link: Link) -> None:
        limit = rates.DATA_RATE_BYTES_PER_S.get(link.mode)
        for name, hz in rates.RATES[link.mode].items():
            stream = self.stream(name)
            assert stream is not None, f"no stream module for {name}"
            interval_us = rates.interval_us(hz)
            link.schedule(-interval_us if name == "HEARTBEAT" else 0, stream, interval_us)
        for name, hz in silent_streams.RATES.get(link.mode, {}).items():
            link.silent_intervals_us[getattr(mavlink, f"MAVLINK_MSG_ID_{name}")] = rates.interval_us(hz)
        if limit is not None:
            link.limit_rate(limit)


def _links(instance: int, encoder: Encoder, *, display: bool) -> tuple[Link, ...]:
    streams: SigningStreams = {}
    links = (
        Link("gcs", "normal", ports.gcs(instance), encoder, LinkSigning(0, streams)),
        Link("onboard", "onboard", ports.onboard(instance), encoder, LinkSigning(1, streams)),
        Link("payload", "onboard_low_bandwidth", ports.payload(instance), encoder, LinkSigning(2, streams)),
        Link("gimbal", "gimbal", ports.gimbal(instance), encoder, LinkSigning(3, streams)),
    )
    if not display:
        return links
    return (*links, Link("display", "custom", ports.display(instance), encoder, LinkSigning(4, streams)))
