"""Streams: one module per outgoing message, named as the message.

A stream module has `ID` (MAVLink message id) and `fields(now_us, context)`, which returns the message's fields in wire
order (arrays flattened), a list of such tuples if it comes in parts, or None when there is nothing to send.
`stamp(now_us, context)`, if it is there, tells when the data last changed: then it is sent once per change, and a
request for what has not changed since is denied. `since(context, number)`, for data that queues or has several sources,
is the newest number (or their stamps) and the messages after `number`, 0 at first: each is sent once. A module with
`PER_LINK = True` is handed the link as third argument, because its content differs per link. One with a class
`Analysis(context)` is handed one of the link, whose `update(now_us)` has been called in every tick since the first
message there: it gathers what the next one tells of the time between. One with `sent(now_us, context, link,
count)` has more to send after its message on that link, which has been sent `count` times before. One with
`requested(now_us, context, param2)` answers REQUEST_MESSAGE by that: a list of messages, or None where there are none.
"""

import functools
import importlib
import pkgutil
from types import ModuleType
from typing import Any

Fields = tuple[Any, ...]


def new_ones(stamps: tuple[int, ...], told: tuple[int, ...] | int) -> list[int]:
    """Which of several sources have spoken since `told`, their stamps of the last time (0: there was none).

    There may be more of them by now.
    """
    before = told if isinstance(told, tuple) else ()
    return [number for number, now in enumerate(stamps) if now != (before[number] if number < len(before) else 0)]


@functools.cache
def modules() -> dict[str, ModuleType]:
    """Stream modules by message name."""
    names = [info.name for info in pkgutil.iter_modules(__path__)]
    return {name.upper(): importlib.import_module(f"{__name__}.{name}") for name in names}
