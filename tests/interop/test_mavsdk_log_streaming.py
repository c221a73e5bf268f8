"""MAVSDK log_streaming: a log that it puts together opens in pyulog."""

import base64
import io
import queue
import time

from mavsdk.plugins.log_streaming import LogStreaming
from pyulog import ULog

from tests.interop.mavsdk_vehicle import Vehicle

LIMIT_S = 60.0
WANTED_BYTES = 150_000
"""Definitions are a third of it."""


def test_a_log_is_streamed(vehicle: Vehicle) -> None:
    plugin = LogStreaming(vehicle.system)
    pieces: queue.Queue[bytes] = queue.Queue()
    handle = plugin.subscribe_log_streaming_raw(lambda raw, _: pieces.put(base64.b64decode(raw.data_base64)))
    plugin.start_log_streaming()
    log, end_s = b"", time.monotonic() + LIMIT_S
    while len(log) < WANTED_BYTES:
        log += pieces.get(timeout=end_s - time.monotonic())
    plugin.stop_log_streaming()
    plugin.unsubscribe_log_streaming_raw(handle)
    plugin.destroy()
    read = ULog(io.BytesIO(log))
    assert read.msg_info_dict["sys_name"] == "PX4"
    assert len(read.get_dataset("sensor_combined").data["timestamp"]) > 100
