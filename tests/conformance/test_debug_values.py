"""Numbers that a companion wants a ground station to see: the autopilot tells the last of each kind again, once."""

from typing import Any

import pytest

pytestmark = pytest.mark.covers(
    "NAMED_VALUE_FLOAT", "DEBUG", "DEBUG_VECT", source="https://docs.px4.io/v1.18/en/debug/debug_values"
)


def test_a_named_value_is_told_again(station: Any) -> None:
    station.mav.named_value_float_send(123, b"harvest", 1.5)
    heard = station.receive("NAMED_VALUE_FLOAT")
    assert (heard.get_srcSystem(), heard.name, heard.value) == (station.system, "harvest", 1.5)


@pytest.mark.covers("NAMED_VALUE_INT", source="https://docs.px4.io/v1.18/en/msg_docs/DebugKeyValue")
def test_a_named_integer_is_told_as_a_float(station: Any) -> None:
    station.mav.named_value_int_send(123, b"rows", -7)
    heard = station.receive("NAMED_VALUE_FLOAT")
    assert (heard.get_srcSystem(), heard.name, heard.value) == (station.system, "rows", -7.0)


def test_an_indexed_value_is_told_again(station: Any) -> None:
    station.mav.debug_send(123, 5, 2.5)
    heard = station.receive("DEBUG")
    assert (heard.get_srcSystem(), heard.ind, heard.value) == (station.system, 5, 2.5)


def test_a_vector_is_told_again(station: Any) -> None:
    station.mav.debug_vect_send(b"offset", 123, 1.0, -2.0, 3.0)
    heard = station.receive("DEBUG_VECT")
    assert (heard.get_srcSystem(), heard.name, heard.x, heard.y, heard.z) == (station.system, "offset", 1.0, -2.0, 3.0)
