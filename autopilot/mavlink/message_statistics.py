"""How often each message comes in on a link: MavlinkReceiver's statistics (mavlink_receiver.cpp, v1.18).

They are kept from the first `mavlink status` on, which asks for them and shows them.
"""

import math
from typing import Final, NamedTuple

SLOTS: Final = 16
"""MAX_MSG_STAT_SLOTS: messages that come when all are taken are not counted."""
SHOWN_MS: Final = 10_000
"""Those that were heard since are shown."""
Sender = tuple[int, int]
"""System and component."""


class MessageRate(NamedTuple):
    """One message's, of one sender; the rate is NaN until a second one came, and forgets slowly."""

    rate_hz: float
    heard_ms: int


class MessageStatistics:
    """Of one link."""

    def __init__(self) -> None:
        self._rates: dict[tuple[Sender, int], MessageRate] = {}

    def count(self, now_us: int, sender: Sender, message_id: int) -> None:
        """A message came (update_message_statistics)."""
        now_ms = now_us // 1000
        before = self._rates.get((sender, message_id))
        if before is None:
            if len(self._rates) < SLOTS:
                self._rates[sender, message_id] = MessageRate(math.nan, now_ms)
            return
        rate_hz = 0.0
        if before.heard_ms and now_ms > before.heard_ms:
            rate_hz = 1000.0 / (now_ms - before.heard_ms)
            if math.isfinite(before.rate_hz):
                rate_hz = 0.9 * before.rate_hz + 0.1 * rate_hz
        self._rates[sender, message_id] = MessageRate(rate_hz, now_ms)

    def shown(self, now_us: int, sender: Sender) -> list[tuple[int, float, float]]:
        """A sender's messages of the last ten seconds: id, rate in Hz, seconds since the last; PX4 fills from below."""
        now_ms = now_us // 1000
        return [
            (message_id, rate.rate_hz, (now_ms - rate.heard_ms) / 1000.0)
            for (who, message_id), rate in reversed(self._rates.items())
            if who == sender and rate.heard_ms and now_ms - rate.heard_ms < SHOWN_MS
        ]
