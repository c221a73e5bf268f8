"""The control channel between the processes of a run: JSON messages on an inherited socket.

The world process holds one to every other process and to the launcher; what is said on them is listed here. They carry
simulated time and counts of datagrams, so that every process steps when, and reads what, it should (lockstep):

====================  ==================================================================================
autopilot → world     `{"sent": n}` after every fifth tick: datagrams sent on its onboard link since the last
world → autopilot     `{"read": n}`: so many datagrams of its companion to read before its next tick
world → companion     `{"step": now_us, "autopilot": n, "peer": n, "frames": [[index, time_us], …]}`
                      (autopilot null: whatever is there, of one from outside)
companion → world     `{"autopilot": n, "peer": n, "status": [...], "events": [...], "dropped": n}`
world → camera        `{"render": index, "time": time_us, "pose": [north_m, east_m, down_m, w, x, y, z]}`
camera → world        `{"done": index}`
any → world           `{"waiting": true}`: set up, but for what others must have ready
world → any           `{"start": true}`: that is ready (an autopilot's simulator, a companion's camera)
any → world           `{"ready": true, …}` when it is set up
world → any           `{"end": true}`: the run is over
world → launcher      `{"listening": true, …}`, `{"status": {…}}`, `{"event": {…}}`, `{"over": {…}}`
launcher → world      `{"stop": "why"}`, `{"command_ended": [vehicle, exit status]}`
world → launcher      `{"kill": title}`: a fault of the scenario; answered by `{"killed": title}` when it is dead
====================  ==================================================================================
"""

import json
import socket
import struct
from typing import Any

LENGTH = struct.Struct("<I")
RECEIVE_BYTES = 1 << 16
BARRIER_LIMIT_S = 60.0
"""Wall time after which a silent process counts as hung."""

Message = dict[str, Any]


class ProcessLostError(Exception):
    """The process at the other end has died or hangs; the text says which."""


class ControlChannel:
    """One end of a control channel."""

    def __init__(self, opened: socket.socket, other: str) -> None:
        """`other`: what the process at the other end is called, for people."""
        self.other = other
        self._socket = opened
        self._buffer = bytearray()
        opened.settimeout(BARRIER_LIMIT_S)

    def fileno(self) -> int:
        """For select."""
        return self._socket.fileno()

    def send(self, message: Message) -> None:
        """Send a message. Raises ProcessLostError."""
        body = json.dumps(message, separators=(",", ":")).encode()
        try:
            self._socket.sendall(LENGTH.pack(len(body)) + body)
        except OSError as error:
            raise ProcessLostError(f"{self.other} has gone ({error.strerror or error})") from None

    def receive(self) -> Message:
        """The next message; waits for it. Raises ProcessLostError."""
        while (message := self._parse()) is None:
            try:
                data = self._socket.recv(RECEIVE_BYTES)
            except TimeoutError:
                raise ProcessLostError(f"{self.other} has not answered for {BARRIER_LIMIT_S:.0f} s") from None
            except OSError as error:
                raise ProcessLostError(f"{self.other} has gone ({error.strerror or error})") from None
            if not data:
                raise ProcessLostError(f"{self.other} has gone")
            self._buffer += data
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
        message: Message = json.loads(buffer[LENGTH.size : end])
        del buffer[:end]
        return message


def inherited(number: int, other: str) -> ControlChannel:
    """The channel on a file descriptor that this process was started with."""
    return ControlChannel(socket.socket(fileno=number), other)
