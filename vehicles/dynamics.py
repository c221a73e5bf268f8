"""What all dynamics have in common: the state that the world reads, and quaternions.

Frames: position and velocity NED in metres from the world's origin, body FRD, quaternion (w, x, y, z) body to NED.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from sitl_emu.vehicles.description import Vehicle

Quaternion = tuple[float, float, float, float]
Vector3 = tuple[float, float, float]
Height = Callable[[float, float], float]
"""Terrain: (north_m, east_m) -> height above the world's origin, up."""

Surface = Callable[[float, float, float], tuple[float, float, float]]
"""What is below (north_m, east_m, down_m): its height, and its rise per metre to north and east, there."""

STEP_S: Final = 0.004


class Dynamics:
    """A moving vehicle. `step` advances by STEP_S; everything else is state that may be read at any time."""

    north_m: float
    east_m: float
    down_m: float
    """Of the centre of mass."""
    vn_m_s: float
    ve_m_s: float
    vd_m_s: float
    q: Quaternion
    p_rad_s: float
    q_rad_s: float
    r_rad_s: float
    ax_m_s2: float
    ay_m_s2: float
    az_m_s2: float
    """Specific force in the body frame over the last step: what an accelerometer feels."""
    power_w: float
    """Electrical power of the actuators."""
    running: bool
    """Whether motors push: the airframe vibrates."""
    drive: float
    """What the battery's voltage leaves of the motors' speed, 0..1; whoever steps the battery sets it."""
    wrecked: bool
    """Whether a crash has ended its driving."""

    def describe(self, vehicle: Vehicle) -> None:
        """Take other figures of the same vehicle, as it moves."""
        raise NotImplementedError

    def motor_speeds(self) -> Sequence[float]:
        """Of the motors, over the greatest, 0..1; none where they are not modelled."""
        raise NotImplementedError

    def velocity_at(self, arm: Vector3) -> Vector3:
        """Velocity NED of the point `arm` (NED, m) away from the centre of mass."""
        raise NotImplementedError

    def mobility(self, arm: Vector3, direction: Vector3) -> float:
        """How much an impulse at `arm` along a unit vector changes the velocity there along it, 1/kg."""
        raise NotImplementedError

    def push(self, arm: Vector3, impulse: Vector3) -> None:
        """Take an impulse (NED, N s) at `arm`; the accelerometer feels it in the next step."""
        raise NotImplementedError

    def shift(self, north_m: float, east_m: float, down_m: float) -> None:
        """Move without speed: out of what it has sunk into."""
        raise NotImplementedError

    def wreck(self) -> None:
        """Nothing drives it any more."""
        raise NotImplementedError

    def step(self, controls: tuple[float, ...], wind_n_m_s: float, wind_e_m_s: float, wind_d_m_s: float) -> None:
        """Advance by STEP_S; `controls` as HIL_ACTUATOR_CONTROLS, wind as the velocity of the air, NED."""
        raise NotImplementedError


def slope(height: Height, north_m: float, east_m: float, reach_m: float) -> tuple[float, float, float]:
    """Ground plane at a place: height (m), and its rise per metre to north and east, over ± `reach_m`."""
    k = 0.5 / reach_m
    north = (height(north_m + reach_m, east_m) - height(north_m - reach_m, east_m)) * k
    east = (height(north_m, east_m + reach_m) - height(north_m, east_m - reach_m)) * k
    return height(north_m, east_m), north, east


def slope_angles(rise_north: float, rise_east: float, yaw_rad: float) -> tuple[float, float]:
    """(roll, pitch) of a body with this yaw that lies on such a plane."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    forward, right = rise_north * c + rise_east * s, rise_east * c - rise_north * s
    pitch = math.atan(forward)
    return -math.atan(right * math.cos(pitch)), pitch
