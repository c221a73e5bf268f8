"""A stream at work: what one module of streams/ says, as payloads for the links."""

from typing import Any

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.encoder import Encoder
from sitl_emu.autopilot.mavlink.link import Link, Schedulable
from sitl_emu.autopilot.mavlink.streams import modules


class Stream(Schedulable):
    """A stream module at work for one vehicle; payloads made in one tick are shared by the links."""

    def __init__(self, name: str, context: Context, encoder: Encoder) -> None:
        """`name` is the MAVLink message's; raises ModuleNotFoundError if there is no such stream."""
        module: Any = modules()[name]
        self.name = name
        self.codec = encoder.codec(module.ID)
        self._fields = module.fields
        self._stamp: Any = getattr(module, "stamp", None)
        self._since = getattr(module, "since", None)
        self._requested = getattr(module, "requested", None)
        self._at_once = bool(getattr(module, "AT_ONCE", False))
        self._per_link = bool(getattr(module, "PER_LINK", False))
        self._sent: Any = getattr(module, "sent", None)
        self.has_sequel = self._sent is not None
        self._sent_counts: dict[str, int] = {}
        """By the name of the link, as are those below."""
        self._analysis: Any = getattr(module, "Analysis", None)
        self._analyses: dict[str, Any] = {}
        self._context = context
        self._made_us = -1
        self._payloads: tuple[bytes, ...] = ()
        self._sent_stamps: dict[str, Any] = {}

    def payloads(self, now_us: int, link: Link) -> tuple[bytes, ...]:
        """What to send on a link now; empty if nothing, or nothing new."""
        if self._analysis is not None:
            return (self.codec.pack(*self._fields(now_us, self._context, self._analysis_on(now_us, link))),)
        if self._per_link:
            return (self.codec.pack(*self._fields(now_us, self._context, link)),)
        if self._since is not None:
            self._sent_stamps[link.name], messages = self._since(self._context, self._sent_stamps.get(link.name, 0))
            return tuple(self.codec.pack(*fields) for fields in messages)
        if self._stamp is not None:
            stamp = self._stamp(now_us, self._context)
            if self._sent_stamps.get(link.name) == stamp:
                return ()
            self._sent_stamps[link.name] = stamp
        return self.latest(now_us)

    def sent(self, now_us: int, link: Link) -> None:
        """Its message was sent on a link."""
        if self._sent is not None:
            count = self._sent_counts.get(link.name, 0)
            self._sent_counts[link.name] = count + 1
            self._sent(now_us, self._context, link, count)

    def begin(self, now_us: int, link: Link) -> bool:
        """The stream is there on a link from now on; whether that alone sends its message."""
        if self._at_once:
            for payload in self.payloads(now_us, link):
                link.send_payload(self.codec, payload)
        return self._at_once

    def forget(self, link: Link) -> None:
        """What was sent on a link is no longer known: the stream was switched off there."""
        self._sent_stamps.pop(link.name, None)
        self._sent_counts.pop(link.name, None)
        self._analyses.pop(link.name, None)

    @property
    def analyses(self) -> bool:
        """Its content is of all the time since its last message on a link."""
        return self._analysis is not None

    def analyse(self, now_us: int) -> None:
        """Take what is new, for the links on which it was sent before."""
        for analysis in self._analyses.values():
            analysis.update(now_us)

    def _analysis_on(self, now_us: int, link: Link) -> Any:
        """The one of a link; the first begins with what there is now."""
        found = self._analyses.get(link.name)
        if found is None:
            found = self._analyses[link.name] = self._analysis(self._context)
            found.update(now_us)
        return found

    def latest(self, now_us: int) -> tuple[bytes, ...]:
        """The message as it is now, new or not; empty if there is nothing to say."""
        if self._made_us != now_us:
            self._made_us = now_us
            fields = self._fields(now_us, self._context)
            if fields is None:
                self._payloads = ()
            elif isinstance(fields, list):
                self._payloads = tuple(self.codec.pack(*part) for part in fields)
            else:
                self._payloads = (self.codec.pack(*fields),)
        return self._payloads

    def requested(self, now_us: int, link: Link, param2: float) -> tuple[bytes, ...] | None:
        """The messages that REQUEST_MESSAGE wants, as of now (a command may have come since the last tick).

        None: there is nothing to say, or nothing new since the last time that it was said on the link.
        """
        if self._requested is not None:
            messages = self._requested(now_us, self._context, param2)
            return None if messages is None else tuple(self.codec.pack(*fields) for fields in messages)
        self._made_us = -1
        return self.payloads(now_us, link) or None
