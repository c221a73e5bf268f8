"""What companions of the agriculture mission do, as they tell each other (`companion/peer_link.py`)."""

from enum import IntEnum


class Role(IntEnum):
    """A companion's role."""

    SCOUT = 1
    """Finds targets."""
    INSPECT = 2
    """Goes to targets that scouts send, and looks at them."""
