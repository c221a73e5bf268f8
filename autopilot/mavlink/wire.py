"""A wire: a MAVLink link that ends in a device aboard instead of a UDP port, as a camera on a serial port does.

Whatever speaks MAVLink by itself (camera, gimbal) is plugged in here by who starts the vehicle; the autopilot knows it
only by what it says. Messages for it are forwarded to it, and its own to all other links, by the rules of every link
(forwarding.py). Its mode says what it streams; with `wire`, nothing until the device asks (SET_MESSAGE_INTERVAL).
"""

from typing import Protocol

from sitl_emu.autopilot.mavlink.encoder import Encoder
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.core.ports import LinkPorts

NO_PORTS = LinkPorts(0, 0)


class Device(Protocol):
    """What can be plugged in: bytes in, bytes out, on simulated time."""

    outbox: list[bytes]
    """What it has to say; emptied by the wire."""
    due_us: int
    """When `on_time` wants to be called next."""

    def on_datagram(self, now_us: int, data: bytes) -> None:
        """Bytes came in."""
        ...

    def on_time(self, now_us: int) -> None:
        """`due_us` has come."""
        ...


class Wire:
    """The autopilot's end, a link like the others, and the device at the far end."""

    def __init__(self, name: str, mode: str, device: Device, encoder: Encoder) -> None:
        self.link = Link(name, mode, NO_PORTS, encoder)
        self.device = device

    def exchange(self, now_us: int) -> list[bytes]:
        """Hand over what waits in the link's outbox; what the device has to say."""
        link, device = self.link, self.device
        if link.outbox:
            outbox, link.outbox = link.outbox, []
            for data in outbox:
                device.on_datagram(now_us, data)
        if now_us >= device.due_us:
            device.on_time(now_us)
        said = device.outbox[:]
        device.outbox.clear()
        return said
