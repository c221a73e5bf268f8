"""Whether a sensor says anything new: PX4's DataValidator (src/modules/sensors/data_validator, v1.18)."""

from typing import Final

from sitl_emu.autopilot.topics import Vector3

BARO_EQUAL_VALUES: Final = 100
"""VALUE_EQUAL_COUNT_DEFAULT: so many numbers one after the other may be the same as before."""
MAG_EQUAL_VALUES: Final = 1000
"""VehicleMagnetometer.cpp."""
SAME: Final = 1e-6


class DataValidator:
    """`stale`: it has said the same for too long."""

    def __init__(self, equal_values: int) -> None:
        """`equal_values`: MAG_EQUAL_VALUES or BARO_EQUAL_VALUES; a sample of three counts as three."""
        self._equal_values = equal_values
        self._values: Vector3 = (0.0, 0.0, 0.0)
        self._equal = 0
        self.put_us = 0
        """When the last sample came; 0: none has."""

    def put(self, now_us: int, values: Vector3) -> None:
        """One more sample."""
        self.put_us = now_us
        for value, before in zip(values, self._values, strict=True):
            self._equal = self._equal + 1 if abs(value - before) < SAME else 0
        self._values = values

    @property
    def stale(self) -> bool:
        """Nobody shall use it."""
        return self._equal > self._equal_values
