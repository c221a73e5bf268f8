"""STATUSTEXT: short texts for people, longer ones in chunks.

Source: https://mavlink.io/en/messages/common.html#STATUSTEXT: 50 bytes each; chunks of one text share an id that is not
0 and count `chunk_seq` up; the last chunk is shorter than 50 bytes.
"""

from sitl_emu.core import dialect as mavlink

CHUNK = 50
CRITICAL = 2
WARNING = 4
INFO = 6


def messages_of(text: str, severity: int, text_id: int) -> list[mavlink.MAVLink_message]:
    """The STATUSTEXTs that carry a text. `text_id` (1..65535) has to differ from the last one's."""
    data = text.encode()
    if len(data) <= CHUNK:
        return [mavlink.MAVLink_statustext_message(severity, data)]
    starts = range(0, len(data) + 1, CHUNK)
    return [
        mavlink.MAVLink_statustext_message(severity, data[start : start + CHUNK], text_id, seq)
        for seq, start in enumerate(starts)
    ]


class TextAssembler:
    """Puts chunks together again. A text with a lost chunk is given as far as it came, with "…" for the gap."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int], tuple[int, int, list[str]]] = {}

    def on_message(self, msg: mavlink.MAVLink_message) -> str | None:
        """A whole text when the message was a STATUSTEXT that ends one."""
        if msg.get_type() != "STATUSTEXT":
            return None
        raw = msg.text if isinstance(msg.text, str) else bytes(msg.text).decode(errors="replace")
        text = raw.rstrip("\0")
        if msg.id == 0:
            return text
        key = (msg.get_srcSystem(), msg.get_srcComponent())
        open_id, next_seq, parts = self._open.get(key, (msg.id, 0, []))
        if open_id != msg.id:
            next_seq, parts = 0, []
        if msg.chunk_seq != next_seq:
            parts.append("…")
        parts.append(text)
        if len(text.encode()) < CHUNK:
            self._open.pop(key, None)
            return "".join(parts)
        self._open[key] = (msg.id, msg.chunk_seq + 1, parts)
        return None
