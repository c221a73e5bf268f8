"""PING: how long a message takes there and back, and how many do not come back.

Source: https://mavlink.io/en/services/ping.html: a ping to nobody is answered by everybody who hears it, with the
asker's time and number and the asker as target.
"""

from sitl_emu.core import dialect as mavlink

PERIOD_US = 1_000_000


class Ping:
    """Pings once a second; hears one component."""

    def __init__(self, system: int, component: int = 1) -> None:
        self.source = (system, component)
        self.sent = 0
        self.answered = 0
        self.round_trip_us: int | None = None
        """Of the last one that was answered."""
        self._open: set[int] = set()
        self._due_us: int | None = None

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Answers another's ping; takes the answer to ours."""
        if msg.get_type() != "PING" or (msg.get_srcSystem(), msg.get_srcComponent()) != self.source:
            return []
        if (msg.target_system, msg.target_component) == (0, 0):
            return [mavlink.MAVLink_ping_message(msg.time_usec, msg.seq, *self.source)]
        if msg.seq in self._open:
            self._open.discard(msg.seq)
            self.answered += 1
            self.round_trip_us = now_us - msg.time_usec
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """The ping that is due. One that was not answered by then is given up."""
        if self._due_us is not None and now_us < self._due_us:
            return []
        self._due_us = now_us + PERIOD_US
        self._open = {self.sent}
        self.sent += 1
        return [mavlink.MAVLink_ping_message(now_us, self.sent - 1, 0, 0)]
