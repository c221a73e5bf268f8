"""How often a message comes on our link: change it, and ask it.

Sources: https://mavlink.io/en/messages/common.html#MAV_CMD_SET_MESSAGE_INTERVAL, and MESSAGE_INTERVAL, asked for by
MAV_CMD_REQUEST_MESSAGE as that page wants it (GET_MESSAGE_INTERVAL is the older way).
"""

from sitl_emu.gcs.command import Command
from sitl_emu.gcs.message_request import MessageRequest

SET_MESSAGE_INTERVAL = 511
MESSAGE_INTERVAL = 244
STOPPED_US, DEFAULT_US = -1, 0


def set_interval(system: int, message_id: int, interval_us: int, component: int = 1) -> Command:
    """Have a message come every `interval_us`; DEFAULT_US as often as by itself, STOPPED_US never."""
    return Command(system, component, SET_MESSAGE_INTERVAL, (message_id, interval_us))


def read_interval(system: int, message_id: int, component: int = 1) -> MessageRequest:
    """Ask for MESSAGE_INTERVAL: its `message.interval_us`, which is STOPPED_US for one that does not come."""
    return MessageRequest(
        system, MESSAGE_INTERVAL, component, (message_id,), lambda msg: bool(msg.message_id == message_id)
    )
