"""When somebody else takes the vehicle, the companion yields: it stops commanding until it gets its vehicle back.

A flight mode that the companion neither asked for nor has to expect was chosen by a pilot, at a ground station or a
radio, or by the autopilot's own failsafe; `gcs/failsafe.py` tells which. The mode that the companion had commanded,
chosen again, gives it back. A change is believed when it has stood for `SETTLE_US`, longer than the second between two
heartbeats: telemetry older than our own command takes nobody away, and the heartbeat that tells a failsafe has come.
"""

from collections.abc import Collection

SETTLE_US = 1_500_000


class Yielding:
    """Watches the mode of one autopilot."""

    def __init__(self) -> None:
        self.expected: frozenset[str] = frozenset()
        self.yielded_to: str | None = None
        """The mode that was chosen, None while the vehicle is ours."""
        self.to_failsafe = False
        """Whether it was a failsafe that chose it; else a pilot."""
        self._strange_since_us: int | None = None

    def expect(self, modes: Collection[str]) -> None:
        """The modes that are ours from now on; an empty collection: nothing commanded, any mode is fine."""
        if self.expected != frozenset(modes):
            self.expected = frozenset(modes)
            self._strange_since_us = None

    def on_mode(self, now_us: int, mode: str, failsafe: bool = False) -> bool:
        """Looks at the mode, and whether a failsafe acts; True when who has the vehicle has just changed."""
        if not self.expected or mode in self.expected:
            self._strange_since_us = None
            changed = self.yielded_to is not None and mode in self.expected
            if changed:
                self.yielded_to = None
            return changed
        if self.yielded_to is not None:
            self.yielded_to = mode
            changed, self.to_failsafe = failsafe is not self.to_failsafe, failsafe
            return changed
        if self._strange_since_us is None:
            self._strange_since_us = now_us
        if now_us - self._strange_since_us < SETTLE_US:
            return False
        self.yielded_to, self.to_failsafe = mode, failsafe
        return True
