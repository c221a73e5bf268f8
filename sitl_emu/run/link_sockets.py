"""An autopilot's UDP sockets: one per MAVLink link, on PX4's ports; and the one wait for all sockets of a process.

As PX4 does, a link sends to its standing remote port until somebody speaks to it, and from then on to whoever spoke
first, and nobody else until it restarts.
"""

import errno
import select
import socket
from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar

from sitl_emu.core.ports import LinkPorts

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

    def __init__(self, links: Sequence[DatagramLink], gcs: tuple[str, int] | None = None) -> None:
        """Bind all links. `gcs`: another host and port for the ground station. Raises PortInUseError."""
        self._links = tuple(links)
        self._gcs = gcs
        self._sockets: list[socket.socket] = []
        self._sent = [0] * len(self._links)
        self.restart(links)
        try:
            for link in self._links:
                self._sockets.append(_bound(link))
        except PortInUseError:
            self.close()
            raise

    def restart(self, links: Sequence[DatagramLink]) -> None:
        """Serve the same links of an autopilot that has begun anew: its peers are forgotten, the ports stay open."""
        self._links = tuple(links)
        self._spoken_to = [False] * len(self._links)
        self._peers = [
            self._gcs if self._gcs is not None and link.name == "gcs" else (LOOPBACK, link.ports.remote)
            for link in self._links
        ]

    def filenos(self) -> list[int]:
        """File descriptors, in the order of the links."""
        return [opened.fileno() for opened in self._sockets]

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
        announced_by = (LOOPBACK, self._links[index].ports.remote) if exactly is not None else None
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
                send, peer = self._sockets[index].sendto, self._peers[index]
                self._sent[index] += len(link.outbox)
                for data in link.outbox:
                    try:
                        send(data, peer)
                    except OSError as error:
                        if error.errno not in _TRANSIENT:
                            raise
                link.outbox.clear()

    def close(self) -> None:
        """Free the ports."""
        for opened in self._sockets:
            opened.close()


_TRANSIENT = {errno.EAGAIN, errno.ENOBUFS, errno.ECONNREFUSED, errno.EPERM, errno.ENETUNREACH, errno.EHOSTUNREACH}


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
