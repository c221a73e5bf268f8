"""Messages by our table of ROS 2's; like ROS's, they are born with zeros in them."""

from typing import Any

from born import message


def __getattr__(name: str) -> Any:
    """A message's class."""
    return message("vision_msgs", name)
