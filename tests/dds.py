"""DDS for tests: a network that nobody outside this machine hears, and the wait for what comes over it."""

import os
import time
from collections.abc import Callable
from typing import Any

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General>"
    "</Domain></CycloneDDS>"
)
"""For CYCLONEDDS_URI."""
LOOK_S = 0.005


def domain() -> int:
    """One of this process's own whose ports, from 7400 + 250 * domain on, are none of a vehicle's: as domain 29 has
    14650, where instance 70 listens."""
    return 50 + os.getpid() % 50


def until(true: Callable[[], Any], limit_s: float) -> None:
    """Wait until something is so."""
    end = time.monotonic() + limit_s
    while not true():
        assert time.monotonic() < end, "it has not come about"
        time.sleep(LOOK_S)
