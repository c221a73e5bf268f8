"""Messages as rclpy makes them: with zeros in them, and whole messages within."""

from typing import Any

from sitl_emu.run.ros.messages import MESSAGES, ONE, SEQUENCE
from sitl_emu.run.ros.publisher import described


def message(package: str, name: str) -> Any:
    """A message's class. Raises AttributeError where the table has none of that name."""
    whole = f"{package}/{name}"
    if whole not in MESSAGES:
        raise AttributeError(name)
    kind = described(whole)

    def born(self: Any, **told: Any) -> None:
        for of, length, field in MESSAGES[whole]:
            setattr(self, field, told[field] if field in told else _zero(of, length))

    kind.__init__ = born
    return kind


def _zero(kind: str, length: int) -> Any:
    if length == SEQUENCE:
        return []
    return _one(kind) if length == ONE else [_one(kind) for _ in range(length)]


def _one(kind: str) -> Any:
    if kind in MESSAGES:
        return message(*kind.split("/"))()
    return "" if kind == "string" else False if kind == "bool" else 0.0 if kind.startswith("float") else 0
