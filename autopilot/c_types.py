"""The types of PX4's tables and logs, and what happens to a number that its type cannot hold."""

import math
import struct
from collections.abc import Sequence

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
BITS = {code: 8 * struct.calcsize(f"<{code}") for code in "BbHhIiQq"}
LARGEST_FLOAT = 3.4028234663852886e38
"""Of a float32."""

Value = float | int | bool | bytes


def fitted(codes: Sequence[str], values: Sequence[Value]) -> list[Value]:
    """Values that their types can hold: too large a float is infinite, an integer wraps around, as in PX4's C++.

    What is no number is 0 as an integer; bytes stay as they are.
    """
    return [_fitted(code, value) for code, value in zip(codes, values, strict=True)]


def _fitted(code: str, value: Value) -> Value:
    if isinstance(value, bytes):
        return value
    if code == "?":
        return bool(value)
    if code in BITS:
        bits = BITS[code]
        wrapped = int(value) & (1 << bits) - 1 if math.isfinite(value) else 0
        return wrapped - (1 << bits) if code.islower() and wrapped >> bits - 1 else wrapped
    return math.copysign(math.inf, value) if code == "f" and abs(value) > LARGEST_FLOAT else value
