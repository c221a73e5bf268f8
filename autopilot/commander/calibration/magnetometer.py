"""Magnetometer calibration by turning the vehicle, and the quick one by a known heading (PX4's mag_calibration.cpp).

On each side of SENS_MAG_SIDES the vehicle has to be turned; a vehicle that nobody turns ends it. A sphere and then an
ellipsoid through the samples give offset, scale and slant. Less than all sides correct the offset that there is.
"""

import math
from typing import NamedTuple

import numpy as np

from sitl_emu.autopilot.commander.calibration.bench import END_US, TEXT_US, Bench, CancelWatch, Steps, changed
from sitl_emu.autopilot.commander.calibration.lm_fit import Ellipsoid, fit
from sitl_emu.autopilot.commander.calibration.orientation import (
    ALL_SIDES,
    CANCELLED,
    ERROR,
    OK,
    SIDES,
    Outcome,
    each_side,
)
from sitl_emu.autopilot.sensors.sensor_calibration import ONE, ZERO, Corrections, corrected_mag, is_calibrated, raw_mag
from sitl_emu.autopilot.topics import Vector3
from sitl_emu.core.geomagnetism import magnetic_field

SIDE_POINTS = 40
SIDE_US = 7_000_000
DETECTION_INTERVALS = 5
LEAST_TURN_RAD = 0.5
SPHERE_GA = 0.4
"""The field's strength where no GPS tells the place (get_sphere_radius)."""
GPS_US, LEAST_FIX, MOST_EPH_M = 100_000_000, 2, 1000.0
DONE_SIDE_PAUSE_US, END_PAUSE_US = 100_000, 200_000
OFFSET_ALONE_SIDES = 2
"""So few sides tell no scale."""
RADII_GA = (0.2, 0.7)
MOST_OFFSET_GA = 1.3
LEAST_OFFSET_GA, LEAST_SCALE = 0.005, 0.01
"""A smaller change is none (Magnetometer::set_offset, set_scale, set_offdiagonal)."""
FRESH_US = 1_000_000


class Fit(NamedTuple):
    """CAL_MAG0_*OFF, *SCALE and *ODIAG."""

    offset: Vector3
    scale: Vector3
    slant: Vector3


def calibrate(bench: Bench) -> Steps:
    """Write CAL_MAG0_*."""
    bench.started("mag")
    if (yield from _calibrated(bench)):
        yield from bench.sleep(END_PAUSE_US)
        bench.progress(100)
        yield from bench.sleep(TEXT_US)
        return (yield from bench.done("mag"))
    return False


def _calibrated(bench: Bench) -> Steps:
    sides = int(bench.parameters["SENS_MAG_SIDES"])
    asked = [side for side in range(len(SIDES)) if sides >> side & 1]
    for side in range(len(SIDES)):
        if side not in asked:
            bench.info(f"[cal] {SIDES[side]} side done, rotate to a different side")
            yield from bench.sleep(DONE_SIDE_PAUSE_US)
    if is_calibrated(bench.parameters, "MAG") and int(bench.parameters["CAL_MAG0_PRIO"]) == 0:
        bench.critical("Failed: No magnetometer available or enabled")
        return (yield from bench.failed("mag"))
    old = bench.corrections
    updates = sides < ALL_SIDES
    work = _Sides(bench, len(asked), old if updates else Corrections())
    outcome = yield from each_side(bench, sides, work.measure, lenient=True)
    if outcome == CANCELLED:
        yield from bench.sleep(END_US)
        return False
    found = _found(bench, work.points, offset_alone=len(asked) <= OFFSET_ALONE_SIDES) if outcome == OK else None
    if found is None:
        return (yield from bench.failed("mag"))
    before = _kept(old)
    if updates:
        x, y, z = (o + f / s for o, f, s in zip(before.offset, found.offset, before.scale, strict=True))
        found = before._replace(offset=(x, y, z))
    bench.save(
        "MAG",
        OFF=changed(before.offset, found.offset, LEAST_OFFSET_GA),
        SCALE=changed(before.scale, found.scale, LEAST_SCALE),
        ODIAG=changed(before.slant, found.slant, LEAST_SCALE),
    )
    return True


def _kept(old: Corrections) -> Fit:
    """What the parameters say so far; a scale that is none counts as 1 (Magnetometer::set_scale)."""
    if old.mag_matrix is None:
        return Fit(old.mag_offset, ONE, ZERO)
    (a, b, c), (_, d, e), (_, _, f) = old.mag_matrix
    return Fit(old.mag_offset, (a, d, f) if min(a, d, f) > 0.0 else ONE, (b, c, e))


def _sphere_ga(bench: Bench) -> float:
    """How strong the field is at the vehicle's place."""
    gps = bench.topics.sensor_gps
    known = gps.timestamp and bench.now_us - gps.timestamp < GPS_US and gps.fix_type >= LEAST_FIX
    if known and gps.eph < MOST_EPH_M:
        return magnetic_field(gps.latitude_deg, gps.longitude_deg).strength_gauss
    return SPHERE_GA


def _found(bench: Bench, points: list[Vector3], *, offset_alone: bool) -> Fit | None:
    """What brings the points onto a sphere; None, and why, where they lie otherwise."""
    samples = np.array(points, dtype=float).reshape(-1, 3)
    shape, good = fit(samples, Ellipsoid(_sphere_ga(bench), np.zeros(3), np.eye(3)), sphere=True)
    if not good:
        bench.emergency("Retry calibration (unable to fit mag 0)")
        return None
    if not offset_alone:
        shape, _ = fit(samples, shape, sphere=False)
    (x, y, z), matrix = (float(value) for value in shape.offset), shape.matrix
    offset, scale = (x, y, z), (float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[2, 2]))
    slant = float(matrix[0, 1]), float(matrix[0, 2]), float(matrix[1, 2])
    reason = ""
    if not all(map(math.isfinite, (shape.radius, *offset, *scale, *slant))):
        reason = "NaN"
    elif not RADII_GA[0] <= shape.radius <= RADII_GA[1]:
        reason = "invalid radius"
    elif min(scale) <= 0.0:
        reason = "negative scale"
    elif math.hypot(x, y, z) > MOST_OFFSET_GA:
        reason = "large offsets"
    if reason:
        bench.emergency(f"Retry cal mag 0: {reason}")
        return None
    return Fit(offset, scale, slant)


class _Sides:
    """One side after the other; `points` are what was measured, by the corrections that stay."""

    def __init__(self, bench: Bench, sides: int, corrections: Corrections) -> None:
        self._bench, self._sides = bench, sides
        self._corrections = corrections._replace(board=None)
        self.points: list[Vector3] = []
        self._done = 0
        self._told = 0

    def measure(self, side: int) -> Outcome:
        """Turn the vehicle on this side, and sample the field meanwhile; one that nobody turns is sampled too."""
        bench = self._bench
        least_ga = 5.4 * _sphere_ga(bench) / math.sqrt(self._sides * SIDE_POINTS) / 3.0
        bench.info("[cal] Rotate vehicle")
        watch = CancelWatch(bench)
        outcome = yield from self._wait_for_rotation(watch, bench.now_us + DETECTION_INTERVALS * SIDE_US)
        if outcome == CANCELLED:
            return CANCELLED
        deadline_us, taken, seen_us = bench.now_us + SIDE_US, 0, bench.topics.sensor_mag.timestamp
        while bench.now_us < deadline_us and taken < SIDE_POINTS:
            if watch.cancelled():
                return CANCELLED
            yield
            mag = bench.topics.sensor_mag
            if mag.timestamp == seen_us:
                continue
            seen_us = mag.timestamp
            point = corrected_mag(bench.mag(), self._corrections)
            if all(math.dist(point, other) >= least_ga for other in self.points):
                self.points.append(point)
                taken += 1
                self._tell(side, taken)
        if outcome != OK:
            return outcome
        bench.info(f"[cal] {SIDES[side]} side done, rotate to a different side")
        self._done += 1
        yield from bench.sleep(TEXT_US)
        bench.progress(100 * self._done // self._sides)
        return OK

    def _wait_for_rotation(self, watch: CancelWatch, deadline_us: int) -> Outcome:
        bench = self._bench
        turned, last_us = [0.0, 0.0, 0.0], bench.now_us
        while max(map(abs, turned)) < LEAST_TURN_RAD:
            if watch.cancelled():
                return CANCELLED
            heard = yield from bench.next_imu()
            if not heard or bench.now_us > deadline_us:
                bench.critical("Failed: This calibration requires rotation.")
                return ERROR
            dt_s, last_us = (bench.now_us - last_us) * 1e-6, bench.now_us
            turned = [angle + rate * dt_s for angle, rate in zip(turned, bench.gyro(), strict=True)]
        return OK

    def _tell(self, side: int, taken: int) -> None:
        percent = 100 * self._done // self._sides + 100 // self._sides * taken // SIDE_POINTS
        if percent != self._told:
            self._told = percent
            self._bench.info(f"[cal] {SIDES[side]} side calibration: progress <{percent}>")


def calibrate_by_heading(bench: Bench, heading_rad: float, latitude_deg: float, longitude_deg: float) -> Steps:
    """FIXED_MAG_CAL_YAW: write CAL_MAG0_*OFF so that the field is the world's at this heading; NaN place: the GPS's."""
    gps, attitude = bench.topics.sensor_gps, bench.topics.vehicle_attitude
    if not math.isfinite(latitude_deg + longitude_deg) and gps.timestamp and gps.eph < MOST_EPH_M:
        latitude_deg, longitude_deg = gps.latitude_deg, gps.longitude_deg
    if not math.isfinite(latitude_deg + longitude_deg):
        bench.critical("GPS required for mag quick cal")
        return False
    if bench.now_us - attitude.timestamp > FRESH_US:
        bench.critical("attitude required for mag quick cal")
        return False
    bench.info(f"Assuming vehicle is facing heading {math.degrees(heading_rad):.1f} degrees")
    yield from bench.sleep(TEXT_US)
    roll, pitch, _ = attitude.euler
    expected = _in_body(latitude_deg, longitude_deg, roll, pitch, heading_rad)
    old = bench.corrections
    without_offset = raw_mag(expected, old._replace(mag_offset=ZERO))
    x, y, z = (m - e for m, e in zip(bench.mag(), without_offset, strict=True))
    if not math.isfinite(x + y + z):
        bench.critical("[cal] calibration failed: mag")
        return False
    kept = _kept(old)
    offset = changed(kept.offset, (x, y, z), LEAST_OFFSET_GA)
    bench.save("MAG", OFF=offset, SCALE=kept.scale, ODIAG=kept.slant)
    bench.info("Mag quick calibration finished")
    return True


def _in_body(latitude_deg: float, longitude_deg: float, roll: float, pitch: float, yaw: float) -> Vector3:
    """The world's magnetic field in the body frame, gauss."""
    field = magnetic_field(latitude_deg, longitude_deg)
    horizontal = field.strength_gauss * math.cos(field.inclination_rad)
    north, east = horizontal * math.cos(field.declination_rad), horizontal * math.sin(field.declination_rad)
    down = field.strength_gauss * math.sin(field.inclination_rad)
    forward = north * math.cos(yaw) + east * math.sin(yaw)
    right = east * math.cos(yaw) - north * math.sin(yaw)
    x = forward * math.cos(pitch) - down * math.sin(pitch)
    below = forward * math.sin(pitch) + down * math.cos(pitch)
    return x, right * math.cos(roll) + below * math.sin(roll), below * math.cos(roll) - right * math.sin(roll)
