"""Numbers that their C type cannot hold become what PX4's C++ makes of them."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl_emu.core.c_types import BITS, Layout, fitted, float32, integer, rounded, truncated

ANY_NUMBER = st.one_of(st.integers(), st.floats(), st.booleans())


def test_what_fits_stays() -> None:
    assert fitted("BhI?fd", [255, -3, 7, True, 0.5, 1e300]) == [255, -3, 7, True, 0.5, 1e300]


def test_integers_wrap_around() -> None:
    assert fitted("BbHi", [256, 128, -1, 1 << 31]) == [0, -128, 65535, -(1 << 31)]


def test_floats_lose_their_fraction() -> None:
    assert fitted("Bhi", [3.9, -3.9, 1e9 + 0.5]) == [3, -3, 1_000_000_000]


def test_floats_wrap_around_in_small_types() -> None:
    assert fitted("BBhH", [-1.0, 256.5, 40_000.0, 65_537.0]) == [255, 0, -25_536, 1]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e30])
def test_no_integer_is_the_low_bits_of_the_least_one(value: float) -> None:
    assert fitted("BbHhIi", [value] * 6) == [0, 0, 0, 0, 0, -(1 << 31)]
    assert fitted("qQ", [value] * 2) == [-(1 << 63), 1 << 63]
    assert truncated(value) == rounded(value) == -(1 << 31)


def test_conversions_to_int32_cut_or_round() -> None:
    assert [truncated(value) for value in (-1.7, 1.7, 2.0**31 - 1)] == [-1, 1, (1 << 31) - 1]
    assert [rounded(value) for value in (-1.7, 1.7, -(2.0**31))] == [-2, 2, -(1 << 31)]


def test_too_large_a_float_is_infinite() -> None:
    assert fitted("fff", [1e39, -1e39, 3.0]) == [math.inf, -math.inf, 3.0]
    assert float32(0.1) == struct.unpack("<f", struct.pack("<f", 0.1))[0]


def test_bytes_stay() -> None:
    assert fitted(["4s", "B"], [b"abcd", 300]) == [b"abcd", 44]


def test_a_layout_packs_as_struct_does() -> None:
    layout = Layout("Q2f4sB")
    assert layout.size == struct.calcsize("<Q2f4sB")
    assert layout.pack(1, 2.0, 3.0, b"abcd", 5) == struct.pack("<Q2f4sB", 1, 2.0, 3.0, b"abcd", 5)
    assert layout.unpack(layout.pack(1, 2.0, 3.0, b"abcd", 300)) == (1, 2.0, 3.0, b"abcd", 44)


def test_a_layout_does_not_hide_a_missing_value() -> None:
    with pytest.raises(struct.error):
        Layout("Bf").pack(300)


@given(st.sampled_from([*BITS, "f", "?"]), ANY_NUMBER)
def test_every_number_fits_somehow(code: str, value: float) -> None:
    assert len(Layout(code).pack(value)) == struct.calcsize(f"<{code}")


@given(st.sampled_from(sorted(BITS)), st.integers())
def test_an_integer_keeps_its_low_bits(code: str, value: int) -> None:
    assert (integer(code, value) - value) % (1 << BITS[code]) == 0
