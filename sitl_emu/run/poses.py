"""Where what a gimbal carries looks, from the vehicle's true attitude and what its gimbal says."""

from sitl_emu.core import attitude
from sitl_emu.core.attitude import Quaternion
from sitl_emu.core.simulator_api import GimbalState

LEVEL = GimbalState((1.0, 0.0, 0.0, 0.0))
"""A gimbal that was not heard of yet looks straight ahead."""


def head_of(gimbal: GimbalState | None, vehicle: Quaternion) -> Quaternion:
    """The attitude (to NED) of a gimbal's head: it turns with the vehicle's heading alone."""
    turned = attitude.quaternion(0.0, 0.0, attitude.heading(vehicle))
    return attitude.product(turned, (gimbal or LEVEL).q)
