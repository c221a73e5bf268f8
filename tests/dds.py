"""DDS for tests: a network that nobody outside this machine hears, and the wait for what comes over it."""

import time
from collections.abc import Callable
from typing import Any

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General>"
    "</Domain></CycloneDDS>"
)
"""For CYCLONEDDS_URI."""
LOOK_S = 0.005


def until(true: Callable[[], Any], limit_s: float) -> None:
    """Wait until something is so."""
    end = time.monotonic() + limit_s
    while not true():
        assert time.monotonic() < end, "it has not come about"
        time.sleep(LOOK_S)
