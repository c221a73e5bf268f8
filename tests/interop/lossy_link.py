"""A UDP link that loses datagrams, for real sockets: between a client and an autopilot, by chance with a seed."""

import random
import selectors
import socket
import threading
from types import TracebackType

LARGEST_DATAGRAM_BYTES = 65535
WAKE_S = 0.2
HOST = "127.0.0.1"


class LossyLink:
    """Stands at a port of its own; whoever speaks there speaks with the autopilot. Use it in a `with` block."""

    def __init__(self, autopilot_port: int, seed: int = 1) -> None:
        self.loss = 0.0
        """Of each way; may be changed at any time."""
        self.lost = 0
        self._autopilot = (HOST, autopilot_port)
        self._client: tuple[str, int] | None = None
        self._chance = random.Random(seed)
        self._client_side, self._autopilot_side = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self._client_side.bind((HOST, 0))
        self._autopilot_side.bind((HOST, 0))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._carry)

    @property
    def port(self) -> int:
        """Where clients speak to."""
        return int(self._client_side.getsockname()[1])

    def __enter__(self) -> "LossyLink":
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()
        self._client_side.close()
        self._autopilot_side.close()

    def _carry(self) -> None:
        with selectors.DefaultSelector() as ready:
            for side in (self._client_side, self._autopilot_side):
                ready.register(side, selectors.EVENT_READ)
            while not self._ended.is_set():
                for key, _ in ready.select(WAKE_S):
                    self._pass_on(key.fileobj is self._client_side)

    def _pass_on(self, from_client: bool) -> None:
        source = self._client_side if from_client else self._autopilot_side
        try:
            data, sender = source.recvfrom(LARGEST_DATAGRAM_BYTES)
        except ConnectionError:  # the other end is gone for now
            return
        if from_client:
            self._client = sender
        if self._chance.random() < self.loss:
            self.lost += 1
        elif from_client:
            self._autopilot_side.sendto(data, self._autopilot)
        elif self._client is not None:
            self._client_side.sendto(data, self._client)
