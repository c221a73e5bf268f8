"""What is said to a component again and again until it is answered or given up."""

from sitl_emu.core import dialect as mavlink

TIMEOUT_US = 500_000
TRIES = 10


class Question:
    """Asks every TIMEOUT_US, TRIES times; a kind of question says what (`_messages`) and hears the answer."""

    def __init__(self, target_system: int, target_component: int = 1) -> None:
        self.target = (target_system, target_component)
        self.done = False
        self.refusal = ""
        """Why there is no answer, in words."""
        self._sent = 0
        self._due_us = 0

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks, again after each time limit."""
        if self.done or (self._sent and now_us < self._due_us):
            return []
        if self._sent >= TRIES:
            self.done, self.refusal = True, f"no answer to {TRIES} tries"
            return []
        self._sent += 1
        self._due_us = now_us + TIMEOUT_US
        return self._messages()

    def _messages(self) -> list[mavlink.MAVLink_message]:
        raise NotImplementedError
