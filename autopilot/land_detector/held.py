"""A condition that counts once it has held for a time (PX4's lib/hysteresis)."""


class Held:
    """A condition that counts once it has held for a time; its end counts at once."""

    def __init__(self, state: bool) -> None:
        self.state = state
        self._since_us: int | None = None

    def update(self, now_us: int, condition: bool, for_s: float) -> bool:
        """The state now."""
        if not condition:
            self.state, self._since_us = False, None
        elif not self.state:
            if self._since_us is None:
                self._since_us = now_us
            self.state = now_us - self._since_us >= for_s * 1e6
        return self.state
