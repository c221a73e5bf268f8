"""PX4's messages by PX4's table; like ROS's, they are born with zeros in them."""

from typing import Any

from sitl_emu.autopilot.uxrce_dds_client import dds_topics
from sitl_emu.run import dds_types


def _zero(kind: str, length: int) -> Any:
    one: Any = False if kind == "bool" else 0.0 if kind.startswith("float") else 0
    return one if length == 1 else [one] * length


def __getattr__(name: str) -> Any:
    """A message's class; of those whose fields are plain."""
    if name not in dds_topics.MESSAGES:
        raise AttributeError(name)
    kind = dds_types.described(name)
    zeros = {field: _zero(of, length) for of, length, field in dds_topics.MESSAGES[name].fields}

    def born(self: Any, **told: Any) -> None:
        for field, value in (zeros | told).items():
            setattr(self, field, value)

    kind.__init__ = born
    return kind
