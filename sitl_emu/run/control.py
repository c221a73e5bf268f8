"""The control channel between the processes of a run: messages (`messages.py`) on an inherited socket.

The world process holds one to every other process and to the launcher.
"""

import math
import os
import socket
import struct
from pathlib import Path
from typing import TypeVar

from sitl_emu.run.messages import Message, decoded, encoded

LENGTH = struct.Struct("<I")
RECEIVE_BYTES = 1 << 16
CREDENTIALS = struct.Struct("=iII")
"""Linux's `struct ucred`: process, user, group."""
BARRIER_LIMIT_S = 60.0
"""Wall time after which a process that is silent, and does nothing, counts as hung."""
LOOK_S = 1.0
"""How often it is looked whether a silent process works: not before it is silent, as barriers come every 20 ms."""
BUSY_LIMIT_S = 600.0
"""The same of one that has used the CPU meanwhile: a camera's first picture after a fresh install waits for the
compiler, which with other work beside it takes minutes."""

Kind = TypeVar("Kind", bound=Message)


class ProcessLostError(Exception):
    """The process at the other end has died or hangs; the text says which."""


class ControlChannel:
    """One end of a control channel."""

    def __init__(self, opened: socket.socket, other: str, hung_after_s: float = BARRIER_LIMIT_S) -> None:
        """`other`: what the process at the other end is called, for people.

        Silent, and without having used the CPU, for `hung_after_s` of wall time it counts as hung.
        """
        self.other, self._hung_after_s = other, hung_after_s
        self._socket = opened
        self._buffer = bytearray()
        self._pid: int | None = None
        """The process at the other end, once it has said something."""
        opened.settimeout(BARRIER_LIMIT_S)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)

    def fileno(self) -> int:
        """For select."""
        return self._socket.fileno()

    def send(self, message: Message) -> None:
        """Send a message. Raises ProcessLostError."""
        body = encoded(message)
        try:
            self._socket.sendall(LENGTH.pack(len(body)) + body)
        except OSError as error:
            raise ProcessLostError(f"{self.other} has gone ({error.strerror or error})") from None

    def offer(self, message: Message) -> bool:
        """Send a message where there is room, on a socket that keeps packets apart; whether it was sent.

        Raises ProcessLostError.
        """
        body = encoded(message)
        self._socket.setblocking(False)  # with a time-out Python waits for room first, MSG_DONTWAIT or not
        try:
            self._socket.send(LENGTH.pack(len(body)) + body)
        except BlockingIOError:
            return False
        except OSError as error:
            raise ProcessLostError(f"{self.other} has gone ({error.strerror or error})") from None
        finally:
            self._socket.settimeout(BARRIER_LIMIT_S)
        return True

    def receive(self) -> Message:
        """The next message; waits for it. Raises ProcessLostError."""
        while (message := self._parse()) is None:
            try:
                data = self._wait()
            except OSError as error:
                raise ProcessLostError(f"{self.other} has gone ({error.strerror or error})") from None
            if not data:
                raise ProcessLostError(f"{self.other} has gone")
            self._buffer += data
        return message

    def _wait(self) -> bytes:
        """What comes next; waits for it. Raises ProcessLostError for a process that hangs, OSError as `recv` does."""
        look_s = min(LOOK_S, self._hung_after_s)
        self._socket.settimeout(look_s)
        try:
            return self._received_while_it_works(look_s)
        finally:
            self._socket.settimeout(BARRIER_LIMIT_S)

    def _received_while_it_works(self, look_s: float) -> bytes:
        waited_s = idle_s = 0.0
        worked_s = math.inf
        while True:
            try:
                data, beside, _, _ = self._socket.recvmsg(RECEIVE_BYTES, socket.CMSG_SPACE(CREDENTIALS.size))
            except TimeoutError:
                now_s = cpu_s(self._pid)
                idle_s = idle_s + look_s if now_s == worked_s else 0.0
                waited_s, worked_s = waited_s + look_s, now_s
                if idle_s >= self._hung_after_s or waited_s >= BUSY_LIMIT_S:
                    raise ProcessLostError(f"{self.other} has not answered for {waited_s:g} s") from None
                continue
            for level, kind, told in beside:
                if (level, kind) == (socket.SOL_SOCKET, socket.SCM_CREDENTIALS):
                    self._pid = CREDENTIALS.unpack(told)[0]
            return data

    def expect(self, kind: type[Kind]) -> Kind:
        """The next message, which is of this kind; waits for it. Raises ProcessLostError."""
        message = self.receive()
        if not isinstance(message, kind):
            raise TypeError(f"{self.other} said {message}, where {kind.__name__} was due")
        return message

    def poll(self) -> Message | None:
        """The next message if one is there. Raises ProcessLostError."""
        if (message := self._parse()) is not None:
            return message
        self._socket.setblocking(False)
        try:
            data = self._socket.recv(RECEIVE_BYTES)
        except BlockingIOError:
            return None
        except OSError as error:
            raise ProcessLostError(f"{self.other} has gone ({error.strerror or error})") from None
        finally:
            self._socket.settimeout(BARRIER_LIMIT_S)
        if not data:
            raise ProcessLostError(f"{self.other} has gone")
        self._buffer += data
        return self._parse()

    def close(self) -> None:
        """Close this end."""
        self._socket.close()

    def _parse(self) -> Message | None:
        buffer = self._buffer
        if len(buffer) < LENGTH.size:
            return None
        end = LENGTH.size + LENGTH.unpack_from(buffer)[0]
        if len(buffer) < end:
            return None
        message = decoded(buffer[LENGTH.size : end])
        del buffer[:end]
        return message


def cpu_s(pid: int | None) -> float:
    """CPU time that a process has used so far, by all of its threads (proc(5)); 0 where nobody knows."""
    try:
        after_name = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(after_name[11]) + int(after_name[12])) / os.sysconf("SC_CLK_TCK")


def inherited(number: int, other: str) -> ControlChannel:
    """The channel on a file descriptor that this process was started with."""
    return ControlChannel(socket.socket(fileno=number), other)
