"""What an image sensor and its settings are, as plain data: an OV5648's figures are the defaults.

Sources, none of which is copied here:

- OV5648: OmniVision's OV5648 COB data sheet, preliminary 1.1 (1/4 inch, 2592 x 1944); 1.4 µm pixels and a dynamic range
  of 68 dB by a vendor of its modules (cmoscameramodule.com).
- Row time and gain: Rockchip's Linux driver `ov5648.c` (line of 2816 clocks at 84 MHz: 33.5 µs, in the full mode and in
  the 1296 x 972 mode of 30 frames/s alike; gain 1 to 15.5; at least 4 rows of exposure).
- OV5647, its sister of the same pixel: well of 4300 electrons, 36 dB (which is √4300), F2.9: Raspberry Pi's hardware
  specification of camera module 1; automatic exposure to 104 to 120 of 255: its data sheet, registers 0x3A0F, 0x3A10.
"""

from dataclasses import dataclass
from typing import Annotated

from sitl_emu.vehicles.record import Limits

PLAIN, OV5648 = "plain", "ov5648"
SENSORS = (PLAIN, OV5648)
"""By name. Plain: a global shutter without exposure time, as `world/camera.py` has it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageSensor:
    """How light becomes a picture; `world/imaging/` says what each figure does. What has no source above is ours."""

    width_px: Annotated[int, Limits(1, 65535)] = 2592
    height_px: Annotated[int, Limits(1, 65535)] = 1944
    """Of the sensor. A smaller picture sums its pixels up, and so has less noise."""
    well_electrons: Annotated[float, Limits(1.0)] = 4300.0
    """What fills a pixel at gain 1: white."""
    read_noise_electrons: Annotated[float, Limits(0.0)] = 1.7
    """Standard deviation, of a pixel: 4300 over 68 dB."""
    readout_s: Annotated[float, Limits(0.0, 1.0)] = 0.0326
    """From the first row's exposure to the last one's: 972 rows of 33.5 µs. 0: a global shutter."""
    exposure_s: Annotated[float, Limits(0.0, 1.0)] = 0.00033
    """Exposure time that the world's light asks for: the rule of sunny 16 at F2.9 and ISO 100 says 1/3040 s."""
    exposure_min_s: Annotated[float, Limits(0.0, 1.0)] = 0.000134
    """4 rows."""
    exposure_max_s: Annotated[float, Limits(0.0, 1.0)] = 0.0333
    """A frame of 30 a second; what light is wanting beyond it is made up by gain."""
    gain_max: Annotated[float, Limits(1.0, 1000.0)] = 15.5
    auto_exposure: bool = True
    """Exposure time and gain follow the picture, until its mean light is that of `level`."""
    level: Annotated[float, Limits(0.01, 0.99)] = 0.44
    """A figure of the picture, 1 being white: 112 of 255, the middle of 104 to 120."""
    exposure_ev: Annotated[float, Limits(-10.0, 10.0)] = 0.0
    """Stops brighter than the world's light, or than automatic exposure, makes it."""
    follow_s: Annotated[float, Limits(0.0, 60.0)] = 0.0
    """Time constant of automatic exposure. 0: each frame is exposed by itself, whatever came before; ours."""
    white_balance: Annotated[tuple[float, float, float], Limits(0.1, 10.0)] = (1.0, 1.0, 1.0)
    """Gains of red, green and blue. 1: the world's light is already that of the picture."""
    vignetting: Annotated[float, Limits(0.0, 2.0)] = 0.5
    """Share of the cosine-fourth law that the chip's lens correction leaves; ours."""
    blur_px: Annotated[float, Limits(0.0, 5.0)] = 0.6
    """Standard deviation of what lens and colour filter smear; ours."""
    jpeg_quality: Annotated[int, Limits(0, 100)] = 0
    """Of OpenCV's JPEG, 1 to 100, for cameras that send such. 0: none, the OV5648 sends raw pictures."""


def named(name: str) -> ImageSensor | None:
    """The sensor of a name in SENSORS; None for the plain one."""
    return ImageSensor() if name == OV5648 else None
