"""The process of one autopilot in a run: its host, between its simulator's TCP port and whoever is on its links.

It steps whenever HIL_SENSOR comes. In lockstep with a companion of ours it says after every fifth tick how many
datagrams it sent on the onboard link, and reads as many as it is told, and so on the payload link where its vehicle's
sensors tell it of obstacles; ground station, payload and gimbal links, and the onboard link of any other companion, are
answered at once. What passes on its links is logged (.tlog), stamped with
the scenario's start date plus simulated time. Shut down, it waits in silence for the end of the run.
"""

from collections.abc import Mapping
from pathlib import Path

from sitl_emu.autopilot.storage import storage
from sitl_emu.core.tcp_channel import TcpAutopilotChannel, connect
from sitl_emu.run import models
from sitl_emu.run.autopilot_host import ONBOARD, PAYLOAD, AutopilotHost, Hosted, HostPoll, wait_for_tick
from sitl_emu.run.conductor import BARRIER_TICKS
from sitl_emu.run.configs import ROOTFS, AutopilotConfig
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.dds_socket import Agent
from sitl_emu.run.link_sockets import Poll, PortInUseError, PrivateSocket
from sitl_emu.run.memory import settle
from sitl_emu.run.messages import Read, Ready, Sent, Start, Waiting
from sitl_emu.run.process import StartError, main


def run(config: AutopilotConfig, control: ControlChannel) -> None:
    """Fly until the simulator closes the channel."""
    folder = Path(config.folder)
    root = folder / ROOTFS / config.name
    vehicle = models.as_set(config.model)
    poll: HostPoll = Poll()
    agent = Agent([config.instance]) if config.dds else None
    try:
        storage.prepare(root)
        hosted = Hosted(
            instance=config.instance,
            airframe=vehicle.airframe,
            camera=vehicle.camera,
            gimbal=vehicle.gimbal,
            root=root,
            gcs=config.gcs,
            start_us=config.start_us,
            tlog=folder / config.name,
            must_log=True,
            pictures=config.model.camera is not None,
            tells_gimbal=config.model.camera is not None and config.model.camera.on_gimbal,
            video=config.video,
            by_number=_by_number(config),
            dds=agent.sockets[config.instance] if agent is not None else None,
            isolated=_isolated(config),
        )
        host = AutopilotHost(hosted, poll)
    except (storage.StorageError, PortInUseError) as error:
        raise StartError(str(error)) from None
    try:
        control.send(Waiting())
        channel = connect(control.expect(Start).simulator_port)
        poll.watch(channel.fileno(), None)
        control.send(Ready())
        settle()
        _fly(host, poll, channel, control if config.lockstep else None)
    finally:
        host.close()
        if agent is not None:
            agent.close()


def _isolated(config: AutopilotConfig) -> Mapping[str, PrivateSocket] | None:
    if config.isolated is None:
        return None
    ends = {"onboard": config.isolated.companion, "payload": config.isolated.sensors}
    return {link: PrivateSocket.inherited(end) for link, end in ends.items() if end is not None}


def _by_number(config: AutopilotConfig) -> tuple[int, ...]:
    if not config.lockstep:
        return ()
    return (ONBOARD, PAYLOAD) if config.tells_obstacles else (ONBOARD,)


def _fly(host: AutopilotHost, poll: HostPoll, channel: TcpAutopilotChannel, control: ControlChannel | None) -> None:
    """Tick by tick; `control` where the autopilot takes part in barriers. Ends by ChannelClosed alone."""
    ticks = 0
    while not host.off:
        wait_for_tick(poll, channel)
        host.tick(channel)
        ticks += 1
        if control is not None and ticks % BARRIER_TICKS == 0 and not host.off:
            control.send(Sent(host.take_sent(ONBOARD)))
            told = control.expect(Read)
            host.read(ONBOARD, told.datagrams)
            if told.obstacles:
                host.read(PAYLOAD, told.obstacles)
    channel.receive()  # nothing comes any more


if __name__ == "__main__":
    main(run, AutopilotConfig)
