"""Horizontal position from auxiliary sources of global positions: visual navigation, pseudolites and the like.

PX4's EKF2 (EKF/aid_sources/aux_global_position, v1.18). There are four slots. A source fuses in the one that had its id
(EKF2_AGPn_ID) at the start; one with another id is written down in a free slot, and fuses from the next start on. A
source is what uORB has one instance of: a link of MAVLink, whose first id counts, or an id of DDS.
Without any id at the start nobody listens. Altitudes serve only where no origin is known yet, as in PX4.
"""

import math
from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.estimator import covariance as cov
from sitl_emu.autopilot.estimator.aid_source import AidSource
from sitl_emu.autopilot.estimator.ekf import RESET_TIMEOUT_US, Ekf
from sitl_emu.autopilot.estimator.resets import initialise_altitude, is_altitude, reset_to_place
from sitl_emu.autopilot.estimator.samples import AuxiliarySample, ImuSample, SampleBuffer

SLOTS: Final = 4
SENS_EN: Final = 1 << 4
"""The first slot's bit of EKF2_SENS_EN; the others follow."""
DEAD_RECKONING: Final = 1
"""EKF2_AGPn_MODE: reset only where nothing else gives a velocity."""
BUFFER_LENGTH: Final = 20
SILENT_US: Final = 5_000_000
LEAST_NOISE_M: Final = 0.01
MOST_LATITUDE_DEG: Final = 90.0
MOST_LONGITUDE_DEG: Final = 180.0
"""Ekf::checkLatLonValidity."""


class AuxSource:
    """One slot. `active`: it aids."""

    def __init__(self, ekf: Ekf, slot: int) -> None:
        self._ekf, self._prefix, self._sens_en = ekf, f"EKF2_AGP{slot}_", SENS_EN << slot
        self.buffer: SampleBuffer[AuxiliarySample] = SampleBuffer(BUFFER_LENGTH)
        self.aid = AidSource(2)
        self.active = False
        self._resets = 0
        self._pushed_us = 0

    @property
    def intended(self) -> bool:
        """Parameters and commands want it."""
        return self.available and bool(self._ekf.sens_en & self._sens_en)

    @property
    def available(self) -> bool:
        """A parameter wants it."""
        return bool(int(self._value("CTRL")))

    def _value(self, name: str) -> float:
        return self._ekf.settings[self._prefix + name]

    def push(self, now_us: int, sample: AuxiliarySample) -> None:
        """Take in a sample that was measured at `sample.time_us`."""
        late_us = int(self._value("DELAY") * 1000.0)
        self.buffer.push(now_us, sample._replace(time_us=sample.time_us - late_us), 0)
        self._pushed_us = self._ekf.time_us

    def control(self, imu: ImuSample) -> bool:
        """One step of the filter; whether a sample was due."""
        sample = self.buffer.pop(imu.time_us)
        if sample is None:
            if self.active and self._ekf.timed_out(self._pushed_us, SILENT_US):
                self.active = False
            return False
        self._on_sample(sample)
        return True

    def _on_sample(self, sample: AuxiliarySample) -> None:
        ekf = self._ekf
        is_place = abs(sample.lat) <= MOST_LATITUDE_DEG and abs(sample.lon) <= MOST_LONGITUDE_DEG
        if not (self.intended and is_place):
            self.active = False
            return
        self._compare(sample)
        if not ekf.flags.yaw_align or (self.active and ekf.origin is None):
            self.active = False
        elif self.active:
            self._continue(sample)
        else:
            self._start(sample)
        ekf.apply()

    def _compare(self, sample: AuxiliarySample) -> None:
        ekf, state = self._ekf, self._ekf.state
        noise = max(sample.eph if math.isfinite(sample.eph) else 0.0, self._value("NOISE"), LEAST_NOISE_M)
        variance = noise * noise
        place = (state.pn, state.pe) if ekf.origin is None else ekf.origin.project(sample.lat, sample.lon)
        innovation = (state.pn - place[0], state.pe - place[1])
        spread = (ekf.variance(cov.POSITION) + variance, ekf.variance(cov.POSITION + 1) + variance)
        gate = max(self._value("GATE"), 1.0)
        self.aid.update(sample.time_us, (sample.lat, sample.lon), (variance, variance), innovation, spread, gate)

    def _start(self, sample: AuxiliarySample) -> None:
        ekf = self._ekf
        if ekf.origin is None:
            reset_to_place(ekf, sample.lat, sample.lon, self.aid.observation_variance[0])
            if is_altitude(sample.alt):
                initialise_altitude(ekf, sample.alt, sample.epv * sample.epv)
            self.aid.reset(ekf.time_us)
        elif not ekf.fuse_horizontal_position(self.aid):
            if not self._reset_allowed():
                return
            self._reset(sample)
        self._resets, self.active = sample.reset_counter, True

    def _continue(self, sample: AuxiliarySample) -> None:
        ekf = self._ekf
        ekf.fuse_horizontal_position(self.aid)
        if ekf.timed_out(self.aid.time_last_fuse, RESET_TIMEOUT_US) or sample.reset_counter != self._resets:
            if not self._reset_allowed():
                self.active = False
                return
            self._reset(sample)
            self._resets = sample.reset_counter

    def _reset_allowed(self) -> bool:
        ekf, flags = self._ekf, self._ekf.flags
        if int(self._value("MODE")) == DEAD_RECKONING:
            return not ekf.flags.other_horizontal_aid(flags.aux_gpos)
        return ekf.flags.horizontal_position_aids() <= int(flags.aux_gpos)

    def _reset(self, sample: AuxiliarySample) -> None:
        reset_to_place(self._ekf, sample.lat, sample.lon, self.aid.observation_variance[0])
        self.aid.reset(self._ekf.time_us)


class AuxGlobalPosition:
    """All slots that had an id at the start."""

    def __init__(self, ekf: Ekf) -> None:
        self._ekf = ekf
        ids = [int(ekf.settings[f"EKF2_AGP{slot}_ID"]) for slot in range(SLOTS)]
        self._ids = dict(enumerate(ids))
        self._slots: dict[int, int] = {}
        """By instance, from its first sample that finds one."""
        self.sources = {slot: AuxSource(ekf, slot) for slot, number in enumerate(ids) if number}

    def on_sample(
        self, now_us: int, instance: int, number: int, sample: AuxiliarySample, claim: Callable[[str, int], None]
    ) -> None:
        """A position with this id; `claim(parameter, id)` notes whose a free slot is from now on."""
        if instance not in self._slots:
            slot = self._slot_of(number, claim)
            if slot is None:
                return
            self._slots[instance] = slot
        source = self.sources.get(self._slots[instance])
        if source is not None:
            source.push(now_us, sample)

    def _slot_of(self, number: int, claim: Callable[[str, int], None]) -> int | None:
        """The one that has the id, else the first that is free."""
        for slot in range(SLOTS):
            if self._ids[slot] == number:
                return slot
        for slot in range(SLOTS):
            if not self._ids[slot]:
                self._ids[slot] = number
                claim(f"EKF2_AGP{slot}_ID", number)
                return slot
        return None

    def control(self, imu: ImuSample) -> None:
        """One step of the filter: at most one source is fused in it."""
        for source in self.sources.values():
            if source.control(imu):
                break
        self._ekf.flags.aux_gpos = any(source.active for source in self.sources.values())

    def active(self) -> tuple[bool, ...]:
        """Which slots aid."""
        return tuple(slot in self.sources and self.sources[slot].active for slot in range(SLOTS))

    def intended(self) -> tuple[bool, ...]:
        """Which slots are wanted, of those that had an id."""
        return tuple(slot in self.sources and self.sources[slot].intended for slot in range(SLOTS))

    def largest_ratio(self) -> float:
        """Largest filtered test ratio of those that aid."""
        return max((source.aid.largest_ratio() for source in self.sources.values() if source.active), default=0.0)
