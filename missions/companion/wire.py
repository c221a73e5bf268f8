"""MAVLink frames of one link to messages and back.

The only place that packs: what a companion made gets its address and this link's sequence number; what it received from
elsewhere and passes on keeps its bytes, its sender included, as a MAVLink router does it
(https://mavlink.io/en/guide/routing.html). Frames that nobody reads are skipped before they cost anything: an onboard
link carries 500 messages a second, and a companion needs a fifth of them. MAVLink 1 and 2; no message is split over
two datagrams.
"""

from collections.abc import Collection

from sitl_emu.core import dialect as mavlink
from sitl_emu.core.framing import message_id, split
from sitl_emu.missions.companion.companion import COMPONENT_ID

STREAMS_NOT_READ = frozenset(
    {
        27,  # RAW_IMU
        29,  # SCALED_PRESSURE
        30,  # ATTITUDE: the quaternion is read
        32,  # LOCAL_POSITION_NED: the global position is read
        36,  # SERVO_OUTPUT_RAW
        74,  # VFR_HUD
        83,  # ATTITUDE_TARGET
        85,  # POSITION_TARGET_LOCAL_NED
        87,  # POSITION_TARGET_GLOBAL_INT
        105,  # HIGHRES_IMU
        141,  # ALTITUDE
        241,  # VIBRATION
        290,  # ESC_INFO
        291,  # ESC_STATUS
        331,  # ODOMETRY
        12901,  # OPEN_DRONE_ID_LOCATION
        12904,  # OPEN_DRONE_ID_SYSTEM
    }
)


class Wire:
    """Codec of one link."""

    def __init__(
        self, system: int = 0, component: int = COMPONENT_ID, skip: Collection[int] = STREAMS_NOT_READ
    ) -> None:
        """`system` may be set later, when it is known. `skip`: ids of messages that are not decoded."""
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._skip = frozenset(skip)
        self.bad_frames = 0

    @property
    def system(self) -> int:
        """Our MAVLink system."""
        return int(self._mav.srcSystem)

    @system.setter
    def system(self, system: int) -> None:
        self._mav.srcSystem = system

    def encode(self, msg: mavlink.MAVLink_message) -> bytes:
        """The frame of a message."""
        source = (msg.get_srcSystem(), msg.get_srcComponent())
        if source[0] and source != (self._mav.srcSystem, self._mav.srcComponent):
            return bytes(msg.get_msgbuf())
        frame = bytes(msg.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        return frame

    def decode(self, datagram: bytes) -> list[mavlink.MAVLink_message]:
        """The messages in a datagram; skipped, unknown and damaged ones are left out (the latter are counted)."""
        messages = []
        for frame in split(datagram):
            number = message_id(frame)
            if number not in self._skip and number in mavlink.mavlink_map:
                try:
                    messages.append(self._mav.decode(bytearray(frame)))
                except mavlink.MAVError:
                    self.bad_frames += 1
        return messages
