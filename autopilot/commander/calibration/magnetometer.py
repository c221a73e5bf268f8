"""Magnetometer calibration by turning the vehicle, and the quick one by a known heading (PX4's mag_calibration.cpp).

On each side of SENS_MAG_SIDES the vehicle has to be turned; a vehicle that nobody turns ends it. The samples are fitted
by an ellipsoid along the axes: offset and scale. (PX4 also fits its slant.)
"""

import math
from collections.abc import Sequence

import numpy as np

from sitl_emu.autopilot.commander.calibration.bench import TEXT_US, Bench, Steps
from sitl_emu.autopilot.commander.calibration.orientation import CANCELLED, ERROR, OK, SIDES, Outcome, each_side
from sitl_emu.autopilot.sensors.sensor_calibration import corrected_mag
from sitl_emu.autopilot.topics import Vector3
from sitl_emu.core.geomagnetism import magnetic_field

POINTS = 240
"""Over all six sides."""
DURATION_US = 42_000_000
DETECTION_INTERVALS = 5
LEAST_TURN_RAD = 0.5
SPHERE_GA = 0.2
END_PAUSE_US = 200_000
LEAST_POINTS = 6
SCALES = (0.1, 3.0)
"""Bounds of CAL_MAGn_XSCALE."""


def calibrate(bench: Bench) -> Steps:
    """Write CAL_MAG0_*."""
    bench.started("mag")
    sides = int(bench.parameters["SENS_MAG_SIDES"])
    points: list[Vector3] = []
    work = _Sides(bench, max(1, sides.bit_count()), points)
    outcome = yield from each_side(bench, sides, work.measure, lenient=True)
    if outcome == CANCELLED:
        yield from bench.sleep(END_PAUSE_US)
        return False
    fit = ellipsoid(points) if outcome == OK else None
    if fit is None:
        return (yield from bench.failed("mag"))
    yield from bench.sleep(END_PAUSE_US)
    bench.save("MAG", OFF=fit[0], SCALE=fit[1], ODIAG=(0.0, 0.0, 0.0))
    bench.progress(100)
    return (yield from bench.done("mag"))


class _Sides:
    """One side after the other."""

    def __init__(self, bench: Bench, sides: int, points: list[Vector3]) -> None:
        self._bench, self._sides, self._points = bench, sides, points
        self._done = 0
        self._told = 0
        self._least_distance_ga = 5.4 * SPHERE_GA / math.sqrt(POINTS) / 3.0

    def measure(self, side: int) -> Outcome:
        """Turn the vehicle on this side, and sample the field meanwhile."""
        bench, interval_us = self._bench, DURATION_US // len(SIDES)
        bench.info("[cal] Rotate vehicle around the detected orientation")
        bench.info(f"[cal] Continue rotation for {SIDES[side]} {interval_us * 1e-6:.1f} s")
        outcome = yield from self._wait_for_rotation(bench.now_us + DETECTION_INTERVALS * interval_us)
        if outcome != OK:
            return outcome
        deadline_us, taken, seen_us = bench.now_us + interval_us, 0, bench.topics.sensor_mag.timestamp
        while bench.now_us < deadline_us and taken < POINTS // len(SIDES):
            if bench.cancelled():
                return CANCELLED
            yield
            mag = bench.topics.sensor_mag
            if mag.timestamp == seen_us:
                continue
            seen_us = mag.timestamp
            point = bench.mag()
            if all(math.dist(point, other) >= self._least_distance_ga for other in self._points):
                self._points.append(point)
                taken += 1
                self._tell(side, taken)
        bench.info(f"[cal] {SIDES[side]} side done, rotate to a different side")
        self._done += 1
        yield from bench.sleep(TEXT_US)
        bench.progress(100 * self._done / self._sides)
        return OK

    def _wait_for_rotation(self, deadline_us: int) -> Outcome:
        bench = self._bench
        turned, last_us = [0.0, 0.0, 0.0], bench.now_us
        while max(map(abs, turned)) < LEAST_TURN_RAD:
            if bench.cancelled():
                return CANCELLED
            heard = yield from bench.next_imu()
            if not heard or bench.now_us > deadline_us:
                bench.critical("Failed: This calibration requires rotation.")
                return ERROR
            dt_s, last_us = (bench.now_us - last_us) * 1e-6, bench.now_us
            turned = [angle + rate * dt_s for angle, rate in zip(turned, bench.gyro(), strict=True)]
        return OK

    def _tell(self, side: int, taken: int) -> None:
        part = 100 // self._sides * taken * len(SIDES) // POINTS
        percent = 100 * self._done // self._sides + part
        if percent > self._told:
            self._told = percent
            self._bench.info(f"[cal] {SIDES[side]} side calibration: progress <{percent}>")


def calibrate_by_heading(bench: Bench, heading_rad: float, latitude_deg: float, longitude_deg: float) -> Steps:
    """FIXED_MAG_CAL_YAW: write CAL_MAG0_*OFF so that the field is the world's at this heading; NaN place: the GPS's."""
    gps = bench.topics.sensor_gps
    if not math.isfinite(latitude_deg + longitude_deg):
        latitude_deg, longitude_deg = gps.latitude_deg, gps.longitude_deg
    if not math.isfinite(latitude_deg + longitude_deg):
        bench.critical("GPS required for mag quick cal")
        return False
    bench.info(f"Assuming vehicle is facing heading {math.degrees(heading_rad):.1f} degrees")
    roll, pitch, _ = bench.topics.vehicle_attitude.euler
    expected = _in_body(latitude_deg, longitude_deg, roll, pitch, heading_rad)
    measured = corrected_mag(bench.mag(), bench.corrections._replace(mag_offset=(0.0, 0.0, 0.0)))
    if not all(map(math.isfinite, measured)):
        return False
    x, y, z = (m - e for m, e in zip(measured, expected, strict=True))
    bench.save("MAG", OFF=(x, y, z))
    yield
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


def ellipsoid(points: Sequence[Vector3]) -> tuple[Vector3, Vector3] | None:
    """(offset, scale) that bring the points onto a sphere, by least squares; None where they lie otherwise."""
    if len(points) < LEAST_POINTS:
        return None
    matrix = np.array([(x * x, y * y, z * z, x, y, z) for x, y, z in points])
    solution, _, rank, _ = np.linalg.lstsq(matrix, np.ones(len(points)), rcond=None)
    squares, linear = solution[:3], solution[3:]
    if rank < LEAST_POINTS or not (squares > 0.0).all():
        return None
    offset = -0.5 * linear / squares
    radii = np.sqrt((1.0 + float(squares @ (offset * offset))) / squares)
    scale = float(np.mean(radii)) / radii
    if not ((scale >= SCALES[0]) & (scale <= SCALES[1])).all():
        return None
    return (float(offset[0]), float(offset[1]), float(offset[2])), (float(scale[0]), float(scale[1]), float(scale[2]))
