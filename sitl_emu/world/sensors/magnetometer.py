"""Magnetometer: the Earth's field of the home location in the body frame, hard-iron bias, white noise."""

import math
import operator

from sitl_emu.core.geomagnetism import MagneticField
from sitl_emu.vehicles.description import Magnetometer as MagnetometerData
from sitl_emu.vehicles.dynamics import Quaternion
from sitl_emu.world.noise import generator, normals


class Magnetometer:
    """Reads the field in gauss, FRD."""

    def __init__(self, data: MagnetometerData, field: MagneticField, seed: int, name: str) -> None:
        draw = self._draw = normals(seed, name, "magnetometer")
        self._bias = (data.bias_gauss * draw(), data.bias_gauss * draw(), data.bias_gauss * draw())
        self._noise = data.noise_gauss
        self._early_share, self._early = data.early_share, generator(seed, name, "magnetometer", "early")
        self.offset_gauss = (0.0, 0.0, 0.0)
        """PX4's SIM_MAG_OFFSET_X, _Y, _Z."""
        horizontal = field.strength_gauss * math.cos(field.inclination_rad)
        self._field = (
            horizontal * math.cos(field.declination_rad),
            horizontal * math.sin(field.declination_rad),
            field.strength_gauss * math.sin(field.inclination_rad),
        )

    def is_early(self) -> bool:
        """Whether the next sample will be of the tick before."""
        return self._early_share > 0.0 and self._early.random() < self._early_share

    def read(self, attitude: Quaternion) -> tuple[float, float, float]:
        """Field along body x, y, z, gauss."""
        w, x, y, z = attitude
        north, east, down = self._field
        draw = self._draw
        bias_x, bias_y, bias_z = map(operator.add, self._bias, self.offset_gauss)
        return (
            (1.0 - 2.0 * (y * y + z * z)) * north + 2.0 * (x * y + w * z) * east + 2.0 * (x * z - w * y) * down
            + bias_x + self._noise[0] * draw(),
            2.0 * (x * y - w * z) * north + (1.0 - 2.0 * (x * x + z * z)) * east + 2.0 * (y * z + w * x) * down
            + bias_y + self._noise[1] * draw(),
            2.0 * (x * z + w * y) * north + 2.0 * (y * z - w * x) * east + (1.0 - 2.0 * (x * x + y * y)) * down
            + bias_z + self._noise[2] * draw(),
        )  # fmt: skip
