"""What the filter is fed with, and the buffers in which samples wait until the fusion horizon has reached them.

PX4's EKF2 (src/modules/ekf2/EKF/common.h and src/lib/ringbuffer/TimestampedRingBuffer.hpp, v1.18). The filter runs as
far behind the present as its slowest sensor is late; each sample is fused when the delayed IMU is as old as the sample.
"""

from collections import deque
from typing import Final, Generic, NamedTuple, Protocol, TypeVar

from sitl_emu.autopilot.topics import NAN, NAN3, Quaternion, Vector3

OLDEST_US: Final = 100_000
"""A sample that lies further behind the horizon than this is of no use any more."""
SENSOR_POSITION = {
    "IMU": ("EKF2_IMU_POS_X", "EKF2_IMU_POS_Y", "EKF2_IMU_POS_Z"),
    "RNG": ("EKF2_RNG_POS_X", "EKF2_RNG_POS_Y", "EKF2_RNG_POS_Z"),
    "OF": ("EKF2_OF_POS_X", "EKF2_OF_POS_Y", "EKF2_OF_POS_Z"),
    "EV": ("EKF2_EV_POS_X", "EKF2_EV_POS_Y", "EKF2_EV_POS_Z"),
}
"""Parameters that say where a sensor sits in the body, in metres: IMU, range finder, flow camera, vision."""


class ImuSample(NamedTuple):
    """Integrated gyro (rad) and accelerometer (m/s) in the body frame over `dt_s`, ending at `time_us`."""

    time_us: int
    delta_angle: Vector3
    delta_velocity: Vector3
    dt_s: float


class GnssSample(NamedTuple):
    """One solution of the receiver: degrees, m AMSL, m/s NED; accuracies are 1 sigma."""

    time_us: int
    lat: float
    lon: float
    alt: float
    vel: Vector3
    hacc: float
    vacc: float
    sacc: float
    fix_type: int
    nsats: int
    pdop: float
    spoofed: bool = False
    jammed: bool = False
    antenna: Vector3 = (0.0, 0.0, 0.0)
    """Where the antenna is in the body (m)."""


class AuxiliarySample(NamedTuple):
    """A place by other means than GNSS: degrees, m AMSL (NaN: unknown); accuracies are 1 sigma (NaN: unknown)."""

    time_us: int
    lat: float
    lon: float
    alt: float
    eph: float
    epv: float
    reset_counter: int


class AuxiliaryVelocitySample(NamedTuple):
    """North and east, m/s, with variances."""

    time_us: int
    velocity: tuple[float, float]
    variances: tuple[float, float]


class MagSample(NamedTuple):
    """Field in the body frame (gauss); `reset`: another sensor or another calibration than before."""

    time_us: int
    mag: Vector3
    reset: bool = False


class BaroSample(NamedTuple):
    """Pressure altitude (m); `reset`: another sensor or another calibration than before."""

    time_us: int
    hgt: float
    reset: bool = False


class RangeSample(NamedTuple):
    """Distance along the sensor's axis (m) and its signal quality in percent (0 is bad, -1 unknown)."""

    time_us: int
    rng: float
    quality: int


class FlowSample(NamedTuple):
    """Angular rates of the image and of the sensor's own gyro (rad/s, in the filter's signs), quality 0..255."""

    time_us: int
    flow_rate: tuple[float, float]
    gyro_rate: Vector3
    quality: int


class VisionSample(NamedTuple):
    """A pose from outside. What is not told is NaN; frames are those of vehicle_odometry."""

    time_us: int
    pos: Vector3 = NAN3
    vel: Vector3 = NAN3
    q: Quaternion = (NAN, NAN, NAN, NAN)
    position_var: Vector3 = (0.0, 0.0, 0.0)
    velocity_var: Vector3 = (0.0, 0.0, 0.0)
    orientation_var: Vector3 = (0.0, 0.0, 0.0)
    pos_frame: int = 0
    vel_frame: int = 0
    reset_counter: int = 0
    quality: int = 0


class VisionUpdate(NamedTuple):
    """A pose that has come to the horizon, and how it is to be taken by those that aid with it."""

    sample: VisionSample
    turn: Quaternion | None
    """From its axes to the filter's, where that is known."""
    enabled: bool
    starting: bool
    """Good poses come regularly: whoever does not aid yet may begin."""
    jumped: bool
    """Its source began anew."""
    good: bool
    """Its quality is at least EKF2_EV_QMIN."""


class DragSample(NamedTuple):
    """Mean specific force along body x and y (m/s²)."""

    time_us: int
    accel_xy: tuple[float, float]


class SystemFlags(NamedTuple):
    """What commander and land detector say about the vehicle."""

    time_us: int
    at_rest: bool
    in_air: bool
    gnd_effect: bool
    constant_pos: bool


class Timed(Protocol):
    """Whatever has a time."""

    @property
    def time_us(self) -> int:
        """When it was measured, µs."""
        ...


Sample = TypeVar("Sample", bound=Timed)


class SampleBuffer(Generic[Sample]):
    """Samples of one sensor that the fusion horizon has not reached yet."""

    __slots__ = ("_samples", "newest_us", "next_us", "popped_us", "pushed_us")
    NEVER_US = 1 << 62

    def __init__(self, length: int) -> None:
        self._samples: deque[Sample] = deque(maxlen=max(length, 1))
        self.newest_us = 0
        """Time of the newest sample."""
        self.pushed_us = 0
        """When the newest sample came in; 0: none ever did."""
        self.popped_us = 0
        """When the horizon last reached a sample."""
        self.next_us = self.NEVER_US
        """Before this time nothing can be popped."""

    def push(self, now_us: int, sample: Sample, interval_us: int) -> bool:
        """Take a sample in, unless it comes less than `interval_us` behind the one before."""
        if self.pushed_us and sample.time_us < self.newest_us + interval_us:
            return False
        self._samples.append(sample)
        self.newest_us, self.pushed_us = sample.time_us, now_us
        self.next_us = self._samples[0].time_us
        return True

    def due(self, horizon_us: int, late_us: int) -> bool:
        """A sample is at the horizon, or none has been since `late_us`."""
        return horizon_us >= self.next_us or self.popped_us < late_us

    def newest(self) -> Sample | None:
        """The sample that came in last, if it still waits."""
        return self._samples[-1] if self._samples else None

    def pop(self, horizon_us: int) -> Sample | None:
        """The newest sample that the horizon has reached; it and all older ones leave the buffer."""
        if horizon_us < self.next_us:
            return None
        samples, found = self._samples, None
        while samples and samples[0].time_us <= horizon_us:
            sample = samples.popleft()
            if horizon_us < sample.time_us + OLDEST_US:
                found = sample
        self.popped_us = horizon_us
        self.next_us = samples[0].time_us if samples else self.NEVER_US
        return found
