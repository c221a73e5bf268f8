"""RADIO_STATUS: what a telemetry radio tells of itself and of its other end (topics.radio_status; `mavlink status`).

https://mavlink.io/en/messages/common.html#RADIO_STATUS. As PX4 (handle_message_radio_status,
Mavlink::update_rate_mult): a link whose radio has been silent for MAV_RADIO_TOUT counts as one without a radio again,
and the log says so. Streams go on at their rates however full the radio's buffer is: a link throttles by it where it is
started with -s (MAV_X_RADIO_CTL of serial ports), as none of SITL's is (px4-rc.mavlink).
"""

from collections.abc import Sequence
from typing import Any, ClassVar

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import RadioStatus as Status
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink


class RadioStatus:
    """Writer of radio_status, and of what a link knows of its radio."""

    MESSAGES: ClassVar[frozenset[int]] = frozenset({mavlink.MAVLINK_MSG_ID_RADIO_STATUS})
    HAS_TIMER = True

    def __init__(self, links: Sequence[Link], topics: Topics, parameters: Parameters, texts: Texts) -> None:
        """Writes into `topics`, and into the log of `texts`."""
        self._links, self._topics, self._parameters, self._texts = links, topics, parameters, texts
        self._logged: Link | None = None
        """Whose radio is topics.radio_status, uORB's first instance: the first that was heard."""

    def on_message(self, now_us: int, message: Any, link: Link) -> None:
        """Keep the last of each link."""
        link.radio = Status(
            now_us,
            rssi=message.rssi,
            remote_rssi=message.remrssi,
            txbuf=message.txbuf,
            noise=message.noise,
            remote_noise=message.remnoise,
            rxerrors=message.rxerrors,
            fix=message.fixed,
        )
        self._logged = self._logged or link
        if link is self._logged:
            self._topics.radio_status = link.radio

    def on_time(self, now_us: int) -> None:
        """Forget radios that are silent."""
        for number, link in enumerate(self._links):
            if link.radio is None:
                continue
            if now_us - link.radio.timestamp > int(self._parameters["MAV_RADIO_TOUT"]) * 1_000_000:
                link.radio = None
                self._texts.note(Severity.ERROR, f"[mavlink] instance {number}: RADIO_STATUS timeout")
