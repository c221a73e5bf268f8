"""The autopilot's UDP sockets: one per MAVLink link, on PX4's ports. Nothing else here opens one.

As PX4 does, a link sends to its standing remote port until somebody speaks to it, and from then on to whoever spoke
first, and nobody else until it restarts.
"""

import errno
import select
import socket
from collections.abc import Sequence
from typing import Protocol

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


class LinkSockets:
    """The sockets of one autopilot, in the order of its links."""

    def __init__(self, links: Sequence[DatagramLink], gcs: tuple[str, int] | None = None) -> None:
        """Bind all links. `gcs`: another host and port for the ground station. Raises PortInUseError."""
        self._links = tuple(links)
        self._sockets: list[socket.socket] = []
        self._index_of: dict[int, int] = {}
        self._peers: list[tuple[str, int]] = []
        self._spoken_to = [False] * len(self._links)
        self.watched_ready = False
        """Whether what is watched could be read when `wait` returned."""
        self._poll = select.poll()
        try:
            for index, link in enumerate(self._links):
                opened = _bound(link)
                self._sockets.append(opened)
                self._index_of[opened.fileno()] = index
                self._poll.register(opened.fileno(), select.POLLIN)
                remote = (LOOPBACK, link.ports.remote)
                self._peers.append(gcs if gcs is not None and link.name == "gcs" else remote)
        except PortInUseError:
            self.close()
            raise

    def watch(self, fileno: int) -> None:
        """Let `wait` return also when this file descriptor can be read."""
        self._poll.register(fileno, select.POLLIN)

    def leave_out(self, index: int) -> None:
        """Let `wait` take no notice of a link, whose datagrams are read by number (lockstep)."""
        self._poll.unregister(self._sockets[index].fileno())

    def wait(self, timeout_s: float) -> list[int]:
        """Indices of the links where datagrams wait, after at most `timeout_s` (0: look only)."""
        ready = self._poll.poll(max(0.0, timeout_s) * 1000.0)
        links = [self._index_of[number] for number, _ in ready if number in self._index_of] if ready else []
        self.watched_ready = len(links) < len(ready)
        return links

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
