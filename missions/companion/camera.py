"""Camera sources: `open_camera(url)` gives frames from the simulator, a file, a stream or a device.

| URL | source | time of a frame |
| --- | --- | --- |
| `shm:NAME` | ring of frames in shared memory, as the simulator writes it | vehicle boot time |
| a folder | recorded frames, `TIME.png` or `.jpg`, TIME the vehicle boot time in microseconds | vehicle boot time |
| `rtsp://…`, `http://…`, `udp://…` | video stream, by OpenCV | 0: the reader knows when it came |
| `/dev/videoN` | V4L2 device, by OpenCV | 0: the reader knows when it came |
| any other path | video file, by OpenCV | position in the file |

A frame is given once; only a stream or device makes `read` wait. Images are BGR, height x
width x 3, uint8. Not here: lens calibration (camera_model.py) and camera control by MAVLink.

The ring: a header (magic, slots, width, height, and a counter of the frames written), then the slots, each with its
frame's index and time before and after the pixels, so that a reader notices a slot that was overwritten while it
copied. The writer never waits: a reader that falls more than `slots` behind loses frames, and `lost` counts them.
"""

import mmap
import re
import struct
from multiprocessing import shared_memory
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

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


_HEADER = struct.Struct("<4sIIIQ")
_SLOT = struct.Struct("<QQ")
_MAGIC = b"SFR1"
_COUNT_OFFSET = 16
_ALIGN = 64
_SHARED_MEMORY = Path("/dev/shm")


def _slot_size(width: int, height: int) -> int:
    size = 2 * _SLOT.size + width * height * 3
    return (size + _ALIGN - 1) // _ALIGN * _ALIGN


class FrameRingWriter:
    """The simulator's end of a ring of frames. Creates the shared memory and removes it on `close`."""

    def __init__(self, name: str, width: int, height: int, slots: int = 8) -> None:
        """Raises CameraError when there is a ring of that name already."""
        self.width, self.height, self.slots = width, height, slots
        self._slot_size = _slot_size(width, height)
        size = _ALIGN + slots * self._slot_size
        try:
            self._memory: shared_memory.SharedMemory | None = shared_memory.SharedMemory(name, create=True, size=size)
        except FileExistsError:
            raise CameraError(
                f"shm:{name}: there is such a frame ring already; another run uses it, or one that was killed left it:"
                f" remove /dev/shm/{name}"
            ) from None
        self.name = name
        self._count = 0
        assert self._memory.buf is not None
        self._buffer = self._memory.buf
        _HEADER.pack_into(self._buffer, 0, _MAGIC, slots, width, height, 0)
        self._written = np.frombuffer(self._buffer, np.uint64, 1, _COUNT_OFFSET)

    @property
    def next_image(self) -> Image:
        """The pixels of the slot that is written next, to render into; `commit` makes them a frame."""
        start = _ALIGN + self._count % self.slots * self._slot_size + _SLOT.size
        flat = np.frombuffer(self._buffer, np.uint8, self.width * self.height * 3, start)
        return flat.reshape(self.height, self.width, 3)

    def write(self, time_usec: int, image: Image) -> None:
        """Adds a frame."""
        self.next_image[:] = image
        self.commit(time_usec)

    def commit(self, time_usec: int) -> None:
        """Publishes what stands in `next_image`."""
        start = _ALIGN + self._count % self.slots * self._slot_size
        _SLOT.pack_into(self._buffer, start, self._count, time_usec)
        _SLOT.pack_into(self._buffer, start + _SLOT.size + self.width * self.height * 3, self._count, time_usec)
        self._count += 1
        # One aligned store: struct.pack_into clears the bytes first, and a reader would see a 0 in passing.
        self._written[0] = self._count

    def close(self) -> None:
        """Removes the ring; readers keep what they have mapped."""
        if self._memory is not None:
            del self._buffer, self._written
            self._memory.close()
            self._memory.unlink()
            self._memory = None


class FrameRingReader:
    """`shm:NAME`: the companion's end of a ring."""

    clock: Literal["vehicle"] = "vehicle"
    ended = False

    def __init__(self, name: str) -> None:
        """Raises CameraError when there is no such ring."""
        # Python 3.11's SharedMemory would remove the ring when a reader ends, under the writer's feet: map the file.
        try:
            with (_SHARED_MEMORY / name).open("rb") as file:
                self._buffer = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            raise CameraError(
                f"shm:{name}: there is no such frame ring ({error.strerror}); is the simulator running?"
            ) from None
        if len(self._buffer) < _HEADER.size or self._buffer[:4] != _MAGIC:
            self.close()
            raise CameraError(f"shm:{name}: that shared memory is no frame ring")
        _, self.slots, self.width, self.height, _ = _HEADER.unpack_from(self._buffer, 0)
        self._written: npt.NDArray[np.uint64] | None = np.frombuffer(self._buffer, np.uint64, 1, _COUNT_OFFSET)
        self.lost = 0
        self._next = max(0, self.written - self.slots)
        self._slot_size = _slot_size(self.width, self.height)

    @property
    def written(self) -> int:
        """How many frames the writer has published."""
        return 0 if self._written is None else int(self._written[0])

    def read(self) -> Frame | None:
        """The oldest frame not read yet; None when there is none now."""
        while self.written > self._next:
            index = max(self._next, self.written - self.slots)
            self.lost += index - self._next
            self._next = index + 1
            frame = self.read_index(index)
            if frame is not None:
                return frame
            self.lost += 1
        return None

    def read_index(self, index: int) -> Frame | None:
        """A copy of the frame of that index; None when it was overwritten or is not there yet."""
        start = _ALIGN + index % self.slots * self._slot_size
        pixels = self.width * self.height * 3
        flat = np.frombuffer(self._buffer, np.uint8, pixels, start + _SLOT.size)
        image = flat.reshape(self.height, self.width, 3).copy()
        head = _SLOT.unpack_from(self._buffer, start)
        tail = _SLOT.unpack_from(self._buffer, start + _SLOT.size + pixels)
        if head != tail or head[0] != index or not index < self.written <= index + self.slots:
            return None
        return Frame(head[1], image, index)

    def close(self) -> None:
        """Unmaps the ring."""
        self._written = None
        self._buffer.close()


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
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
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
        return FrameRingReader(url.removeprefix("shm:"))
    path = Path(url)
    if path.is_dir():
        return RecordedFrames(path)
    if "://" not in url and not path.exists():
        raise CameraError(f"{url}: there is no such file, folder or device")
    return VideoCapture(url)
