"""The computer and its log (writers: system/, logger/)."""

from typing import NamedTuple


class LoggerStatus(NamedTuple):
    """Writer: logger.py, while a log is being written."""

    timestamp: int = 0
    is_logging: bool = False


class CpuLoad(NamedTuple):
    """Writer: system/load_mon.py. Shares of 1; timestamp 0 where nobody measures them."""

    timestamp: int = 0
    load: float = 0.0
    ram_usage: float = 0.0
