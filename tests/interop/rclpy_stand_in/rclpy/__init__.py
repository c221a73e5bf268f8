"""What of rclpy the example uses."""

import math
import time
from typing import Any

_running = True


def init() -> None:
    """As rclpy.init."""


def ok() -> bool:
    """As rclpy.ok."""
    return _running


def shutdown() -> None:
    """As rclpy.shutdown."""


def spin_once(node: Any, timeout_sec: float = 0.0) -> None:
    """Wait for the next timer or message, hear what has come, and let the timer's function do its work."""
    due_s = min((timer.due_s for timer in node.timers), default=math.inf)
    node.wait(max(0.0, min(timeout_sec, due_s - time.monotonic())))
    node.hear()
    for timer in node.timers:
        timer.run(time.monotonic())


def spin(node: Any) -> None:
    """Until Ctrl-C."""
    while ok():
        spin_once(node, 1.0)
