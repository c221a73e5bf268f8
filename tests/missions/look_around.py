"""A mission for tests: an m600 whose camera hangs on its gimbal looks around in examples/own_world."""

import json
from collections.abc import Sequence
from pathlib import Path

import cv2

from sitl_emu.companion import (
    AUTOPILOT_LINK,
    Camera,
    Companion,
    Detection,
    GimbalManager,
    Onboard,
    Outgoing,
    Script,
    Scripted,
    mavlink,
    set_mode,
    steps,
)
from sitl_emu.gcs.ftp import FtpGet
from sitl_emu.mission import Mission, Options, Program

LOOKS = ((-90.0, 0.0), (-30.0, 0.0), (-30.0, 40.0))
"""Pitch and yaw against the heading, in degrees, one after the other."""
ZOOM_PERCENT = 50.0
"""Of the camera's range, at the end."""
OURS = 191


class LookAround(Scripted):
    """Takes off, points the gimbal, keeps the frames that it sees then, and has pictures taken by MAVLink."""

    def __init__(self, folder: Path) -> None:
        super().__init__(self._look)
        self._folder, self._wanted = folder, False
        self._gimbal: GimbalManager | None = None
        self._heads: dict[int, object] = {}

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """The gimbal's manager hears all."""
        if self._gimbal is not None and link == AUTOPILOT_LINK:
            self._gimbal.on_message(now_us, msg)
            self._camera.on_message(now_us, msg)
        return super().on_message(now_us, link, msg)

    def wants_frame(self, frame_time_us: int) -> float | None:
        """Those that are to be kept; where it thinks that the gimbal looks, is kept beside."""
        pose = self.onboard.telemetry.pose_at(frame_time_us)
        if not self._wanted or pose is None:
            return None
        self._heads[frame_time_us] = self.onboard.telemetry.gimbal_at(frame_time_us, pose.yaw_rad)
        self._wanted = False
        return 0.0

    def detect(self, image: object, gsd_m: float) -> Sequence[Detection]:
        """Keeps the frame."""
        cv2.imwrite(str(self._folder / f"{max(self._heads)}.png"), image)
        return ()

    def _look(self, onboard: Onboard) -> Script:
        yield from steps.heard(onboard)
        self._gimbal = gimbal = GimbalManager(onboard.system_id)
        self._camera = Camera(onboard.system_id)
        yield from steps.ready(onboard, timeout_s=120.0)
        yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
        yield from steps.arm(onboard)
        onboard.yielding.expect({"takeoff", "hold"})
        yield from steps.pause(onboard, 60.0, until=lambda: onboard.telemetry.mode == "hold")
        camera = self._camera
        yield from steps.command(onboard, gimbal.take_control(onboard.system_id, OURS), "gimbal control")
        for pitch_deg, yaw_deg in LOOKS:
            yield from steps.command(onboard, gimbal.point(pitch_deg, yaw_deg), "gimbal")
            yield from steps.pause(onboard, 2.0)
            self._wanted = True
            yield from steps.command(onboard, camera.take_image(), "picture")
            yield from steps.pause(onboard, 1.0)
        yield from steps.command(onboard, gimbal.point(-90.0, 0.0), "gimbal")
        yield from steps.pause(onboard, 0.2)
        self._wanted = True  # one on its way back, at 90 degrees a second
        yield from steps.pause(onboard, 1.5)
        yield from steps.command(onboard, camera.zoom_to(ZOOM_PERCENT), "zoom")
        yield from steps.pause(onboard, 0.5)
        self._wanted = True
        yield from steps.command(onboard, camera.take_image(), "picture")
        yield from steps.pause(onboard, 1.0)
        for index, image in sorted(camera.images.items()):
            place = {"lat": image.lat, "lon": image.lon}
            onboard.note("picture", image.file_url, index=index, time_us=image.time_boot_ms * 1000, **place)
        fetched = yield from onboard.do(AUTOPILOT_LINK, FtpGet(onboard.system_id, "/camera/IMG_0002.jpg"))
        (self._folder / "fetched.jpg").write_bytes(fetched.content)
        (self._folder / "heads.json").write_text(json.dumps(self._heads))


def program(options: Options) -> Companion:
    """The companion."""
    return LookAround(Path(options.text("folder")))


MISSION = Mission(programs={"look-around": Program(program)})
