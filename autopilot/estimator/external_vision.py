"""What an external vision or motion capture system tells, in the filter's terms: NED, with variances, as EKF2_EV_* say.

PX4's EKF2, aid_sources/external_vision (v1.18). Frames: a pose in NED is taken as it is; one in FRD has an unknown
heading, and is turned by what its heading and the filter's differ, unless its heading is the filter's (EKF2_EV_CTRL
bit 3). Velocities may also be in the body's axes.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from autopilot.topics import FRAME_BODY_FRD, FRAME_FRD, FRAME_NED, Vector3, VehicleOdometry

HORIZONTAL, VERTICAL, VELOCITY, YAW = 1, 2, 4, 8
"""Bits of EKF2_EV_CTRL."""
FARTHEST_M, FASTEST_M_S = 1e6, 1e3
"""What is beyond these is no pose of a vehicle, and nothing to compute with."""
NOISE_BY_PARAMETER = 1
"""EKF2_EV_NOISE_MD."""


class Settings(NamedTuple):
    """EKF2_EV_* parameters."""

    control: int
    by_parameter: bool
    position_noise_m: float
    velocity_noise_m_s: float
    angle_noise_rad: float
    position_gate: float
    velocity_gate: float
    quality_min: int


def settings_of(value: Mapping[str, float]) -> Settings:
    """Copy them."""
    return Settings(
        int(value["EKF2_EV_CTRL"]),
        int(value["EKF2_EV_NOISE_MD"]) == NOISE_BY_PARAMETER,
        float(value["EKF2_EVP_NOISE"]),
        float(value["EKF2_EVV_NOISE"]),
        float(value["EKF2_EVA_NOISE"]),
        float(value["EKF2_EVP_GATE"]),
        float(value["EKF2_EVV_GATE"]),
        int(value["EKF2_EV_QMIN"]),
    )


class Observation(NamedTuple):
    """What is to be fused: None where EKF2_EV_CTRL does not want it, or it is not told."""

    horizontal: tuple[float, float] | None
    down: float | None
    position_variance: Vector3
    velocity: Vector3 | None
    velocity_variance: Vector3
    yaw: float | None
    yaw_variance: float
    north_aligned: bool
    """Its heading counts from north, and not from wherever it began."""


def observe(sample: VehicleOdometry, rotation: tuple[float, ...], settings: Settings) -> Observation | None:
    """`rotation`: the filter's, body to NED, nine numbers by rows. None for a sample of too low a quality."""
    if settings.quality_min > 0 and sample.quality < settings.quality_min:
        return None
    control = settings.control
    w, x, y, z = sample.q
    yaw_told = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    wants_yaw = bool(control & YAW) and math.isfinite(yaw_told)
    turn = 0.0
    if not wants_yaw and math.isfinite(yaw_told):
        turn = math.atan2(rotation[3], rotation[0]) - yaw_told
    horizontal, down = None, None
    px, py, pz = sample.position
    if sample.pose_frame == FRAME_FRD:
        px, py = _turned(px, py, turn)
    if control & HORIZONTAL and sample.pose_frame in (FRAME_NED, FRAME_FRD) and abs(px) + abs(py) < FARTHEST_M:
        horizontal = (px, py)
    if control & VERTICAL and abs(pz) < FARTHEST_M:
        down = pz
    velocity, spread = None, sample.velocity_variance
    if control & VELOCITY and all(abs(value) < FASTEST_M_S for value in sample.velocity):
        velocity = sample.velocity
        if sample.velocity_frame == FRAME_BODY_FRD:
            velocity = _rotated(rotation, velocity)
            largest = max(spread) if all(math.isfinite(value) for value in spread) else math.nan
            spread = (largest, largest, largest)
        elif sample.velocity_frame == FRAME_FRD:
            velocity = (*_turned(velocity[0], velocity[1], turn), velocity[2])
    return Observation(
        horizontal,
        down,
        _variances(sample.position_variance, settings.position_noise_m, settings),
        velocity,
        _variances(spread, settings.velocity_noise_m_s, settings),
        yaw_told if wants_yaw else None,
        _variances(sample.orientation_variance, settings.angle_noise_rad, settings)[2],
        sample.pose_frame == FRAME_NED,
    )


def _variances(told: Vector3, noise: float, settings: Settings) -> Vector3:
    """The message's where EKF2_EV_NOISE_MD is 0 and it has them, but no less than the parameter's."""
    least = noise * noise
    if settings.by_parameter:
        return least, least, least
    x, y, z = (max(value, least) if math.isfinite(value) and value > 0.0 else least for value in told)
    return x, y, z


def _turned(x: float, y: float, angle: float) -> tuple[float, float]:
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y


def _rotated(r: tuple[float, ...], v: Vector3) -> Vector3:
    return (
        r[0] * v[0] + r[1] * v[1] + r[2] * v[2],
        r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
        r[6] * v[0] + r[7] * v[1] + r[8] * v[2],
    )
