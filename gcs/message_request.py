"""One message, asked for until it comes.

Source: https://mavlink.io/en/messages/common.html#MAV_CMD_REQUEST_MESSAGE: the component acknowledges, and sends the
message. Either can be lost: a message that comes without its ack is what was wanted, and after an ack without its
message it is asked for again. So it is after a DENIED, as PX4 denies a message of which there is nothing new, or
nothing yet (mavlink_stream.h: MavlinkStream::request_message).
"""

from collections.abc import Callable, Sequence
from typing import Any

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import TIMEOUT_US, TRIES, Command

REQUEST_MESSAGE = 512


def anything(msg: Any) -> bool:
    """Wants each message of the kind."""
    return True


class MessageRequest:
    """Asks one component for a message; `message` is what came, None when `refusal` says why not."""

    def __init__(
        self,
        target_system: int,
        message_id: int,
        target_component: int = 1,
        params: Sequence[float] = (),
        wanted: Callable[[Any], bool] = anything,
        tries: int = TRIES,
        *,
        denied_is_final: bool = False,
    ) -> None:
        """`params`: what the message wants to know, from param2 on; `wanted` tells one answer from another.

        `denied_is_final`: of what is there at once or never.
        """
        self.target = (target_system, target_component)
        self.message_id = message_id
        self.params, self.wanted, self.tries = tuple(params), wanted, tries
        self._denied_is_final, self._denial = denied_is_final, ""
        self.message: Any = None
        self.refusal = ""
        self._tried = 0
        self._due_us = 0
        self._command = self._anew()

    @property
    def done(self) -> bool:
        """True when the message is there, was refused or did not come."""
        return self.message is not None or bool(self.refusal)

    def on_message(self, now_us: int, msg: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        """Hears the message and the ack."""
        if self.done or not self._tried or (msg.get_srcSystem(), msg.get_srcComponent()) != self.target:
            return []
        if msg.get_msgId() == self.message_id and self.wanted(msg):
            self.message = msg
        elif msg.get_type() == "COMMAND_ACK" and not self._command.done:
            self._command.on_message(now_us, msg)
            outcome = self._command.outcome
            if outcome is not None:
                self._due_us = now_us + TIMEOUT_US
                if outcome.result == mavlink.MAV_RESULT_DENIED and not self._denied_is_final:
                    self._denial = outcome.text
                elif not outcome.accepted:
                    self.refusal = outcome.text
        return []

    def on_time(self, now_us: int) -> list[mavlink.MAVLink_message]:
        """Asks, again after each time limit."""
        if self.done or (self._tried and now_us < self._due_us):
            return []
        if self._tried >= self.tries:
            self.refusal = self._denial or f"no answer to {self.tries} tries"
            return []
        self._tried += 1
        self._due_us = now_us + TIMEOUT_US
        self._command = self._anew()
        return self._command.on_time(now_us)

    def _anew(self) -> Command:
        return Command(*self.target, REQUEST_MESSAGE, (self.message_id, *self.params))
