"""uorb: which topics there are, and how often they are published (PX4: systemcmds/uorb).

Subscribers are not counted here, because every module reads the topics where they lie. PX4's remote shell adds a -1 to
whatever is asked of uorb (Pxh::_check_remote_uorb_command), so that `top` measures once and ends.
"""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import SUCCESS, WAIT, Output, Vehicle, usage
from sitl_emu.autopilot.topics import topic_names

ONCE_US = 2_000_000
CLEAR_SCREEN = "\033[2J\n"
CLEAR_LINE = "\033[K"
COMMANDS = (
    ("status", "all topics"),
    ("top", "how often topics are published; -a all; names to look for"),
)
ONCE = "-1"


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`uorb status` or `uorb top [-a] [FILTER...]`."""
    command, *words = (*arguments, ONCE)
    if command == "start":
        return SUCCESS
    if command == "status":
        names = topic_names(vehicle.topics)
        width = max(len(name) for name in names)
        yield f"{'TOPIC NAME':<{width - 2}} INST #SUB #Q SIZE PATH\n"
        for name in names:
            yield f"{name:<{width}} {0:2} {'-':>4} {1:2} {'-':>4} /obj/{name}0\n"
        return SUCCESS
    if command == "top":
        return (yield from _top(vehicle, words))
    yield usage("uorb", COMMANDS)
    return SUCCESS


def _top(vehicle: Vehicle, words: list[str]) -> Output:
    """What is published now, or with further words all of what they choose (DeviceMaster::showTop)."""
    active_only = words == [ONCE]
    filters = [] if active_only or "-a" in words else words
    topics = vehicle.topics
    every = topic_names(topics)
    names = [name for name in every if not filters or any(part in name for part in filters)]
    width = max((len(name) for name in names), default=0)
    yield CLEAR_SCREEN
    start_us = vehicle.now_us
    counts = dict.fromkeys(names, 0)
    last = {name: getattr(topics, name) for name in names}
    while vehicle.now_us - start_us < ONCE_US:
        yield WAIT
        for name in names:
            record = getattr(topics, name)
            if record is not last[name]:
                last[name] = record
                counts[name] += 1
    seconds = (vehicle.now_us - start_us) * 1e-6
    hz = {name: round(count / seconds) for name, count in counts.items()}
    yield f"{CLEAR_LINE}update: 1s, topics: {len(every)}, total publications: {sum(hz.values())}\n"
    yield f"{CLEAR_LINE}{'TOPIC NAME':<{max(width - 2, 0)}} INST #SUB RATE #Q SIZE\n"
    for name in names:
        if hz[name] or not active_only:
            yield f"{CLEAR_LINE}{name:<{width}} {0:2} {'-':>4} {hz[name]:4} {1:2} {'-':>4} \n"
    return SUCCESS
