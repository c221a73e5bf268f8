"""From a drawn picture to what the sensor sends: a pure function of picture, motion, settings, camera, time and zoom.

In this order, as on the way of the light: motion blur, rolling shutter and lens, what lens and colour filter smear,
vignetting, exposure with shot and read noise, white balance, the tone curve, JPEG.
"""

import math
import zlib
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from sitl_emu.vehicles.image_sensor import ImageSensor
from sitl_emu.world.imaging import exposure, pixels
from sitl_emu.world.imaging.motion import Drift, farthest_px, ways
from sitl_emu.world.lens import Intrinsics, source_of, zoomed_source

Image = npt.NDArray[np.uint8]
MARGIN_RATE_RAD_S = 1.0
"""So fast a camera can turn before its rows look past the edge of what is drawn, and the edge is repeated; ours. One
that has zoomed can turn less fast by the zoom."""
UNSEEN_PX = 0.05
"""A shift that is not worth a pass over the picture."""
BLUR_BORDER_PX = 24
"""The longest blur is twice as long: a longer one is cut."""
VALUES = 3
"""Blue, green and red."""
CLEAR_OF_COLOUR = 4.0
"""One of four pixels of a Bayer sensor sees red, one blue; green, with two, is taken as one of them."""


class Rays(NamedTuple):
    """Where the pixels of a picture look."""

    x: npt.NDArray[np.float32]
    y: npt.NDArray[np.float32]
    """(height, width): in focal lengths, right and down of the optical axis."""
    corner: float
    """Of the farthest off the axis."""
    focal_px: npt.NDArray[np.float32]
    """(1,): of the picture that is drawn for it."""


def rays_of(
    map_x: npt.NDArray[np.float32], map_y: npt.NDArray[np.float32], size: tuple[int, int], focal: float
) -> Rays:
    """From where each pixel comes from in a drawn picture of a size (width, height)."""
    by_focal = np.float32(1.0 / focal)
    x = (map_x - np.float32((size[0] - 1) / 2.0)) * by_focal
    y = (map_y - np.float32((size[1] - 1) / 2.0)) * by_focal
    corner = math.sqrt(float((x.astype(np.float64) ** 2 + y.astype(np.float64) ** 2).max()))
    return Rays(x, y, corner, np.array((focal,), np.float32))


class Imager:
    """One camera's sensor. `source`: (width, height) of the picture to be drawn for it. Raises LensError."""

    def __init__(self, intrinsics: Intrinsics, sensor: ImageSensor, seed: int, name: str) -> None:
        self.sensor, self._key = sensor, [seed, zlib.crc32(name.encode())]
        width, height = self._size = intrinsics.width, intrinsics.height
        focal = intrinsics.focal_px
        margin = 8 * math.ceil(MARGIN_RATE_RAD_S * 0.5 * sensor.readout_s * focal / 8.0)
        rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)
        if any(intrinsics.distortion):
            lens = source_of(intrinsics)
            drawn = lens.width, lens.height
            map_x, map_y = lens.map_x, lens.map_y
        else:
            drawn, map_x, map_y = (width, height), columns, rows
        self.source: tuple[int, int] = (drawn[0] + 2 * margin, drawn[1] + 2 * margin)
        self._has_lens = any(intrinsics.distortion)
        self._intrinsics, self._margin, self._unzoomed = intrinsics, margin, rays_of(map_x, map_y, drawn, focal)
        self._lens_size, self._zoomed = drawn, (1.0, self._unzoomed)
        self._middle = np.array(((self.source[0] - 1) / 2.0, (self.source[1] - 1) / 2.0), np.float32)
        off_axis2 = self._unzoomed.x.astype(np.float64) ** 2 + self._unzoomed.y.astype(np.float64) ** 2
        falloff = (1.0 + off_axis2) ** (-2.0 * sensor.vignetting)
        self._mean_falloff = float(falloff.mean())
        balance = np.array(sensor.white_balance[::-1])
        self._gains = (np.repeat(falloff, VALUES, axis=1) * np.tile(balance, width) / 255.0**2).astype(np.float32)
        self._balance = np.tile(balance, width)
        # As many of the sensor's pixels make one figure of the picture.
        self._summed = max(sensor.width_px * sensor.height_px / (width * height) / CLEAR_OF_COLOUR, 1.0)
        self._row_times_s = (np.arange(height) / max(height - 1, 1) - 0.5) * sensor.readout_s
        self._map_x, self._map_y = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
        self._light: tuple[int, float] | None = None

    def focal(self, zoom: float) -> float:
        """That of the picture to be drawn for it, over the camera's own at no zoom."""
        if not self._has_lens or zoom == 1.0:
            return zoom
        return zoomed_source(self._intrinsics, zoom, self._lens_size)[0]

    def _rays(self, zoom: float) -> Rays:
        if zoom == 1.0:
            return self._unzoomed
        if zoom != self._zoomed[0]:
            self._zoomed = zoom, self._rays_at(zoom)
        return self._zoomed[1]

    def _rays_at(self, zoom: float) -> Rays:
        if self._has_lens:
            focal, (_, _, map_x, map_y) = zoomed_source(self._intrinsics, zoom, self._lens_size)
            return rays_of(map_x, map_y, self._lens_size, focal * self._intrinsics.focal_px)
        x, y, corner, focal_px = self._unzoomed
        by_zoom = np.float32(1.0 / zoom)
        return Rays(x * by_zoom, y * by_zoom, corner / zoom, focal_px * np.float32(zoom))

    def picture(self, drawn: Image, moving: Drift, time_us: int, zoom: float = 1.0) -> Image:
        """What the sensor sends of a drawn picture of `source` size: (height, width, 3) uint8 BGR.

        With a `follow_s` above 0 it is also a function of the frames asked for before.
        """
        sensor = self.sensor
        shot = exposure.exposed(sensor, self._wanted(drawn, time_us))
        rays = self._rays(zoom)
        picture = self._on_chip(self._smeared(drawn, moving, shot.time_s, rays), moving, rays)
        if sensor.blur_px > 0.0:
            side = 2 * math.ceil(1.5 * sensor.blur_px) + 1
            picture = np.asarray(cv2.GaussianBlur(picture, (side, side), sensor.blur_px), np.uint8)
        picture = self._exposed(picture, shot, time_us)
        if sensor.jpeg_quality:
            _, sent = cv2.imencode(".jpg", picture, (cv2.IMWRITE_JPEG_QUALITY, sensor.jpeg_quality))
            picture = np.asarray(cv2.imdecode(sent, cv2.IMREAD_COLOR), np.uint8)
        return picture

    def _wanted(self, drawn: Image, time_us: int) -> float:
        light = exposure.wanted(self.sensor, drawn, self._mean_falloff)
        if self._light is not None:
            before_us, before = self._light
            light = exposure.followed(before, light, (time_us - before_us) * 1e-6, self.sensor.follow_s)
        self._light = time_us, light
        return light

    def _smeared(self, drawn: Image, moving: Drift, exposure_s: float, rays: Rays) -> Image:
        if farthest_px(moving, exposure_s, float(rays.focal_px[0]), rays.corner) <= 1.0:
            return drawn
        both = ways(moving, np.array((-0.5 * exposure_s, 0.5 * exposure_s)))
        edge, (height, width) = BLUR_BORDER_PX, drawn.shape[:2]
        padded = cv2.copyMakeBorder(drawn, edge, edge, edge, edge, cv2.BORDER_REPLICATE)
        smeared = np.empty((height, VALUES * width), np.uint8)
        flat = np.asarray(padded, np.uint8).reshape(height + 2 * edge, -1)
        pixels.smear(flat, both, rays.focal_px, edge, np.empty(VALUES * pixels.BLOCK, np.float32), smeared)
        return smeared.reshape(drawn.shape)

    def _on_chip(self, drawn: Image, moving: Drift, rays: Rays) -> Image:
        """Each row at its own time, through the lens."""
        reach_px = farthest_px(moving, 0.5 * self.sensor.readout_s, float(rays.focal_px[0]), rays.corner)
        if not self._has_lens and reach_px < UNSEEN_PX:
            edge, (width, height) = self._margin, self._size
            return drawn[edge : edge + height, edge : edge + width]
        by_row = ways(moving, self._row_times_s)
        pixels.look_back(rays.x, rays.y, by_row, rays.focal_px, self._middle, self._map_x, self._map_y)
        taken = cv2.remap(drawn, self._map_x, self._map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(taken, np.uint8)

    def _exposed(self, picture: Image, shot: exposure.Exposure, time_us: int) -> Image:
        height, width = picture.shape[:2]
        white = self.sensor.well_electrons * self._summed / shot.gain
        dark = self.sensor.read_noise_electrons * math.sqrt(self._summed) / white
        by_light = (self._balance / white / pixels.BYTES_SIGMA**2).astype(np.float32)
        by_itself = ((self._balance * dark) ** 2 / pixels.BYTES_SIGMA**2).astype(np.float32)
        light = np.array((shot.light,), np.float32)
        key = np.uint32(np.random.SeedSequence([*self._key, time_us]).generate_state(1)[0])
        exposed = np.empty((height, VALUES * width), np.uint8)
        flat = np.ascontiguousarray(picture).reshape(height, VALUES * width)
        pixels.expose(flat, self._gains, light, by_light, by_itself, key, exposed)
        return exposed.reshape(height, width, VALUES)
