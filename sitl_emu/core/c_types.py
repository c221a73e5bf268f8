"""C's numbers: the types of PX4's tables, logs and messages, and what becomes of a number that its type cannot hold.

Nothing in here raises for a number, as nothing does in PX4's C++: a float32 that overflows is infinite, an integer
wraps around, and a float becomes an integer as on x86, where PX4's simulation runs (Intel's manual, CVTTSS2SI: what the
register cannot hold becomes the register's least integer, of which a smaller type keeps the low bits).
"""

import math
import re
import struct
from collections.abc import Iterable, Sequence
from typing import Any, Final

STRUCT_CODES = {
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
    "double": "d",
    "bool": "?",
    "char": "c",
}
"""Code of Python's struct by C type."""
BITS: Final = {code: 8 * struct.calcsize(f"<{code}") for code in "BbHhIiQq"}
IN_64_BITS: Final = frozenset("IQq")
"""Codes of the integers to which a float is converted by way of an int64, the others by way of an int32."""
INT32_MIN: Final = -(1 << 31)
INT32_MAX: Final = (1 << 31) - 1
FLOAT32_MAX: Final = (2.0 - 2.0**-23) * 2.0**127
_FLOAT32: Final = struct.Struct("<f")
_ITEM: Final = re.compile(r"(\d*)([a-zA-Z?])")

Value = float | int | bool | bytes


class Layout:
    """A packed C struct in little-endian order, as `struct.Struct`, that takes any number for any of its places."""

    __slots__ = ("_codes", "_exact", "size", "unpack", "unpack_from")

    def __init__(self, items: str | Iterable[str]) -> None:
        """`items`: struct's codes with their counts, such as "Q3fB" or ("Q", "4s")."""
        text = "".join(items)
        self._exact = struct.Struct(f"<{text}")
        self._codes = tuple(
            each
            for count, code in _ITEM.findall(text)
            for each in ((f"{count}s",) if code == "s" else (code,) * int(count or 1))
        )
        self.size = self._exact.size
        self.unpack, self.unpack_from = self._exact.unpack, self._exact.unpack_from

    def pack(self, *values: Any) -> bytes:
        """The values' bytes; raises struct.error if there are too many or too few, or one is no number."""
        try:
            return self._exact.pack(*values)
        except (struct.error, OverflowError):
            return self._exact.pack(*fitted(self._codes, values))


def fitted(codes: Sequence[str], values: Sequence[Value]) -> list[Value]:
    """Values that their types can hold; bytes stay as they are. Raises struct.error where their counts differ."""
    if len(codes) != len(values):
        raise struct.error(f"{len(values)} values for {len(codes)} places")
    return [_fitted(code, value) for code, value in zip(codes, values, strict=True)]


def float32(value: float | int) -> float:
    """The nearest float32; infinite where it is too large for one."""
    try:
        rounded: float = _FLOAT32.unpack(_FLOAT32.pack(value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)
    return rounded


def product(value: float, factor: float) -> float:
    """C's product of two floats: each is the nearest float32, and so is what comes out."""
    return float32(float32(value) * float32(factor))


def truncated(value: float) -> int:
    """C's conversion to an int32: without the fraction; the least int32 for what has none, NaN and infinity too."""
    return int(value) if INT32_MIN <= value <= INT32_MAX else INT32_MIN


def rounded(value: float) -> int:
    """The nearest int32; the least one for what has none, NaN and infinity too."""
    return round(value) if INT32_MIN <= value <= INT32_MAX else INT32_MIN


def quotient(dividend: float, divisor: float) -> float:
    """C's division of floats: infinite by zero, NaN for zero by zero."""
    if divisor:
        return dividend / divisor
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor) if dividend else math.nan


def integer(code: str, value: float | int) -> int:
    """A number as an integer type (its struct code) holds it."""
    bits = BITS[code]
    if isinstance(value, float):
        least = -(1 << 63) if code in IN_64_BITS else INT32_MIN
        whole = int(value) if least <= value < -least else least
    else:
        whole = value
    wrapped = whole & (1 << bits) - 1
    return wrapped - (1 << bits) if code.islower() and wrapped >> bits - 1 else wrapped


def _fitted(code: str, value: Value) -> Value:
    if isinstance(value, bytes):
        return value
    if code == "?":
        return bool(value)
    if code in BITS:
        return integer(code, value)
    return float32(value) if code == "f" else value
