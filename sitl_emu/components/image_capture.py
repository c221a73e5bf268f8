"""The taking of images: the shutter, series at an interval, and the record of each image with its picture.

https://mavlink.io/en/services/camera.html#still-image-capture (IMAGE_START_CAPTURE, IMAGE_STOP_CAPTURE). An image is
its CAMERA_IMAGE_CAPTURED record. From the shutter on it waits for its geotag, and then, where somebody draws pictures
(`card`), for its file. A command that is sent again, since its ack was lost, takes no second image: its sequence number
tells, as long as it can be one that is sent again, as a client's next run counts from 1 anew. One for the series that
is being taken is accepted, and changes nothing. Nothing is sent or asked here: the camera asks where it is once the
shutter has opened, and sends the records that it is given. Times are simulated, in µs.
"""

import math
from collections import deque
from typing import Any, NamedTuple, Protocol

from sitl_emu.components.component import NEVER_US, Command
from sitl_emu.components.geotag import Geotag
from sitl_emu.components.storage import Storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles.description import Camera as CameraData

CAPTURED, NOT_CAPTURED = 1, 0
NO_FILE = b""
KEPT_RECORDS = 1000
"""Of the newest images, for who asks again (MAV_CMD_REQUEST_MESSAGE with their index)."""
GEOTAG_LIMIT_US = 200_000
"""An autopilot that has not answered by then gives no geotag."""
SENT_AGAIN_US = 1_750_000
"""A number that comes later after itself is that of another image. MAVSDK, which does not count `confirmation` up,
sends a command again three times, 0.5 s apart (mavlink_command_sender.hpp: DEFAULT_RETRIES, timeout_s); 0.25 s for the
way are ours. Who counts may take his time."""


class Asked(NamedTuple):
    """Who asked for images, and for which."""

    system: int
    component: int
    interval_s: float
    images: int
    sequence: int


NOTHING_ASKED = Asked(0, 0, 0.0, 0, 0)


class PictureFiles(Protocol):
    """A card (`card.Card`)."""

    def next_number(self) -> int: ...  # noqa: D102
    def url(self, number: int) -> bytes: ...  # noqa: D102
    def tag(self, number: int, tag: Geotag, utc_us: int) -> None: ...  # noqa: D102


class ImageCapture:
    """The images of one camera."""

    def __init__(self, data: CameraData, storage: Storage, card: PictureFiles | None) -> None:
        """`card`: where pictures are kept; None: there are none."""
        self._data, self._storage, self._card = data, storage, card
        self.count = 0
        """Images taken; their indices begin with 0."""
        self.interval_s = 0.0
        """Of the series that is being taken, 0 for none."""
        self._left: int | None = 0
        """Images still to be taken at the interval; None is without end."""
        self._next_us = NEVER_US
        self._ready_us = 0
        self._asked = NOTHING_ASKED
        """What was accepted last, unless it was stopped."""
        self._asked_us = 0
        """When that was heard last."""
        self._opened_us = NEVER_US
        """When the shutter opened for the image that waits for its geotag."""
        self._exposed = 0
        """The number of the picture whose record is in the making, 0 for none."""
        self._drawn: dict[int, bool] = {}
        """Pictures that are there (or could not be drawn) before their records."""
        self._undrawn: dict[int, tuple[Any, Geotag]] = {}
        """Records that wait for their pictures."""
        self._records: deque[Any] = deque(maxlen=KEPT_RECORDS)

    # --- when ---------------------------------------------------------------------------------------------------

    @property
    def goes_on(self) -> bool:
        """Whether another image is to be taken."""
        return self._next_us != NEVER_US

    @property
    def waits(self) -> bool:
        """Whether an image is not told yet: it waits for its geotag, or for its picture."""
        return self.waits_for_geotag or bool(self._undrawn)

    @property
    def waits_for_geotag(self) -> bool:
        """Whether an image is in the making: its shutter has opened, and it is not yet told where that was."""
        return self._opened_us != NEVER_US

    @property
    def due_us(self) -> int:
        """When the next image is to be taken, or the one in the making is to be kept without a geotag."""
        return min(self._next_us, self._opened_us + GEOTAG_LIMIT_US)

    def is_due(self, now_us: int) -> bool:
        """Whether the shutter is to be opened."""
        return now_us >= self._next_us

    def is_overdue(self, now_us: int) -> bool:
        """Whether the image in the making has waited for its geotag long enough."""
        return now_us - self._opened_us >= GEOTAG_LIMIT_US

    # --- commands and shutter -----------------------------------------------------------------------------------

    def start(self, now_us: int, command: Command, free_mib: float) -> int:
        """IMAGE_START_CAPTURE; the MAV_RESULT. The first image may be due at once. `free_mib`: of the storage."""
        interval_s = command.params[1] if math.isfinite(command.params[1]) else 0.0
        count, sequence = command.whole(3), command.whole(4)
        if count < 0 or interval_s < 0.0:
            return mavlink.MAV_RESULT_DENIED
        asked = Asked(command.source_system, command.source_component, interval_s, count, sequence)
        if self._is_sent_again(now_us, asked, command.confirmation):
            self._asked_us = now_us
            return mavlink.MAV_RESULT_ACCEPTED
        if self.goes_on or self.waits_for_geotag or (count == 1 and now_us < self._ready_us):
            return mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        if free_mib < self._data.image_mib:
            return mavlink.MAV_RESULT_FAILED
        if count != 1:
            self.interval_s = max(interval_s, self._data.interval_min_s)
        self._asked, self._asked_us = asked, now_us
        self._left = count or None
        self._next_us = max(now_us, self._ready_us)
        return mavlink.MAV_RESULT_ACCEPTED

    def _is_sent_again(self, now_us: int, asked: Asked, confirmation: int) -> bool:
        """Whether this is the command accepted last: of the series that is being taken, or of a numbered image."""
        if asked != self._asked:
            return False
        if asked.images != 1:
            return self.goes_on or self.waits_for_geotag
        return asked.sequence > 0 and (confirmation > 0 or now_us - self._asked_us <= SENT_AGAIN_US)

    def stop(self) -> None:
        """No more images; the one in the making will be there."""
        self._next_us, self.interval_s, self._left, self._asked = NEVER_US, 0.0, 0, NOTHING_ASKED

    def open_shutter(self, now_us: int, free_mib: float) -> bool:
        """Take the image that is due; False: the storage is full, which ends the series."""
        if free_mib < self._data.image_mib:
            self.stop()
            return False
        if self._left is not None:
            self._left -= 1
        self._next_us = NEVER_US if self._left == 0 else now_us + round(self.interval_s * 1e6)
        if self._left == 0:
            self.interval_s = 0.0
        self._opened_us = now_us
        self._ready_us = now_us + round(self._data.interval_min_s * 1e6)
        return True

    def next_picture(self) -> int | None:
        """The number of the picture that is to be drawn now, for the image in the making; None: nobody draws."""
        if self._card is None:
            return None
        self._exposed = self._card.next_number()
        return self._exposed

    # --- records ------------------------------------------------------------------------------------------------

    def keep(self, tag: Geotag, boot_unix_us: int) -> Any:
        """The image in the making is there, and counts; its record, or None while that waits for its picture.

        `boot_unix_us`: when the vehicle started, 0 where that is not known. Raises OSError.
        """
        taken_us, self._opened_us = self._opened_us, NEVER_US
        self._storage.used_mib += self._data.image_mib
        self.count += 1
        utc_us = boot_unix_us + taken_us if boot_unix_us else 0
        time_ms, index = taken_us // 1000, self.count - 1
        number = self._exposed
        url = NO_FILE if self._card is None else self._card.url(number)
        image = mavlink.MAVLink_camera_image_captured_message(time_ms, utc_us, 0, *tag, index, CAPTURED, url)
        if self._card is not None and number not in self._drawn:
            self._undrawn[number] = (image, tag)
            return None
        return self._recorded(image, tag, number, self._drawn.pop(number, True))

    def picture_taken(self, number: int, ok: bool) -> Any:
        """A picture is on the card, or not `ok`: there will be none. The record that waited for it, or None.

        Raises OSError.
        """
        if number in self._undrawn:
            return self._recorded(*self._undrawn.pop(number), number, ok)
        if number == self._exposed:
            self._drawn[number] = ok
        return None

    def record(self, index: int) -> Any:
        """Of the image with that index; None where it is not known (any more)."""
        if not self._records:
            return None
        at = index - self._records[0].image_index
        return self._records[at] if 0 <= at < len(self._records) else None

    def forget(self, *, count: bool) -> None:
        """The storage has been formatted. `count`: whether indices begin with 0 again, too."""
        if count:
            self.count = 0
        self._records.clear()

    def _recorded(self, image: Any, tag: Geotag, number: int, ok: bool) -> Any:
        """The record of an image whose picture is there, or which has none."""
        if not ok:
            index, where = image.image_index, (image.lat, image.lon, image.alt, image.relative_alt, image.q)
            image = mavlink.MAVLink_camera_image_captured_message(
                image.time_boot_ms, image.time_utc, 0, *where, index, NOT_CAPTURED, NO_FILE
            )
        elif self._card is not None:
            self._card.tag(number, tag, image.time_utc)
        self._records.append(image)
        return image
