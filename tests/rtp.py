"""What a viewer of video does: hears RTP packets (RFC 3550, 6184) on a UDP port, and has FFmpeg decode them."""

import socket
import time
from collections.abc import Sequence
from typing import Any

import av
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
RTP_BYTES = 12
STAP_A, FU_A, FU_START = 24, 28, 0x80
SPS, PPS, IDR = 7, 8, 5
"""NAL units (H.264, table 7-1); STAP-A and FU-A hold them in RTP (RFC 6184, 5.2)."""
MARKER = 0x80
"""Of a picture's last packet."""
LIMIT_S = 20.0


class Ear:
    """A UDP port that hears RTP."""

    def __init__(self, port: int = 0) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(LIMIT_S)
        self.port: int = self._socket.getsockname()[1]

    def picture(self) -> list[bytes]:
        """The packets up to the next with the marker bit: those of one picture."""
        packets = [self._socket.recv(65535)]
        while not packets[-1][1] & MARKER:
            packets.append(self._socket.recv(65535))
        return packets

    def silent(self) -> bool:
        """Whether nothing waits."""
        self._socket.setblocking(False)
        try:
            return not self._socket.recv(65535)
        except BlockingIOError:
            return True
        finally:
            self._socket.settimeout(LIMIT_S)

    def drain(self) -> None:
        """Hear all that waits."""
        while not self.silent():
            pass

    def falls_silent(self, within_s: float = 10.0, for_s: float = 1.0) -> bool:
        """Whether a pause of some length begins in time."""
        until_s = time.monotonic() + within_s
        self._socket.settimeout(for_s)
        try:
            while time.monotonic() < until_s:
                self._socket.recv(65535)
        except TimeoutError:
            return True
        finally:
            self._socket.settimeout(LIMIT_S)
        return False

    def close(self) -> None:
        self._socket.close()


def units(packets: Sequence[bytes]) -> list[int]:
    """The kinds of the NAL units of a picture, in order."""
    kinds = list[int]()
    for packet in packets:
        payload = packet[RTP_BYTES:]
        kind = payload[0] & 31
        if kind == STAP_A:
            at = 1
            while at < len(payload):
                kinds.append(payload[at + 2] & 31)
                at += 2 + int.from_bytes(payload[at : at + 2], "big")
        elif kind == FU_A:
            kinds += [payload[1] & 31] if payload[1] & FU_START else []
        else:
            kinds.append(kind)
    return kinds


def annex_b(packets: Sequence[bytes]) -> bytes:
    """The byte stream that a decoder takes, of RTP packets (RFC 6184, 5.7 and 5.8)."""
    stream, start = bytearray(), b"\0\0\0\1"
    for packet in packets:
        payload = packet[RTP_BYTES:]
        if payload[0] & 31 == STAP_A:
            at = 1
            while at < len(payload):
                size = int.from_bytes(payload[at : at + 2], "big")
                stream += start + payload[at + 2 : at + 2 + size]
                at += 2 + size
        elif payload[0] & 31 == FU_A:
            if payload[1] & FU_START:
                stream += start + bytes([payload[0] & 0xE0 | payload[1] & 31])
            stream += payload[2:]
        else:
            stream += start + payload
    return bytes(stream)


def decoded(pictures: Sequence[Sequence[bytes]]) -> list[Image]:
    """What FFmpeg's decoder makes of the packets of pictures, BGR."""
    decoder: Any = av.CodecContext.create("h264", "r")
    decoder.thread_count = 1
    frames = [frame for packets in pictures for frame in decoder.decode(av.Packet(annex_b(packets)))]
    frames += decoder.decode(None)
    return [frame.to_ndarray(format="bgr24") for frame in frames]


def psnr_db(one: Image, other: Image) -> float:
    mean_square = float(np.mean((one.astype(float) - other.astype(float)) ** 2))
    return 10.0 * float(np.log10(255.0**2 / max(mean_square, 1e-9)))
