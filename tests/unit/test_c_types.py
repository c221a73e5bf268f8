"""Numbers that their C type cannot hold become what PX4's C++ makes of them."""

import math

from autopilot.c_types import fitted


def test_what_fits_stays() -> None:
    assert fitted("BhI?fd", [255, -3, 7, True, 0.5, 1e300]) == [255, -3, 7, True, 0.5, 1e300]


def test_integers_wrap_around() -> None:
    assert fitted("BbHi", [256, 128, -1, 1 << 31]) == [0, -128, 65535, -(1 << 31)]


def test_floats_are_cut_to_whole_numbers_and_no_number_is_zero() -> None:
    assert fitted("Bhi", [3.9, math.nan, math.inf]) == [3, 0, 0]


def test_too_large_a_float_is_infinite() -> None:
    assert fitted("fff", [1e39, -1e39, 3.0]) == [math.inf, -math.inf, 3.0]


def test_bytes_stay() -> None:
    assert fitted(["4s", "B"], [b"abcd", 300]) == [b"abcd", 44]
