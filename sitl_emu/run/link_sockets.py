"""An autopilot's UDP sockets: one per MAVLink link, on PX4's ports; and the one wait for all sockets of a process.

As PX4 does, a link sends to its standing remote port until somebody speaks to it, and from then on to whoever spoke
first, and nobody else until it restarts. In an isolated run a link has a private socket, joined to its companion's, or
none: then nobody hears what it says, which is counted and logged all the same.
"""

import errno
import select
import socket
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

from sitl_emu.core.ports import LinkPorts

if TYPE_CHECKING:  # a `launch` has no configs, and is up 20 ms sooner without them
    from sitl_emu.run.configs import LinkEnd

RECEIVE_BUFFER_BYTES = 4 << 20
LARGEST_DATAGRAM_BYTES = 8000
"""PX4's receive buffer on POSIX: the rest of a longer datagram is lost."""
AT_ONCE = 32
"""Datagrams of a link that are served before it is another's turn, or time for a tick: a flood must not stop time."""
UNDER_WAY_LIMIT_S = 5.0
LOOPBACK = "127.0.0.1"


class PortInUseError(Exception):
    """A port of a link is taken; the text names port, link and remedy."""


class DatagramLostError(Exception):
    """A datagram that was announced did not come: the kernel dropped it, or its sender has died."""


class PrivateSocket(NamedTuple):
    """A link's socket in an isolated run, on a free port, and the port of its other end."""

    opened: socket.socket
    other_port: int

    @classmethod
    def inherited(cls, end: "LinkEnd") -> "PrivateSocket":
        """What this process was started with."""
        return cls(socket.socket(fileno=end.fd), end.other_port)


class DatagramLink(Protocol):
    """What the sockets need to know of a MAVLink link."""

    name: str
    ports: LinkPorts
    outbox: list[bytes]


Key = TypeVar("Key")


class Poll(Generic[Key]):
    """One wait for many sockets, each known by a key."""

    def __init__(self) -> None:
        self._poll = select.poll()
        self._keys: dict[int, Key] = {}

    def watch(self, fileno: int, key: Key) -> None:
        """Let `wait` tell when this file descriptor can be read."""
        self._keys[fileno] = key
        self._poll.register(fileno, select.POLLIN)

    def forget(self, fileno: int) -> None:
        """Take no notice of a file descriptor any more, which is still open; it need not have been watched."""
        if fileno in self._keys:
            del self._keys[fileno]
            self._poll.unregister(fileno)

    def wait(self, timeout_s: float) -> list[Key]:
        """Keys of what can be read, after at most `timeout_s` (0: look only)."""
        ready = self._poll.poll(max(0.0, timeout_s) * 1000.0)
        return [self._keys[number] for number, _ in ready] if ready else []


class LinkSockets:
    """The sockets of one autopilot, in the order of its links."""

    def __init__(
        self,
        links: Sequence[DatagramLink],
        gcs: tuple[str, int] | None = None,
        isolated: Mapping[str, PrivateSocket] | None = None,
    ) -> None:
        """Bind all links. `gcs`: another host and port for the ground station. Raises PortInUseError.

        `isolated`: by link, the sockets of an isolated run; other links have none then.
        """
        self._links = tuple(links)
        self._gcs = gcs
        self._isolated = isolated
        self._sockets: list[socket.socket | None] = []
        self._sent = [0] * len(self._links)
        self.restart(links)
        try:
            for link in self._links:
                self._sockets.append(_bound(link) if isolated is None else _private(isolated.get(link.name)))
        except PortInUseError:
            self.close()
            raise

    def restart(self, links: Sequence[DatagramLink]) -> None:
        """Serve the same links of an autopilot that has begun anew: its peers are forgotten, the ports stay open."""
        self._links = tuple(links)
        self._spoken_to = [False] * len(self._links)
        self._standing = [(LOOPBACK, self._remote_port(link)) for link in self._links]
        self._peers = [
            self._gcs if self._gcs is not None and link.name == "gcs" else standing
            for link, standing in zip(self._links, self._standing, strict=True)
        ]

    def _remote_port(self, link: DatagramLink) -> int:
        private = self._isolated.get(link.name) if self._isolated is not None else None
        return private.other_port if private is not None else link.ports.remote

    def filenos(self) -> dict[int, int]:
        """File descriptors by the place of their link."""
        return {place: opened.fileno() for place, opened in enumerate(self._sockets) if opened is not None}

    def take_sent(self, index: int) -> int:
        """How many datagrams were sent on a link since this was asked last."""
        sent, self._sent[index] = self._sent[index], 0
        return sent

    def receive(self, index: int, exactly: int | None = None) -> list[bytes]:
        """Datagrams of one link: those that wait, AT_ONCE at most, or `exactly` so many of the standing remote port.

        Those that are announced are waited for, and what others send meanwhile is left aside: it was not announced.
        Raises DatagramLostError when they do not come.
        """
        opened, datagrams = self._sockets[index], list[bytes]()
        if opened is None:
            return datagrams
        announced_by = self._standing[index] if exactly is not None else None
        timeout_s = 0.0 if exactly is None else UNDER_WAY_LIMIT_S
        if opened.gettimeout() != timeout_s:  # to set it is a system call
            opened.settimeout(timeout_s)
        while len(datagrams) < (AT_ONCE if exactly is None else exactly):
            try:
                data, sender = opened.recvfrom(LARGEST_DATAGRAM_BYTES)
            except BlockingIOError:
                break
            except ConnectionError:
                # Some systems report here that the peer's port is closed: it has left, and may come back.
                continue
            except TimeoutError:
                name = self._links[index].name
                raise DatagramLostError(f"{name} link: {len(datagrams)} of {exactly} datagrams came") from None
            if announced_by is not None and sender != announced_by:
                continue
            if not self._spoken_to[index]:
                self._peers[index], self._spoken_to[index] = sender, True
            datagrams.append(data)
        return datagrams

    def flush(self) -> None:
        """Send what lies in the links' outboxes. A datagram for which there is no room is lost, as on any wire."""
        for index, link in enumerate(self._links):
            if link.outbox:
                opened, peer = self._sockets[index], self._peers[index]
                self._sent[index] += len(link.outbox)
                if opened is not None:
                    _send(opened, link.outbox, peer)
                link.outbox.clear()

    def close(self) -> None:
        """Free the ports."""
        for opened in self._sockets:
            if opened is not None:
                opened.close()


_TRANSIENT = {errno.EAGAIN, errno.ENOBUFS, errno.ECONNREFUSED, errno.EPERM, errno.ENETUNREACH, errno.EHOSTUNREACH}


def _send(opened: socket.socket, datagrams: Sequence[bytes], peer: tuple[str, int]) -> None:
    send = opened.sendto
    for data in datagrams:
        try:
            send(data, peer)
        except OSError as error:
            if error.errno not in _TRANSIENT:
                raise


def _private(private: PrivateSocket | None) -> socket.socket | None:
    """A private socket made ready, or none."""
    if private is None:
        return None
    private.opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    private.opened.setblocking(False)
    return private.opened


def _bound(link: DatagramLink) -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        opened.bind(("0.0.0.0", link.ports.local))
    except OSError as error:
        opened.close()
        if error.errno != errno.EADDRINUSE:
            raise
        raise PortInUseError(
            f"UDP port {link.ports.local} (the autopilot's {link.name} link) is in use; "
            "end the program that holds it, or choose another --instance"
        ) from None
    opened.setblocking(False)
    return opened
