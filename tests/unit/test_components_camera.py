"""The camera of a vehicle: MAVLink's camera protocol v2 as transcripts on simulated time."""

import dataclasses
import itertools
import math
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.components.camera import Camera
from sitl_emu.components.geotag import Geotag
from sitl_emu.components.image_capture import PictureFiles
from sitl_emu.components.video_stream import VideoStream
from sitl_emu.core import dialect as mavlink
from sitl_emu.vehicles.description import Camera as CameraData
from tests.typed import present

from .mavlink_peer import Peer, names, only

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
REQUEST_MESSAGE, IMAGE_START, IMAGE_STOP, VIDEO_START, VIDEO_STOP = 512, 2000, 2001, 2500, 2501
SET_MODE, SET_ZOOM, SET_FOCUS, RESET, FORMAT = 530, 531, 532, 529, 526
STREAM_START, STREAM_STOP = 2502, 2503
CAMERA = 100
DATA = dataclasses.replace(present(vehicles.load("m600").camera), mount="nadir")
assert DATA is not None


class Rig(Peer):
    """An autopilot with a camera on a wire, and a ground station on its first link."""

    def __init__(
        self, data: CameraData = DATA, card: PictureFiles | None = None, video: VideoStream | None = None
    ) -> None:
        super().__init__()
        self.camera = Camera(data, system_id=1, card=card, video=video)
        self.mavlink.plug_in("camera", "wire", self.camera)
        self.now_us = 4_000
        self.fly()
        self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        self.run(0.1)

    def ask(
        self, number: int, *params: float, target: tuple[int, int] = (1, CAMERA), confirmation: int = 0
    ) -> tuple[int | None, list[Any]]:
        """The camera's result, and what else it said."""
        padded = params + (0.0,) * (7 - len(params))
        said = [
            message
            for message in self.send(mavlink.MAVLink_command_long_message(*target, number, confirmation, *padded))
            if message.get_srcComponent() == CAMERA
        ]
        acks = only(said, "COMMAND_ACK")
        return acks[0].result if acks else None, [message for message in said if message not in acks]


def test_a_camera_beats_as_component_100() -> None:
    rig = Rig()
    beats = [m for m in only(rig.run(3.0), "HEARTBEAT") if m.get_srcComponent() == CAMERA]
    assert len(beats) == 3
    assert {(m.type, m.autopilot) for m in beats} == {(mavlink.MAV_TYPE_CAMERA, mavlink.MAV_AUTOPILOT_INVALID)}


@pytest.mark.parametrize(
    ("message_id", "name"),
    [
        (259, "CAMERA_INFORMATION"),
        (260, "CAMERA_SETTINGS"),
        (261, "STORAGE_INFORMATION"),
        (262, "CAMERA_CAPTURE_STATUS"),
        (269, "VIDEO_STREAM_INFORMATION"),
        (270, "VIDEO_STREAM_STATUS"),
        (271, "CAMERA_FOV_STATUS"),
    ],
)
def test_what_is_asked_for_is_acknowledged_and_sent(message_id: int, name: str) -> None:
    result, said = Rig(video=VideoStream(5600)).ask(REQUEST_MESSAGE, message_id)
    assert (result, names(said)) == (ACCEPTED, [name])


@pytest.mark.parametrize(("command", "params", "name"), [
    (521, (1,), "CAMERA_INFORMATION"),
    (522, (1,), "CAMERA_SETTINGS"),
    (525, (0, 1), "STORAGE_INFORMATION"),
    (527, (1,), "CAMERA_CAPTURE_STATUS"),
    (2504, (1,), "VIDEO_STREAM_INFORMATION"),
    (2505, (1,), "VIDEO_STREAM_STATUS"),
])  # fmt: skip
def test_the_old_requests_work_too(command: int, params: tuple[float, ...], name: str) -> None:
    result, said = Rig(video=VideoStream(5600)).ask(command, *params)
    assert (result, names(said)) == (ACCEPTED, [name])


def test_the_data_of_the_vehicle_are_told() -> None:
    _, (information,) = Rig().ask(REQUEST_MESSAGE, 259)
    assert (information.resolution_h, information.resolution_v) == (640, 480)
    assert information.focal_length == pytest.approx(3.2)
    assert information.flags & mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM
    assert bytes(information.vendor_name).rstrip(b"\0") == b"sitl-emu"


class FakeCard:
    """Keeps what it was told."""

    def __init__(self) -> None:
        self.last, self.tagged = 6, list[tuple[int, Geotag, int]]()

    def next_number(self) -> int:
        self.last += 1
        return self.last

    def url(self, number: int) -> bytes:
        return f"mftp://[;comp=1]/camera/{number}.jpg".encode()

    def tag(self, number: int, tag: Geotag, utc_us: int) -> None:
        self.tagged.append((number, tag, utc_us))


def test_where_pictures_are_drawn_an_image_is_told_when_its_file_is_there() -> None:
    card = FakeCard()
    rig = Rig(card=card)
    result, said = rig.ask(IMAGE_START, 0, 0, 1, 1)
    assert result == ACCEPTED and names(said) == [] and rig.camera.triggers == [7]
    assert not only(rig.run(2.0), "CAMERA_IMAGE_CAPTURED") and not card.tagged
    rig.camera.picture_taken(rig.now_us, 7, True)
    (image,) = only(rig.run(0.1), "CAMERA_IMAGE_CAPTURED")
    assert (image.image_index, image.capture_result, image.file_url) == (0, 1, "mftp://[;comp=1]/camera/7.jpg")
    ((number, tag, utc_us),) = card.tagged
    assert number == 7 and (tag.lat, tag.lon, tag.alt) == (image.lat, image.lon, image.alt) and utc_us == image.time_utc
    assert tag.lat == round(rig.topics.vehicle_global_position.lat * 1e7)


def test_a_picture_may_be_there_before_the_autopilot_has_said_where_it_was_taken() -> None:
    card = FakeCard()
    camera = Camera(DATA, 1, card=card)
    wire: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    start = mavlink.MAVLink_command_long_message(1, CAMERA, IMAGE_START, 0, 0, 0, 1, 1, 0, 0, 0)
    camera.on_datagram(1000, bytes(start.pack(wire)))
    camera.picture_taken(2000, 7, True)
    camera.picture_taken(2000, 5, True)  # of before a reboot
    assert not card.tagged
    camera.on_time(300_000)
    assert [number for number, _, _ in card.tagged] == [7], "no geotag came, so there is none"


def test_a_picture_that_could_not_be_drawn_is_no_file() -> None:
    card = FakeCard()
    rig = Rig(card=card)
    rig.ask(IMAGE_START, 0, 0, 1, 1)
    rig.run(0.5)
    rig.camera.picture_taken(rig.now_us, 7, False)
    (image,) = only(rig.run(0.1), "CAMERA_IMAGE_CAPTURED")
    assert (image.capture_result, image.file_url, card.tagged) == (0, "", [])


def test_a_series_gives_each_picture_a_number_and_tells_them_in_order() -> None:
    card = FakeCard()
    rig = Rig(card=card)
    rig.ask(IMAGE_START, 0, 0.5, 3, 1)
    rig.run(2.0)
    assert rig.camera.triggers == [7, 8, 9]
    for number in rig.camera.triggers:
        rig.camera.picture_taken(rig.now_us, number, True)
    told = only(rig.run(0.1), "CAMERA_IMAGE_CAPTURED")
    assert [image.image_index for image in told] == [0, 1, 2] and [each[0] for each in card.tagged] == [7, 8, 9]


def test_one_image_is_tagged_with_where_the_autopilot_is() -> None:
    rig = Rig()
    result, (image,) = rig.ask(IMAGE_START, 0, 0, 1, 1)
    assert result == ACCEPTED
    assert (image.image_index, image.capture_result) == (0, 1)
    assert image.lat == round(rig.topics.vehicle_global_position.lat * 1e7)
    assert image.lon == round(rig.topics.vehicle_global_position.lon * 1e7)
    # straight down: the camera's forward axis points down, whatever the heading
    w, x, y, z = image.q
    assert 2.0 * (w * y - z * x) == pytest.approx(-1.0, abs=1e-3)
    _, (status,) = rig.ask(REQUEST_MESSAGE, 262)
    assert (status.image_count, status.image_status) == (1, 0)


def test_a_command_that_is_sent_again_takes_no_second_image() -> None:
    """MAVSDK sends it four times in 1.5 s, each as the first; gcs.command.Command counts its confirmation up."""
    rig = Rig()
    rig.ask(IMAGE_START, 0, 0, 1, 7)
    for _ in range(3):
        rig.run(0.5)
        assert rig.ask(IMAGE_START, 0, 0, 1, 7) == (ACCEPTED, [])
    rig.run(60.0)
    assert rig.ask(IMAGE_START, 0, 0, 1, 7, confirmation=1) == (ACCEPTED, [])
    rig.run(1.0)
    rig.fly()
    result, said = rig.ask(IMAGE_START, 0, 0, 1, 8)
    assert (result, [m.image_index for m in said]) == (ACCEPTED, [1])


def test_a_client_s_next_run_takes_an_image_though_it_counts_from_1_again() -> None:
    rig = Rig()
    for index in range(2):
        rig.fly()
        result, said = rig.ask(IMAGE_START, 0, 0, 1, 1)
        assert (result, [m.image_index for m in said]) == (ACCEPTED, [index])
        rig.run(2.0)


def test_a_series_has_its_count_and_interval() -> None:
    rig = Rig()
    rig.ask(IMAGE_START, 0, 0.5, 4)
    rig.run(0.1)
    assert rig.ask(IMAGE_START, 0, 0, 1, 1)[0] == TEMPORARILY_REJECTED
    _, (status,) = rig.ask(REQUEST_MESSAGE, 262)
    assert (status.image_status, status.image_interval) == (2, 0.5)
    images = only(rig.run(5.0), "CAMERA_IMAGE_CAPTURED")
    assert [image.image_index for image in images] == [1, 2, 3]
    times = [image.time_boot_ms for image in images]
    assert [later - earlier for earlier, later in itertools.pairwise(times)] == [500, 500]


def test_an_endless_series_ends_when_it_is_stopped() -> None:
    rig = Rig()
    rig.ask(IMAGE_START, 0, 1.0, 0)
    assert len(only(rig.run(3.2), "CAMERA_IMAGE_CAPTURED")) == 3
    result, said = rig.ask(IMAGE_STOP)
    assert (result, said[0].image_status, said[0].image_count) == (ACCEPTED, 0, 4)
    assert not only(rig.run(3.0), "CAMERA_IMAGE_CAPTURED")


def test_a_record_can_be_asked_for_again() -> None:
    rig = Rig()
    rig.ask(IMAGE_START, 0, 0.5, 3)
    rig.run(3.0)
    result, (image,) = rig.ask(REQUEST_MESSAGE, 263, 1)
    assert (result, image.image_index) == (ACCEPTED, 1)
    assert rig.ask(REQUEST_MESSAGE, 263, 3) == (DENIED, [])
    assert rig.ask(2002, 2)[1][0].image_index == 2


def test_an_autopilot_that_does_not_answer_leaves_the_image_without_a_place() -> None:
    camera = Camera(DATA, system_id=1)
    camera.on_time(0)
    camera.outbox.clear()
    encoder = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    start = mavlink.MAVLink_command_long_message(1, CAMERA, IMAGE_START, 0, 0, 0, 1, 1, 0, 0, 0)
    camera.on_datagram(1000, bytes(start.pack(encoder)))
    camera.outbox.clear()
    camera.on_time(500_000)
    decoder = mavlink.MAVLink(None)
    said = [message for data in camera.outbox for message in decoder.parse_buffer(data) or []]
    assert [(m.lat, m.lon) for m in only(said, "CAMERA_IMAGE_CAPTURED")] == [(0, 0)]


def test_a_series_tells_when_it_begins_and_when_it_is_stopped() -> None:
    rig = Rig()
    begun = only(rig.ask(IMAGE_START, 0, 1.0, 0)[1], "CAMERA_CAPTURE_STATUS")
    assert [status.image_status & 2 for status in begun] == [2]
    assert [status.image_interval for status in begun] == [1.0]
    rig.run(2.5)
    stopped = only(rig.ask(IMAGE_STOP)[1], "CAMERA_CAPTURE_STATUS")
    assert [(status.image_status, status.image_count) for status in stopped] == [(0, 3)]


def test_a_series_or_video_that_is_asked_for_again_as_its_ack_was_lost_goes_on() -> None:
    rig = Rig()
    rig.ask(SET_MODE, 0, 1)
    for start, params, others in (
        (IMAGE_START, (0, 1.0, 3), (0, 1.0, 4)),
        (VIDEO_START, (0, math.nan), (0, 2.0)),
    ):
        assert rig.ask(start, *params)[0] == ACCEPTED
        rig.run(0.5)
        assert rig.ask(start, *params)[0] == ACCEPTED
        assert rig.ask(start, *others)[0] == TEMPORARILY_REJECTED, "another one"
        rig.encoder.srcSystem = 254
        assert rig.ask(start, *params)[0] == TEMPORARILY_REJECTED, "somebody else's"
        rig.encoder.srcSystem = 255
    rig.run(4.0)
    _, (status,) = rig.ask(REQUEST_MESSAGE, 262)
    assert (status.image_count, status.video_status) == (3, 1)
    assert status.recording_time_ms == pytest.approx(4500, abs=50), "since it was asked for first"


def test_a_series_that_was_stopped_begins_anew_by_the_same_command() -> None:
    rig = Rig()
    rig.ask(IMAGE_START, 0, 0.5, 0)
    rig.run(1.2)
    rig.ask(IMAGE_STOP)
    rig.run(0.5)
    assert rig.ask(IMAGE_START, 0, 0.5, 0)[0] == ACCEPTED
    assert len(only(rig.run(1.2), "CAMERA_IMAGE_CAPTURED")) >= 2


def test_video_wants_its_mode_and_fills_the_storage() -> None:
    rig = Rig()
    assert rig.ask(VIDEO_START)[0] == DENIED
    result, (settings,) = rig.ask(SET_MODE, 0, 1)
    assert (result, settings.mode_id) == (ACCEPTED, 1)
    assert rig.ask(VIDEO_START, 0, 2.0)[0] == ACCEPTED
    statuses = only(rig.run(5.0), "CAMERA_CAPTURE_STATUS")
    assert len(statuses) in (10, 11)
    assert statuses[-1].recording_time_ms == pytest.approx(4500, abs=600)
    assert rig.ask(SET_MODE, 0, 0)[0] == TEMPORARILY_REJECTED
    assert rig.ask(VIDEO_STOP)[1][0].video_status == 0
    _, (storage,) = rig.ask(REQUEST_MESSAGE, 261)
    assert storage.used_capacity == pytest.approx(5.0 * DATA.video_mib_s, abs=0.1)


def test_a_video_ends_when_the_storage_is_full_and_leaves_no_room_for_images() -> None:
    rig = Rig(dataclasses.replace(DATA, storage_mib=10.0, image_mib=4.0, video_mib_s=2.0))
    rig.ask(SET_MODE, 0, 1)
    assert rig.ask(VIDEO_START)[0] == ACCEPTED
    rig.run(3.5)
    assert rig.ask(IMAGE_START, 0, 0, 1)[0] == FAILED, "3 MiB are left"
    (ended,) = only(rig.run(3.0), "CAMERA_CAPTURE_STATUS")
    assert (ended.video_status, ended.available_capacity) == (0, 0.0)
    assert rig.ask(VIDEO_START)[0] == FAILED
    assert rig.ask(REQUEST_MESSAGE, 261)[1][0].used_capacity == pytest.approx(10.0)


def test_a_stream_is_announced_as_it_is() -> None:
    rig = Rig(video=VideoStream(5603))
    (information,) = rig.ask(REQUEST_MESSAGE, 259)[1]
    assert information.flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    for stream in (0, 1):
        (told,) = rig.ask(REQUEST_MESSAGE, 269, stream)[1]
        assert (told.stream_id, told.count, told.type, told.uri, told.encoding) == (1, 1, 1, "5603", 1)
        assert (told.resolution_h, told.resolution_v, told.framerate) == (640, 480, 15.0)
        assert (told.flags, told.bitrate, told.hfov, told.rotation) == (1, 2_000_000, 90, 0)
    assert rig.ask(REQUEST_MESSAGE, 269, 2)[0] == DENIED
    rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_RANGE, 100.0)
    for message_id in (269, 270):
        assert rig.ask(REQUEST_MESSAGE, message_id, 1)[1][0].hfov == 28, "4 times the focal length"
    assert rig.ask(REQUEST_MESSAGE, 271)[1][0].hfov == pytest.approx(28.07, abs=0.01)
    rig.ask(RESET, 1)
    assert rig.ask(REQUEST_MESSAGE, 269, 1)[1][0].hfov == 90


def test_a_stream_runs_until_it_is_stopped_and_that_is_told() -> None:
    video = VideoStream(5600)
    rig = Rig(video=video)
    for command, running in ((STREAM_STOP, False), (STREAM_STOP, False), (STREAM_START, True)):
        result, said = rig.ask(command, 1)
        assert (result, names(said), video.running) == (ACCEPTED, ["VIDEO_STREAM_STATUS"], running)
        (status,) = rig.ask(REQUEST_MESSAGE, 270, 1)[1]
        assert status.flags == said[0].flags == int(running)
    assert rig.ask(STREAM_STOP, 2)[0] == DENIED and video.running
    assert rig.ask(STREAM_STOP, 0)[0] == ACCEPTED and not video.running, "0: all"


def test_a_camera_without_a_stream_says_so() -> None:
    rig = Rig()
    (information,) = rig.ask(REQUEST_MESSAGE, 259)[1]
    assert not information.flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    assert [rig.ask(REQUEST_MESSAGE, message_id, 1) for message_id in (269, 270)] == [(DENIED, [])] * 2
    assert [rig.ask(command, 1) for command in (STREAM_START, STREAM_STOP)] == [(UNSUPPORTED, [])] * 2


def test_zoom_focus_and_reset() -> None:
    rig = Rig()
    assert rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_RANGE, 40.0)[1][0].zoomLevel == 40.0
    assert rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_STEP, 1.0)[1][0].zoomLevel == 50.0
    rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_CONTINUOUS, -1.0)
    rig.run(1.0)
    assert rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_CONTINUOUS, 0.0)[1][0].zoomLevel == pytest.approx(30.0, abs=0.5)
    rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_CONTINUOUS, 1.0)
    assert rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_FOCAL_LENGTH, 10.0)[0] == DENIED
    rig.run(1.0)
    assert rig.ask(REQUEST_MESSAGE, 260)[1][0].zoomLevel == pytest.approx(50.0, abs=1.0), "it goes on"
    rig.run(10.0)
    assert rig.ask(REQUEST_MESSAGE, 260)[1][0].zoomLevel == 100.0
    assert rig.ask(SET_FOCUS, mavlink.FOCUS_TYPE_RANGE, 70.0)[1][0].focusLevel == 70.0
    assert rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_RANGE, math.nan)[0] == DENIED
    settings = rig.ask(RESET, 1)[1][0]
    assert (settings.mode_id, settings.zoomLevel, settings.focusLevel) == (0, 0.0, 0.0)


def test_focus_goes_by_steps_and_until_it_is_stopped_as_zoom_does() -> None:
    rig = Rig()

    def focus(kind: int, value: float) -> float:
        result, (settings,) = rig.ask(SET_FOCUS, kind, value)
        assert (result, settings.zoomLevel) == (ACCEPTED, 0.0)
        return float(settings.focusLevel)

    assert focus(mavlink.FOCUS_TYPE_STEP, 1.0) == 10.0
    assert focus(mavlink.FOCUS_TYPE_CONTINUOUS, 1.0) == 10.0
    rig.run(1.0)
    assert focus(mavlink.FOCUS_TYPE_CONTINUOUS, 0.0) == pytest.approx(30.0, abs=0.5)
    focus(mavlink.FOCUS_TYPE_CONTINUOUS, -1.0)
    rig.run(0.5)
    assert focus(mavlink.FOCUS_TYPE_AUTO, 0.0) == pytest.approx(20.0, abs=0.5), "which ends it"
    rig.run(5.0)
    assert focus(mavlink.FOCUS_TYPE_STEP, -1.0) == pytest.approx(10.0, abs=0.5)
    assert rig.ask(SET_FOCUS, mavlink.FOCUS_TYPE_METERS, 3.0)[0] == DENIED
    assert rig.ask(SET_FOCUS, mavlink.FOCUS_TYPE_CONTINUOUS, math.nan)[0] == DENIED


def test_a_camera_without_zoom_says_so() -> None:
    data = vehicles.load("iris").camera
    assert data is not None
    rig = Rig(data)
    assert rig.ask(SET_ZOOM, mavlink.ZOOM_TYPE_RANGE, 40.0)[0] == UNSUPPORTED
    assert math.isnan(rig.ask(REQUEST_MESSAGE, 260)[1][0].zoomLevel)


def test_a_full_storage_takes_no_more_images_until_it_is_formatted() -> None:
    data = CameraData("a", "b", "nadir", 3.2, 6.4, 4.8, 640, 480, 15.0, 1.0, 0.6, 1.0, 0.2)
    rig = Rig(data)
    assert rig.ask(IMAGE_START, 0, 0, 1)[0] == ACCEPTED
    rig.run(1.0)
    assert rig.ask(IMAGE_START, 0, 0, 1)[0] == FAILED
    result, (storage,) = rig.ask(FORMAT, 1, 1, 1)
    assert (result, storage.available_capacity) == (ACCEPTED, 1.0)
    rig.fly()
    assert rig.ask(IMAGE_START, 0, 0, 1)[1][0].image_index == 0


def test_a_status_can_be_streamed() -> None:
    rig = Rig()
    assert rig.ask(511, 262, 200_000)[0] == ACCEPTED
    assert len(only(rig.run(2.0), "CAMERA_CAPTURE_STATUS")) == 10
    assert rig.ask(511, 262, -1)[0] == ACCEPTED
    assert not only(rig.run(1.0), "CAMERA_CAPTURE_STATUS")


def test_who_is_not_meant_keeps_silent() -> None:
    rig = Rig()
    assert rig.ask(400, 1)[0] == UNSUPPORTED
    assert rig.ask(400, 1, target=(1, 0))[0] is None
    assert rig.ask(REQUEST_MESSAGE, 148, target=(1, 0))[0] is None
    assert rig.ask(REQUEST_MESSAGE, 259, target=(1, 0))[0] == ACCEPTED
    assert rig.ask(REQUEST_MESSAGE, 259, target=(2, CAMERA))[0] is None
    assert rig.ask(REQUEST_MESSAGE, 259, target=(1, 101))[0] is None


def test_nonsense_in_commands_changes_nothing_and_breaks_nothing() -> None:
    rig = Rig(video=VideoStream(5600))
    streaming = (STREAM_START, STREAM_STOP, 2505)
    for number in (
        *streaming,
        REQUEST_MESSAGE,
        511,
        IMAGE_START,
        VIDEO_START,
        SET_MODE,
        SET_ZOOM,
        SET_FOCUS,
        FORMAT,
        2002,
        2504,
    ):
        for value in (math.nan, math.inf, -math.inf, -1e30, 1e30):
            rig.ask(number, *(value,) * 7)
    rig.run(1.0)
    _, (status,) = rig.ask(REQUEST_MESSAGE, 262)
    assert status.image_count <= 1 + 1.0 / DATA.interval_min_s
    assert math.isfinite(status.image_interval)


def test_the_heartbeat_keeps_to_the_clock_where_simulated_time_falls_behind() -> None:
    camera = Camera(DATA, system_id=1)

    def said(clock_s: float) -> int:
        camera.keep_alive(clock_s)
        count = len(camera.outbox)
        camera.outbox.clear()
        return count

    camera.on_time(0)
    assert said(50.0) == 1
    assert [said(50.0 + 0.25 * quarter) for quarter in range(1, 9)] == [0, 0, 0, 1, 0, 0, 0, 1]
    camera.on_time(1_000_000)
    assert said(52.5) == 1
    assert [said(53.25), said(53.5)] == [0, 1]
