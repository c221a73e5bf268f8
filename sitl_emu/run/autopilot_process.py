"""The process of one autopilot in a run: the emulated PX4, its sockets, and the simulator at TCP 4560+i.

It steps whenever HIL_SENSOR comes. In lockstep with a companion of ours it says after every fifth tick how many
datagrams it sent on the onboard link, and reads as many as it is told; ground station, payload and gimbal links, and
the onboard link of any other companion, are answered at once. What passes on its links is logged (.tlog), stamped with
the scenario's start date plus simulated time.
"""

from pathlib import Path

from autopilot import storage
from autopilot.autopilot import Autopilot
from autopilot.sockets import LinkSockets, PortInUseError
from gcs.tlog import TlogWriter
from sitl_emu.core import ports
from sitl_emu.core.framing import split
from sitl_emu.core.tcp_channel import connect
from sitl_emu.run import models, payload
from sitl_emu.run.conductor import BARRIER_TICKS
from sitl_emu.run.configs import AutopilotConfig
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.process import StartError, main, settle
from sitl_emu.run.simulated_parameters import SimulatedParameters

ONBOARD = 1
"""Index of the onboard link."""
WAIT_S = 1.0
ROOTFS = "rootfs"
"""In the run's folder: the file systems of its autopilots, a folder each, named as the vehicle."""


class Logs:
    """A .tlog for each link."""

    def __init__(self, folder: Path, vehicle: str, links: list[str], start_us: int) -> None:
        self._start_us = start_us
        self._writers = [TlogWriter(folder / f"{vehicle}-{link}.tlog") for link in links]

    def write(self, now_us: int, link: int, datagram: bytes) -> None:
        """A datagram that came or went."""
        time_us, write = self._start_us + now_us, self._writers[link].write
        for frame in split(datagram):
            write(time_us, frame)

    def close(self) -> None:
        """Make the files whole."""
        for writer in self._writers:
            writer.close()


class LoggedAutopilot:
    """The autopilot with its sockets and logs: what comes in and goes out passes here."""

    def __init__(self, autopilot: Autopilot, sockets: LinkSockets, logs: Logs) -> None:
        self._autopilot, self._sockets, self._logs = autopilot, sockets, logs
        self.sent = 0
        """Datagrams sent on the onboard link since the last barrier."""

    def read(self, link: int, exactly: int | None = None) -> None:
        """Read a link's datagrams and hand them to the autopilot."""
        for datagram in self._sockets.receive(link, exactly):
            self._logs.write(self._autopilot.now_us, link, datagram)
            self._autopilot.on_datagram(link, datagram)

    def flush(self) -> None:
        """Send what the autopilot has to say."""
        links = self._autopilot.mavlink.links
        self.sent += len(links[ONBOARD].outbox)
        for index, link in enumerate(links):
            for datagram in link.outbox:
                self._logs.write(self._autopilot.now_us, index, datagram)
        self._sockets.flush()


def show_flight_logs(root: Path, names: list[str], shown: Path) -> None:
    """Let the ULogs of a run be found in its folder: `<vehicle>.ulg` and, for more, `<vehicle>-2.ulg` and so on."""
    for number, name in enumerate(names, 1):
        link = shown.with_name(f"{shown.name}.ulg" if number == 1 else f"{shown.name}-{number}.ulg")
        link.symlink_to((root / storage.LOG / name).relative_to(link.parent))


def run(config: AutopilotConfig, control: ControlChannel) -> None:
    """Fly until the simulator closes the channel."""
    instance, lockstep = config.instance, config.lockstep
    root = Path(config.folder) / ROOTFS / config.name
    try:
        storage.prepare(root)
    except storage.StorageError as error:
        raise StartError(str(error)) from None
    vehicle = models.as_set(config.model)
    autopilot = Autopilot(vehicle.airframe, instance, root)
    autopilot.mavlink.context.boot_unix_us = config.start_us
    payload.plug_in(vehicle, autopilot)
    try:
        sockets = LinkSockets(autopilot.mavlink.links, config.gcs)
    except PortInUseError as error:
        raise StartError(str(error)) from None
    names = [link.name for link in autopilot.mavlink.links]
    logs = Logs(Path(config.folder), config.name, names, config.start_us)
    try:
        control.send({"waiting": True})
        control.receive()
        channel = connect(ports.simulator(instance))
        sockets.watch(channel.fileno())
        if lockstep:
            sockets.leave_out(ONBOARD)
        control.send({"ready": True})
        settle()
        simulated_parameters = SimulatedParameters(autopilot.parameters)
        logged = LoggedAutopilot(autopilot, sockets, logs)
        ticks = 0
        while True:
            while ready := sockets.wait(WAIT_S):
                for link in ready:
                    logged.read(link)
                logged.flush()
                if sockets.watched_ready:
                    break
            channel.send(autopilot.step(channel.receive()), simulated_parameters.changed())
            logged.flush()
            ticks += 1
            if lockstep and ticks % BARRIER_TICKS == 0:
                control.send({"sent": logged.sent})
                logged.sent = 0
                logged.read(ONBOARD, control.receive()["read"])
                logged.flush()
    finally:
        logs.close()
        sockets.close()
        autopilot.close()
        show_flight_logs(root, autopilot.logger.files, Path(config.folder) / config.name)


if __name__ == "__main__":
    main(run, AutopilotConfig)
