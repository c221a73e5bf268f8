"""Two words for mypy, which can't know that a model has a part nor that a vehicle changes between two asserts."""

from typing import TypeVar

T = TypeVar("T")


def present(part: T | None) -> T:
    """The part of a vehicle, optional in general, which this test's model must have."""
    assert part is not None
    return part


def now(state: T) -> T:
    """The state as it is at this moment; mypy does not conclude from it what it will be after the next step."""
    return state
