"""Camera sources: `open_camera(url)` gives frames from the simulator, a file, a stream or a device.

| URL | source | time of a frame |
| --- | --- | --- |
| `shm:NAME` | a feed in shared memory, as the simulator writes it | vehicle boot time |
| a folder | recorded frames, `TIME.png` or `.jpg`, TIME the vehicle boot time in microseconds | vehicle boot time |
| `rtsp://…`, `http://…`, `udp://…` | video stream, by OpenCV | 0: the reader knows when it came |
| `/dev/videoN` | V4L2 device, by OpenCV | 0: the reader knows when it came |
| any other path | video file, by OpenCV | position in the file |

A frame is given once; only a stream or device makes `read` wait. Images are BGR, height x
width x 3, uint8. Not here: lens calibration (camera_model.py) and camera control by MAVLink.
The ring itself is `sitl_emu/core/frame_ring.py`.
"""

import re
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from sitl_emu.core.frame_ring import Encoding, Kind, RingError, RingReader, Sample

Image = npt.NDArray[np.uint8]


class CameraError(Exception):
    """A camera source that can't be opened or read; the text is one line for people."""


class Frame(NamedTuple):
    """One picture. `index` counts from 0 within its source."""

    time_usec: int
    image: Image
    index: int  # type: ignore[assignment]  # hides tuple.index, which no frame needs


class CameraSource(Protocol):
    """Where frames come from."""

    @property
    def clock(self) -> Literal["vehicle", "host", "file"]:
        """Whose time `Frame.time_usec` is: the vehicle's boot time, the file's, or nobody's.

        Frames of a "host" source have 0 there: whoever reads them knows when that was.
        """
        ...

    def read(self) -> Frame | None:
        """The next frame; None when there is none (now, or ever: see `ended`)."""
        ...

    @property
    def ended(self) -> bool:
        """True when no frame will ever come again."""
        ...

    def close(self) -> None:
        """Lets the source go; may be called twice."""
        ...


class SharedFrames:
    """`shm:NAME`: the images of a feed of the simulator's, or of anybody who writes such a ring."""

    clock: Literal["vehicle"] = "vehicle"

    def __init__(self, name: str) -> None:
        """Raises CameraError when there is no such feed, or one that carries no images."""
        try:
            self._ring = RingReader(name)
        except RingError as error:
            raise CameraError(str(error)) from None
        what = self._ring.what
        if what.kind is not Kind.IMAGE:
            self.close()
            raise CameraError(f"shm:{name}: that feed carries {what.kind.name.lower()}, and no images")
        self._rgb = what.encoding is Encoding.RGB8

    @property
    def ended(self) -> bool:
        """Whether its writer has gone, and all is read."""
        return self._ring.ended

    @property
    def lost(self) -> int:
        """Frames that were overwritten before they were read."""
        return self._ring.lost

    def read(self) -> Frame | None:
        """The oldest frame not read yet; None when there is none now."""
        return self._frame(self._ring.read())

    def at(self, index: int) -> Frame | None:
        """The frame of that index; None when it was overwritten or is not there yet."""
        return self._frame(self._ring.at(index))

    def close(self) -> None:
        """Lets the ring go."""
        self._ring.close()

    def _frame(self, sample: Sample | None) -> Frame | None:
        if sample is None:
            return None
        image = np.ascontiguousarray(sample.data[..., ::-1]) if self._rgb else sample.data
        return Frame(sample.time_us, image, sample.number)


class RecordedFrames:
    """A folder of pictures, given in the order of the time in their names."""

    clock: Literal["vehicle"] = "vehicle"

    def __init__(self, folder: Path) -> None:
        """Raises CameraError when there is no picture with a time in its name."""
        frames = []
        for path in folder.iterdir():
            digits = re.search(r"(\d+)$", path.stem)
            if digits and path.suffix.lower() in {".png", ".jpg", ".jpeg"}:
                frames.append((int(digits[1]), path))
        if not frames:
            raise CameraError(
                f"{folder}: no recorded frames; they are PNG or JPG, named by their time in µs: 1250000.png"
            )
        self._frames = sorted(frames)
        self._next = 0

    @property
    def ended(self) -> bool:
        """True after the last picture."""
        return self._next >= len(self._frames)

    @property
    def next_time_usec(self) -> int | None:
        """Time of the picture that `read` gives next."""
        return None if self.ended else self._frames[self._next][0]

    def read(self) -> Frame | None:
        """The next picture."""
        if self.ended:
            return None
        import cv2

        index = self._next
        time_usec, path = self._frames[index]
        self._next += 1
        try:
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        except cv2.error:  # larger than OpenCV takes
            image = None
        if image is None:
            raise CameraError(f"{path}: not a picture that can be read")
        return Frame(time_usec, np.asarray(image, np.uint8), index)

    def close(self) -> None:
        """Nothing to let go."""


class VideoCapture:
    """A video file, stream or device, through OpenCV."""

    def __init__(self, url: str) -> None:
        """Raises CameraError when OpenCV can't open it."""
        import cv2

        self._cv2 = cv2
        live = "://" in url or url.startswith("/dev/")
        self.clock: Literal["host", "file"] = "host" if live else "file"
        device = re.fullmatch(r"/dev/video(\d+)", url)
        self._capture = cv2.VideoCapture(int(device[1]) if device else url)
        if not self._capture.isOpened():
            raise CameraError(
                f"{url}: can't be opened as video; give shm:NAME, a folder, a file, /dev/videoN or rtsp://…"
            )
        self.url = url
        self.ended = False
        self._index = 0

    def read(self) -> Frame | None:
        """The next frame; a device or stream makes it wait."""
        ok, image = self._capture.read()
        if not ok:
            self.ended = True
            return None
        index = self._index
        self._index += 1
        position_ms = self._capture.get(self._cv2.CAP_PROP_POS_MSEC)
        return Frame(0 if self.clock == "host" else round(position_ms * 1000), np.asarray(image, np.uint8), index)

    def close(self) -> None:
        """Lets device or stream go."""
        self._capture.release()


def open_camera(url: str) -> CameraSource:
    """Opens a camera by its URL (see above). Raises CameraError."""
    if url.startswith("shm:"):
        return SharedFrames(url.removeprefix("shm:"))
    path = Path(url)
    if path.is_dir():
        return RecordedFrames(path)
    if "://" not in url and not path.exists():
        raise CameraError(f"{url}: there is no such file, folder or device")
    return VideoCapture(url)
