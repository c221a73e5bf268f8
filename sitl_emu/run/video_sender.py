"""Video of what a camera sees: H.264 over RTP (RFC 6184) to one UDP port, for QGroundControl, ffplay, GStreamer.

libx264 encodes it, by PyAV (BSD-3), in a thread of its own: whoever shows a picture never waits. A picture that comes
while one is being encoded replaces the one that waits; one that comes sooner than the rate asks for (a run faster than
real time) is left out. Each second a picture stands by itself and brings the stream's parameters (SPS, PPS), so that a
viewer may join at any time. The stream's clock is the wall's: it shows what comes as it comes, at whatever speed is
simulated. Who does not listen, or can't be reached, is of no account: the next second is tried anew.

PyAV's wheel holds libx264, which is GPL: it is an optional extra (`video`) that nothing else needs.
"""

import contextlib
import os
import sys
import threading
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sitl_emu.run.trouble import Trouble

Image = npt.NDArray[np.uint8]
REMEDY = "pip install 'sitl-emu[video]', or av alone (its wheel holds libx264, which is GPL)"
ENCODER = "libx264"
CLOCK_HZ = 90_000
"""RTP's, of video (RFC 6184, 8.2.1)."""
KEY_EVERY_S = 1.0
AGAIN_S = 1.0
"""How long one that can't be reached is left alone."""
BUFFER_S = 0.5
"""What the greatest picture may take of the rate: the more, the later it is whole."""
PACKET_BYTES = 1400
"""With UDP's and IP's headers within an Ethernet frame, tunnels included: GStreamer's choice, too."""
NO_OTHER_KEYS = 1 << 30
"""Pictures from key to key by count: by time is asked for."""
YIELDING = 5
"""Niceness beyond that of the thread that draws."""
COLOURS = "colorprim=smpte170m:transfer=smpte170m:colormatrix=smpte170m"
"""ITU-R BT.601, which swscale converts to, so that viewers need not guess."""


class Target(NamedTuple):
    """To whom it is sent, and how much."""

    host: str
    port: int
    bit_rate: int
    rate_hz: float
    """The most pictures a second."""


def check() -> None:
    """Raise Trouble where nothing is installed that encodes."""
    try:
        import av

        av.Codec(ENCODER, "w")
    except ImportError:
        raise Trouble(f"video needs PyAV, which is not installed: {REMEDY}") from None
    except ValueError:
        raise Trouble(f"video needs PyAV with {ENCODER}, which the installed one lacks: {REMEDY}") from None


class VideoSender:
    """The video of one camera, from its first picture until it is closed."""

    def __init__(self, target: Target) -> None:
        """PyAV is installed (`check`)."""
        self._target = target
        self._interval_s = 1.0 / target.rate_hz
        self._due_s = 0.0
        self._waiting: tuple[Image, float] | None = None
        self._ended = False
        self._changed = threading.Condition()
        self.sent = self.dropped = 0
        """Pictures that were sent, and that were not because the ones before took too long."""
        self._stream: _Stream | None = None
        self._again_s = 0.0
        self._complained = False
        self._thread = threading.Thread(target=self._work, name="video", daemon=True)
        self._thread.start()

    def show(self, image: Image, now_s: float) -> None:
        """Send a picture: (height, width, 3) BGR, that is not changed any more. `now_s`: a wall clock.

        H.264 in yuv420p has even sides: of odd ones the last row or column is not sent.
        """
        if now_s < self._due_s - 0.5 * self._interval_s:
            return
        self._due_s = max(self._due_s, now_s - 0.5 * self._interval_s) + self._interval_s
        with self._changed:
            self.dropped += self._waiting is not None
            self._waiting = (image, now_s)
            self._changed.notify()

    def close(self) -> None:
        """Send what waits, and end."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def _work(self) -> None:
        os.nice(YIELDING)
        while (shown := self._next()) is not None:
            image, now_s = shown
            if now_s >= self._again_s:
                self._send(image, now_s)
        if self._stream is not None:
            self._stream.close()

    def _next(self) -> tuple[Image, float] | None:
        with self._changed:
            while self._waiting is None and not self._ended:
                self._changed.wait()
            shown, self._waiting = self._waiting, None
            return shown

    def _send(self, image: Image, now_s: float) -> None:
        import av

        image = image[: image.shape[0] & ~1, : image.shape[1] & ~1]
        try:
            if self._stream is None:
                self._stream = _Stream(self._target, image.shape[1], image.shape[0])
            self._stream.send(image, now_s)
            self.sent += 1
            self._complained = False
        except (OSError, av.error.FFmpegError) as error:  # after one, FFmpeg's output takes nothing any more
            stream, self._stream, self._again_s = self._stream, None, now_s + AGAIN_S
            if stream is not None:
                stream.close()
            if not self._complained:
                self._complained = True
                where = f"{self._target.host}:{self._target.port}"
                print(f"no video to {where}: {error.strerror or error}; trying on", file=sys.stderr, flush=True)


class _Stream:
    """An encoder and the socket behind it."""

    def __init__(self, target: Target, width: int, height: int) -> None:
        """Raises OSError and FFmpegError."""
        import av

        self._frame_of, self._key_type = av.VideoFrame.from_ndarray, av.video.frame.PictureType.I
        # no RTCP: its port is the RTP port of the next vehicle
        url = f"rtp://{target.host}:{target.port}?pkt_size={PACKET_BYTES}"
        self._output: Any = av.open(url, "w", format="rtp", options={"rtpflags": "skip_rtcp"})
        options = {
            "preset": "ultrafast",
            "tune": "zerolatency",
            "forced-idr": "1",
            "maxrate": str(target.bit_rate),
            "bufsize": str(round(BUFFER_S * target.bit_rate)),
            "x264-params": COLOURS,
        }
        self._video: Any = self._output.add_stream(ENCODER, rate=Fraction(target.rate_hz).limit_denominator(1000))
        context = self._video.codec_context
        context.options = options
        context.width, context.height, context.pix_fmt = width, height, "yuv420p"
        context.bit_rate, context.gop_size, context.thread_count = target.bit_rate, NO_OTHER_KEYS, 1
        context.time_base = Fraction(1, CLOCK_HZ)
        self._half_s = 0.5 / target.rate_hz
        self._began_s: float | None = None
        self._key_s = 0.0
        self._last = -1

    def send(self, image: Image, now_s: float) -> None:
        """Encode and send a picture. Raises OSError and FFmpegError."""
        if self._began_s is None:
            self._began_s = self._key_s = now_s
        frame = self._frame_of(np.ascontiguousarray(image), format="bgr24").reformat(format="yuv420p")
        self._last = max(self._last + 1, round((now_s - self._began_s) * CLOCK_HZ))
        frame.pts, frame.time_base = self._last, Fraction(1, CLOCK_HZ)
        if now_s >= self._key_s - self._half_s:
            self._key_s = now_s + KEY_EVERY_S
            frame.pict_type = self._key_type
        for packet in self._video.encode(frame):
            self._output.mux(packet)

    def close(self) -> None:
        """Give the socket back."""
        import av

        # it writes what it has left, which can't be sent either
        with contextlib.suppress(OSError, av.error.FFmpegError):
            self._output.close()
