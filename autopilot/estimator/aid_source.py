"""The last sample of an aid, and what the filter made of it: innovation, its variance, test ratios and their low-pass.

PX4's EKF2 (updateAidSourceStatus in EKF/ekf.h, v1.18): innovations are estimate minus measurement; the filtered test
ratio keeps the innovation's sign, follows with half a second, and is what pre-flight checks look at.
"""

import math
from collections.abc import Sequence
from typing import Final

from sitl_emu.autopilot.topics import NAN, EstimatorAidSource1d, EstimatorAidSource2d, EstimatorAidSource3d

FILTER_S: Final = 0.5
LARGEST_INNOVATION: Final = 2.0
"""In gates: what is filtered is limited to it while a sample lies beyond."""


class AidSource:
    """One aid of `axes` numbers. `generation` counts samples, for who wants to tell what is new."""

    __slots__ = (
        "fused", "gate", "generation", "innovation", "innovation_filtered", "innovation_rejected",
        "innovation_variance", "observation", "observation_variance", "test_ratio", "test_ratio_filtered",
        "time_last_fuse", "timestamp_sample",
    )  # fmt: skip

    def __init__(self, axes: int) -> None:
        self.timestamp_sample = self.time_last_fuse = self.generation = 0
        self.observation = [0.0] * axes
        self.observation_variance = [0.0] * axes
        self.innovation = [0.0] * axes
        self.innovation_filtered = [0.0] * axes
        self.innovation_variance = [0.0] * axes
        self.test_ratio = [0.0] * axes
        self.test_ratio_filtered = [0.0] * axes
        self.gate = 1.0
        self.innovation_rejected = self.fused = False

    def update(
        self,
        time_us: int,
        observation: Sequence[float],
        observation_variance: Sequence[float],
        innovation: Sequence[float],
        innovation_variance: Sequence[float],
        gate: float,
    ) -> None:
        """Take over a sample measured at `time_us`; `gate` in standard deviations."""
        rejected = False
        follows = 0 < self.timestamp_sample < time_us
        dt_s = min(max((time_us - self.timestamp_sample) * 1e-6, 1e-3), 1.0)
        alpha = dt_s / (dt_s + FILTER_S)
        for axis, (difference, variance) in enumerate(zip(innovation, innovation_variance, strict=True)):
            scale = gate * gate * variance
            ratio = difference * difference / scale if scale > 0.0 else NAN
            if follows:
                signed = math.copysign(ratio, difference) if difference else 0.0
                self.test_ratio_filtered[axis] = _toward(self.test_ratio_filtered[axis], signed, alpha)
                self.innovation_filtered[axis] = _toward(self.innovation_filtered[axis], difference, alpha)
                if ratio > LARGEST_INNOVATION**2:
                    self._limit(axis, gate * math.sqrt(variance))
            else:
                self.test_ratio_filtered[axis], self.innovation_filtered[axis] = ratio, difference
            self.test_ratio[axis] = ratio
            rejected = rejected or not ratio <= 1.0
        self.observation = list(observation)
        self.observation_variance = list(observation_variance)
        self.innovation = list(innovation)
        self.innovation_variance = list(innovation_variance)
        self.gate = gate
        self.timestamp_sample = time_us
        self.innovation_rejected, self.fused = rejected, False
        self.generation += 1

    def _limit(self, axis: int, gate_width: float) -> None:
        largest = LARGEST_INNOVATION**2
        self.test_ratio_filtered[axis] = min(max(self.test_ratio_filtered[axis], -largest), largest)
        largest = LARGEST_INNOVATION * gate_width
        self.innovation_filtered[axis] = min(max(self.innovation_filtered[axis], -largest), largest)

    def clip(self, axis: int) -> None:
        """Accept the sample after all, with its innovation cut down to the gate."""
        largest = self.gate * math.sqrt(max(self.innovation_variance[axis], 0.0))
        self.innovation[axis] = min(max(self.innovation[axis], -largest), largest)
        self.innovation_rejected = False

    def reset(self, horizon_us: int) -> None:
        """The state was set to this observation: it fits."""
        axes = len(self.observation)
        self.time_last_fuse = horizon_us
        self.innovation = [0.0] * axes
        self.innovation_filtered = [0.0] * axes
        self.innovation_variance = list(self.observation_variance)
        self.test_ratio = [0.0] * axes
        self.test_ratio_filtered = [0.0] * axes
        self.innovation_rejected, self.fused = False, True

    def largest_ratio(self, axes: int = 3) -> float:
        """Largest filtered test ratio of the first `axes`, without its sign."""
        ratios = self.test_ratio_filtered
        largest = abs(ratios[0])
        for axis in range(1, min(axes, len(ratios))):
            largest = max(largest, abs(ratios[axis]))
        return largest


def _toward(old: float, new: float, alpha: float) -> float:
    return new if math.isnan(old) or math.isinf(old) else old + alpha * (new - old)


def record_1d(aid: AidSource, now_us: int, device_id: int = 0) -> EstimatorAidSource1d:
    """What uORB tells of an aid of one number."""
    return EstimatorAidSource1d(
        now_us,
        aid.timestamp_sample,
        0,
        device_id,
        aid.time_last_fuse,
        aid.observation[0],
        aid.observation_variance[0],
        aid.innovation[0],
        aid.innovation_filtered[0],
        aid.innovation_variance[0],
        aid.test_ratio[0],
        aid.test_ratio_filtered[0],
        aid.innovation_rejected,
        aid.fused,
    )


def record_2d(aid: AidSource, now_us: int, device_id: int = 0) -> EstimatorAidSource2d:
    """What uORB tells of an aid of two axes."""
    return EstimatorAidSource2d(
        now_us,
        aid.timestamp_sample,
        0,
        device_id,
        aid.time_last_fuse,
        (aid.observation[0], aid.observation[1]),
        (aid.observation_variance[0], aid.observation_variance[1]),
        (aid.innovation[0], aid.innovation[1]),
        (aid.innovation_filtered[0], aid.innovation_filtered[1]),
        (aid.innovation_variance[0], aid.innovation_variance[1]),
        (aid.test_ratio[0], aid.test_ratio[1]),
        (aid.test_ratio_filtered[0], aid.test_ratio_filtered[1]),
        aid.innovation_rejected,
        aid.fused,
    )


def record_3d(aid: AidSource, now_us: int, device_id: int = 0) -> EstimatorAidSource3d:
    """What uORB tells of an aid of three axes."""
    return EstimatorAidSource3d(
        now_us,
        aid.timestamp_sample,
        0,
        device_id,
        aid.time_last_fuse,
        (aid.observation[0], aid.observation[1], aid.observation[2]),
        (aid.observation_variance[0], aid.observation_variance[1], aid.observation_variance[2]),
        (aid.innovation[0], aid.innovation[1], aid.innovation[2]),
        (aid.innovation_filtered[0], aid.innovation_filtered[1], aid.innovation_filtered[2]),
        (aid.innovation_variance[0], aid.innovation_variance[1], aid.innovation_variance[2]),
        (aid.test_ratio[0], aid.test_ratio[1], aid.test_ratio[2]),
        (aid.test_ratio_filtered[0], aid.test_ratio_filtered[1], aid.test_ratio_filtered[2]),
        aid.innovation_rejected,
        aid.fused,
    )
