"""MAVLink links of a companion: ports that carry bytes, and what makes messages of them.

| URL | port |
| --- | --- |
| `udpin:HOST:PORT` | waits there, and answers whoever sent last |
| `udpout:HOST:PORT` | speaks there first |
| `/dev/ttyX[:BAUD]` | a serial port |

A host's name is looked up once, when the port is opened. A simulated run joins two fixed UDP ports of one machine
instead, and reads exactly as many datagrams as it is told. TCP, MAVLink signing and several peers on one
socket are not supported.
"""

import errno
import re
import select
import socket
from collections.abc import Mapping
from typing import Protocol

from sitl_emu.core import dialect as mavlink
from sitl_emu.core.framing import Splitter, split
from sitl_emu.gcs.tlog import TlogWriter
from sitl_emu.missions.companion.logs import Log
from sitl_emu.missions.companion.wire import Wire

DEFAULT_BAUD = 921600
LARGEST_DATAGRAM_BYTES = 65535
RECEIVE_BUFFER_BYTES = 4 << 20
SERIAL_READ_BYTES = 4096
NUMBER = re.compile(r"[0-9]{1,9}")
TRANSIENT = {
    errno.EAGAIN,
    errno.ENOBUFS,
    errno.ENOMEM,
    errno.EINTR,
    errno.EPERM,
    errno.ECONNREFUSED,
    errno.ENETDOWN,
    errno.ENETUNREACH,
    errno.EHOSTDOWN,
    errno.EHOSTUNREACH,
    errno.EADDRNOTAVAIL,
    errno.ENODEV,
}
"""What loses a datagram and may pass: nobody listens there yet, a radio is down, there is no room."""
ANY_HOST = "0.0.0.0"
STRANGER = 255
"""The system that we speak as until our vehicle's is known."""
Address = tuple[str, int]


class LinkError(Exception):
    """A link that can't be opened, or brings nothing; one line for people."""


class Port(Protocol):
    """Bytes in and out."""

    @property
    def error(self) -> str:
        """Why nothing comes, where the port itself has failed, a line for people; "" while it works."""
        ...

    def fileno(self) -> int:
        """For select."""
        ...

    def receive(self) -> bytes | None:
        """What has come: whole frames; None if nothing has."""
        ...

    def send(self, frame: bytes) -> None:
        """Send a frame; what can't be sent now is lost, as on any radio. Raises LinkError for what never can be."""
        ...

    def close(self) -> None:
        """Let the port go."""
        ...


class UdpPort:
    """Datagrams to and from one address, or whoever sent last."""

    error = ""

    def __init__(
        self,
        local: Address | socket.socket | None,
        remote: Address | None,
        *,
        remote_alone: bool = False,
        wait_s: float = 0.0,
    ) -> None:
        """`local` None: any port; `remote` None: whoever sent last. Raises LinkError when a port can't be bound.

        `local` may be a bound socket, too.

        `remote_alone`: datagrams from elsewhere are left aside (from instance 9 on, every PX4 of a machine sends to one
        port). `wait_s`: how long `receive` waits for a datagram.
        """
        self._remote, self._follow, self._remote_alone = remote, remote is None, remote_alone
        self._sent = False
        self._socket = local if isinstance(local, socket.socket) else socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self._socket.settimeout(wait_s)
        if local is not None and not isinstance(local, socket.socket):
            try:
                self._socket.bind(local)
            except OSError as error:
                self._socket.close()
                raise LinkError(
                    f"UDP port {local[1]} can't be bound ({error.strerror}); end the program that holds it, "
                    "or take another"
                ) from None

    @property
    def address(self) -> Address:
        """The local address."""
        host, port = self._socket.getsockname()
        return str(host), int(port)

    def fileno(self) -> int:
        """For select."""
        return self._socket.fileno()

    def receive(self) -> bytes | None:
        """One datagram; None if there is none."""
        while True:
            try:
                data, sender = self._socket.recvfrom(LARGEST_DATAGRAM_BYTES)
            except OSError:
                return None
            if self._follow and sender[1]:  # to port 0 nobody can be answered
                self._remote = sender
            if not self._remote_alone or sender == self._remote:
                return data

    def send(self, frame: bytes) -> None:
        """Send a datagram, to nobody as long as nobody is known. Where one could be sent before, none ends a flight."""
        if self._remote is not None:
            try:
                self._socket.sendto(frame, self._remote)
                self._sent = True
            except OSError as error:
                if not self._sent and not isinstance(error, TimeoutError) and error.errno not in TRANSIENT:
                    host, port = self._remote
                    raise LinkError(
                        f"nothing can be sent to UDP {host}:{port}: {error.strerror}; give another address"
                    ) from None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class SerialPort:
    """A serial port; needs pyserial. Frames are put together from the bytes as they come."""

    def __init__(self, device: str, baud: int) -> None:
        """Raises LinkError when the device can't be opened, or pyserial is not there."""
        try:
            import serial  # type: ignore[import-untyped,unused-ignore]
        except ImportError:
            raise LinkError(f"{device}: a serial link needs pyserial: pip install pyserial") from None
        try:
            self._serial = serial.Serial(device, baud, timeout=0, write_timeout=0.2)
        except (OSError, ValueError) as error:
            raise LinkError(f"{device}: can't be opened: {error}") from None
        self._device, self._splitter = device, Splitter()
        self.error = ""

    def fileno(self) -> int:
        """For select."""
        return int(self._serial.fileno())

    def receive(self) -> bytes | None:
        """Whole frames of what has come. A device that is unplugged brings nothing, and ends no flight."""
        try:
            data = bytes(self._serial.read(SERIAL_READ_BYTES))
        except OSError as error:  # serial.SerialException is one
            self.error = f"{self._device}: can't be read: {error}"
            return None
        self.error = ""
        return b"".join(self._splitter.feed(data)) or None

    def send(self, frame: bytes) -> None:
        """Write a frame."""
        try:
            self._serial.write(frame)
        except OSError:
            return

    def close(self) -> None:
        """Close the device."""
        self._serial.close()


def open_port(url: str) -> Port:
    """Opens a port by its URL. Raises LinkError."""
    if url.startswith("/dev/"):
        device, _, baud = url.partition(":")
        if baud and not NUMBER.fullmatch(baud):
            raise LinkError(f"{url}: {baud!r}; allowed: a baud rate, as in /dev/ttyUSB0:921600")
        return SerialPort(device, int(baud or DEFAULT_BAUD))
    parts = url.replace("://", ":").split(":")
    waits = parts[0] == "udpin"
    if len(parts) != 3 or not (waits or parts[0] == "udpout") or not _is_port(parts[2], 0 if waits else 1):
        raise LinkError(f"{url!r}: no link; allowed: udpin:HOST:PORT, udpout:HOST:PORT, /dev/ttyX[:BAUD]")
    address = _resolved(url, parts[1] or ANY_HOST), int(parts[2])
    return UdpPort(address, None) if waits else UdpPort(None, address)


def _is_port(text: str, least: int) -> bool:
    return NUMBER.fullmatch(text) is not None and least <= int(text) <= 65535


def _resolved(url: str, host: str) -> str:
    """The host's address, looked up once: in flight nothing waits for a name. Raises LinkError."""
    try:
        found = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "no name of a host"
        remedy = "correct the name, or give the host's address, as in udpout:192.168.1.7:14600"
        raise LinkError(f"{url}: host {host!r} can't be resolved ({why}); {remedy}") from None
    return str(found[0][4][0])


class Link:
    """Messages on a port, all of them logged."""

    def __init__(self, port: Port, log: TlogWriter | None = None, epoch_us: int = 0) -> None:
        """`epoch_us`: what has to be added to the runner's time to give microseconds since 1970, for the log."""
        self.port, self.wire = port, Wire()
        self.sent = 0
        """Messages sent, each a datagram."""
        self._log, self._epoch_us = Log(log.path, log) if log is not None else None, epoch_us

    @property
    def errors(self) -> list[str]:
        """What of port and log has failed, each a line for people."""
        return [each for each in (self.port.error, self._log.error if self._log is not None else "") if each]

    def receive(self, now_us: int) -> list[mavlink.MAVLink_message] | None:
        """The messages of what has come next; None if nothing has."""
        data = self.port.receive()
        if data is None:
            return None
        if self._log is not None:
            for frame in split(data):
                self._write_down(now_us, frame)
        return self.wire.decode(data)

    def receive_exactly(self, now_us: int, count: int) -> list[mavlink.MAVLink_message]:
        """The messages of the next `count` datagrams. Raises LinkError if one of them does not come."""
        messages = list[mavlink.MAVLink_message]()
        for number in range(count):
            received = self.receive(now_us)
            if received is None:
                raise LinkError(f"of {count} datagrams that were sent to us {count - number} have not come")
            messages += received
        return messages

    def send(self, now_us: int, system: int, message: mavlink.MAVLink_message) -> None:
        """Sends one message, as the companion of this system (0: not known yet). Raises LinkError."""
        self.wire.system = system or STRANGER
        frame = self.wire.encode(message)
        self._write_down(now_us, frame)
        self.port.send(frame)
        self.sent += 1

    def close(self) -> None:
        """Makes the log whole, lets the port go."""
        if self._log is not None:
            self._log.close()
        self.port.close()

    def _write_down(self, now_us: int, frame: bytes) -> None:
        if self._log is not None:
            self._log.write(lambda log: log.write(self._epoch_us + now_us, frame))


def wait(links: Mapping[str, Link], timeout_s: float) -> list[str]:
    """The links on which something has come; waits for it, at most so long.

    A port that has failed is tried again each time, and not waited for: select takes a device that has gone for ready.
    """
    readable, _, _ = select.select([link.port for link in links.values() if not link.port.error], [], [], timeout_s)
    return [name for name, link in links.items() if link.port in readable or link.port.error]
