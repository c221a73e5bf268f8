"""MAVLink frames in datagrams: where one ends and the next begins, and which message it is. Nothing is decoded here.

Framing: https://mavlink.io/en/guide/serialization.html (MAVLink 1 and 2, signed or not).
"""

from collections.abc import Iterator

STX_V1, STX_V2 = 0xFE, 0xFD
SIGNED = 0x01


def split(datagram: bytes) -> Iterator[tuple[int, bytes]]:
    """(message id, frame) of every whole frame in a datagram; what is no frame is skipped."""
    at, end = 0, len(datagram)
    while at + 8 <= end:
        start = datagram[at]
        if start == STX_V2 and at + 12 <= end:
            length = 12 + datagram[at + 1] + (13 if datagram[at + 2] & SIGNED else 0)
            message_id = datagram[at + 7] | datagram[at + 8] << 8 | datagram[at + 9] << 16
        elif start == STX_V1:
            length = 8 + datagram[at + 1]
            message_id = datagram[at + 5]
        else:
            at += 1
            continue
        if at + length > end:
            return
        yield message_id, datagram[at : at + length]
        at += length
