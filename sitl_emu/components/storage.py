"""How full a camera's storage is: images and videos take of it, formatting empties it.

https://mavlink.io/en/services/camera.html#storage-status. Sizes are those of the vehicle's data, in MiB, and not of
files: `card.py` has those, where there are some.
"""

from dataclasses import dataclass


@dataclass
class Storage:
    """The storage of one camera."""

    size_mib: float
    used_mib: float = 0.0

    @property
    def free_mib(self) -> float:
        """Without what a video that is being recorded has taken so far."""
        return self.size_mib - self.used_mib
