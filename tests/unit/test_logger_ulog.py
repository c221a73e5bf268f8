"""ULog messages as bytes, read back by pyulog, which PX4's developers read logs with."""

import io
import math
import struct

import pytest
from pyulog import ULog

from sitl_emu.autopilot.logger import ulog

FORMATS = {
    "place": ulog.parse_fields("uint64_t timestamp; double lat; float alt; bool valid"),
    "journey": ulog.parse_fields("uint64_t timestamp; place from; place to; float[3] wind; char[4] name"),
}


def log(*messages: bytes) -> ULog:
    return ULog(io.BytesIO(b"".join((ulog.file_header(1_000), ulog.FLAG_BITS, *messages))))


def test_header_flags_and_information() -> None:
    found = log(
        ulog.information("sys_name", "PX4"),
        ulog.information("time_ref_utc", -3600),
        ulog.information("ver_sw_release", 0xFFFFFFFF, "uint32_t"),
        ulog.information_multiple("boot_console_output", "x" * 500),
        ulog.information_multiple("boot_console_output", "second"),
    )
    assert found.start_timestamp == 1_000
    assert found.has_default_parameters
    assert found.msg_info_dict == {"sys_name": "PX4", "time_ref_utc": -3600, "ver_sw_release": 0xFFFFFFFF}
    pieces, second = found.msg_info_multiple_dict["boot_console_output"]
    assert "".join(pieces) == "x" * 500
    assert second == ["second"]


def test_parameters_and_their_defaults() -> None:
    both = ulog.DEFAULT_OF_SYSTEM | ulog.DEFAULT_OF_SETUP
    found = log(
        ulog.parameter("MPC_XY_P", 0.5, True),
        ulog.parameter("MAV_TYPE", 13, False),
        ulog.parameter_default("MPC_XY_P", 0.75, True, both),
        ulog.parameter_default("MAV_TYPE", 2, False, ulog.DEFAULT_OF_SYSTEM),
    )
    assert found.initial_parameters == {"MPC_XY_P": 0.5, "MAV_TYPE": 13}
    assert found.get_default_parameters(0) == {"MPC_XY_P": 0.75, "MAV_TYPE": 2}
    assert found.get_default_parameters(1) == {"MPC_XY_P": 0.75}


def test_data_with_nested_types_and_arrays() -> None:
    layout = struct.Struct("<" + "".join(ulog.codes(FORMATS["journey"], FORMATS)))
    name = (b"o", b"n", b"e", b"\0")
    values = (5_000, 1, 47.5, 400.0, True, 2, 48.5, math.nan, False, 1.0, 2.0, 3.0, *name)
    found = log(
        *(ulog.format_definition(name, fields) for name, fields in FORMATS.items()),
        ulog.subscription(7, "journey", multi_id=1),
        ulog.data_header(layout.size, 7) + layout.pack(*values),
    )
    (dataset,) = found.data_list
    assert (dataset.name, dataset.multi_id) == ("journey", 1)
    data = {name: column[0] for name, column in dataset.data.items()}
    assert (data["timestamp"], data["from.lat"], data["from.valid"], data["to.timestamp"]) == (5_000, 47.5, 1, 2)
    assert math.isnan(data["to.alt"])
    assert [data[f"wind[{n}]"] for n in range(3)] == [1.0, 2.0, 3.0]


def test_texts_and_sync_marks() -> None:
    place = struct.Struct("<" + "".join(ulog.codes(FORMATS["place"], FORMATS)))
    found = log(
        ulog.format_definition("place", FORMATS["place"]),
        ulog.subscription(0, "place"),
        ulog.data_header(place.size, 0) + place.pack(9_000, 47.5, 400.0, True),
        ulog.SYNC,
        ulog.logged_message(2, 10_000, "Not logging"),
    )
    (text,) = found.logged_messages
    assert (text.timestamp, text.log_level_str(), text.message) == (10_000, "CRITICAL", "Not logging")
    assert not found.dropouts and not found.file_corruption


@pytest.mark.parametrize("text", ["", "x" * 219, "x" * 220, "é" * 300])
def test_a_text_of_any_length_comes_back_whole(text: str) -> None:
    pieces = ulog.information_multiple("perf_top", text)
    joined = log(pieces).msg_info_multiple_dict.get("perf_top", [[]])[0] if pieces else []
    assert "".join(joined) == text
