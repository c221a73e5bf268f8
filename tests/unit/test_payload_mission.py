"""A mission's camera items take pictures: navigator, camera trigger and command sender, with a camera on the wire."""

import itertools
import math
from typing import Any

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import MAV_RESULT_ACCEPTED
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.mavlink import rates
from sitl_emu.autopilot.mavlink.mavlink import Mavlink, Modules
from sitl_emu.autopilot.navigator.navigator import Navigator
from sitl_emu.autopilot.navigator.payload import command_of
from sitl_emu.autopilot.payload.camera_trigger import CameraTrigger
from sitl_emu.autopilot.topics import CameraStatus, GimbalDeviceAttitudeStatus, VehicleCommand
from sitl_emu.components.camera import Camera
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import quaternion
from tests.typed import present

from .mavlink_peer import only
from .navigation_fake import STEP_US, FakeVehicle, item

TAKEOFF, WAYPOINT, LAND = 22, 16, 21
TRIGGER_CONTROL = 2003
TRIGGER_DISTANCE, DIGICAM, IMAGE_START, IMAGE_STOP = 206, 203, 2000, 2001
CAMERA = 100
DATA = present(vehicles.load("m600").camera)
assert DATA is not None


class Rig(FakeVehicle):
    """A vehicle that flies missions, with a camera and what triggers it."""

    def __init__(self, **parameters: float) -> None:
        super().__init__(TRIG_MODE=4, TRIG_INTERFACE=3, MAV_SYS_ID=1, **parameters)
        outgoing = OutgoingCommands()
        self.navigator = Navigator(self.topics, self.parameters, self.dataman, self._say, self.events.send, outgoing)
        self.trigger = CameraTrigger(self.topics, self.parameters, outgoing)
        self.mavlink = Mavlink(
            self.topics,
            self.parameters,
            self.dataman,
            Texts(),
            Modules(lambda now_us, command: None),
            0,
            outgoing=outgoing,
        )
        self.mavlink.plug_in("camera", "wire", Camera(DATA, system_id=1))
        # The vehicle has no sensors worth telling of
        told = {"CAMERA_TRIGGER", "CAMERA_IMAGE_CAPTURED"}
        for link in self.mavlink.links:
            for name in rates.RATES[link.mode].keys() - told:
                link.unschedule(getattr(mavlink, f"MAVLINK_MSG_ID_{name}"))
        self.heard: list[Any] = []
        self._parser = mavlink.MAVLink(None)
        self._onboard_parser = mavlink.MAVLink(None)
        self.onboard: list[Any] = []
        encoder = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self.mavlink.on_datagram(0, 0, bytes(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3).pack(encoder)))

    def step(self) -> None:
        super().step()
        self.trigger.update(self.now_us)
        self.mavlink.update(self.now_us)
        for data in self.mavlink.links[0].outbox:
            self.heard += self._parser.parse_buffer(data) or []
        for data in self.mavlink.links[1].outbox:
            self.onboard += self._onboard_parser.parse_buffer(data) or []
        for link in self.mavlink.links:
            link.outbox.clear()

    def images(self, component: int = CAMERA) -> list[Any]:
        return [m for m in only(self.heard, "CAMERA_IMAGE_CAPTURED") if m.get_srcComponent() == component]

    def fly(self, *items: Any) -> None:
        self.run(3.0)
        self.upload(item(TAKEOFF, 0, 0, 20), *items, item(LAND, 100, 0, 0))
        self.run(0.1)
        self.set_mode(4, 4)
        assert self.arm() == MAV_RESULT_ACCEPTED
        self.run_until_disarmed()


def north_m(image: Any) -> float:
    return float((image.lat * 1e-7 - 47.397743) * 111_195.0)


def test_by_distance_every_image_has_its_place() -> None:
    rig = Rig()
    rig.fly(
        item(TRIGGER_DISTANCE, 0, 0, 0, 10.0, 0, 0),
        item(WAYPOINT, 100, 0, 20),
        item(TRIGGER_DISTANCE, 0, 0, 0, 0.0, 0, 0),
    )
    places = [north_m(image) for image in rig.images()]
    assert len(places) == pytest.approx(10, abs=1)
    gaps = [later - earlier for earlier, later in itertools.pairwise(places)]
    assert gaps == pytest.approx([10.0] * len(gaps), abs=0.5)
    assert [image.image_index for image in rig.images()] == list(range(len(places)))
    # The autopilot tells its own, and that it asked
    assert [m.image_index for m in rig.images(1)] == [m.seq for m in only(rig.onboard, "CAMERA_TRIGGER")]
    assert len(rig.images(1)) == len(places)


def test_an_oblique_survey_is_an_item_of_a_mission() -> None:
    """260; the gimbal is told between two images, through the autopilot and on every link."""
    rig = Rig()
    poses = item(260, 0, 0, -45.0, 10.0, 0, 0, 3.0)._replace(frame=2, x=30)
    rig.fly(poses, item(WAYPOINT, 50, 0, 20), item(TRIGGER_DISTANCE, 0, 0, 0, 0.0, 0, 0))
    assert len(rig.images()) == pytest.approx(5, abs=1)
    rolls = [m.param2 for m in only(rig.heard, "COMMAND_LONG") if m.command == 205 and m.confirmation == 0]
    assert rolls[:4] == [0.0, 30.0, -30.0, 0.0]


def test_one_image_by_either_command() -> None:
    for one in (item(IMAGE_START, 0, 0, 0, 0, 0, 1, 0), item(DIGICAM, 0, 0, 0)._replace(frame=2, x=1)):
        rig = Rig()
        rig.fly(item(WAYPOINT, 50, 0, 20), one, item(WAYPOINT, 100, 0, 20))
        assert [north_m(image) for image in rig.images()] == pytest.approx([50.0], abs=10.5)
        assert len(only(rig.onboard, "CAMERA_TRIGGER")) == 1


def test_a_series_is_the_cameras_and_ends_with_its_item() -> None:
    rig = Rig()
    rig.fly(item(IMAGE_START, 0, 0, 0, 0, 2.0, 0, 0), item(WAYPOINT, 100, 0, 20), item(IMAGE_STOP, 0, 0, 0, 0))
    assert len(rig.images()) == pytest.approx(20.0 / 2.0, abs=2)
    assert not only(rig.onboard, "CAMERA_TRIGGER")
    sent = [m.command for m in only(rig.heard, "COMMAND_LONG")]
    assert sent == [IMAGE_START, IMAGE_STOP, TRIGGER_CONTROL]


def test_a_mission_that_is_left_stops_the_series() -> None:
    rig = Rig()
    rig.run(3.0)
    rig.upload(item(TAKEOFF, 0, 0, 20), item(IMAGE_START, 0, 0, 0, 0, 1.0, 0, 0), item(WAYPOINT, 1000, 0, 20))
    rig.run(0.1)
    rig.set_mode(4, 4)
    rig.arm()
    rig.run(20.0)
    rig.set_mode(4, 3)
    rig.run(1.0)
    before = len(rig.images())
    assert before > 5
    rig.run(10.0)
    assert len(rig.images()) == before


def test_six_cameras_are_asked_on_the_links_that_tell_of_it_and_the_first_is_asked_again() -> None:
    """streams/CAMERA_TRIGGER.hpp; of commands that are given in one moment the first alone is repeated."""
    rig = Rig()
    rig.mavlink._wires.clear()
    rig.run(1.0)
    rig.topics.camera_status = CameraStatus()
    for shot in range(2):
        rig.onboard.clear()
        rig.trigger.handle_command(rig.now_us, VehicleCommand(DIGICAM, param5=1.0))
        rig.run(5.0)
        told = [m for m in rig.onboard if m.get_type() in ("CAMERA_TRIGGER", "COMMAND_LONG")]
        assert told[0].get_type() == "CAMERA_TRIGGER"
        asked = [(m.command, m.target_system, m.target_component, m.confirmation) for m in told[1:]]
        both = [[(IMAGE_START, 1, camera, 0), (DIGICAM, 0, camera, 0)] for camera in range(CAMERA, CAMERA + 6)]
        assert asked[:12] == list(itertools.chain(*both))
        assert asked[12:] == [(IMAGE_START, 1, CAMERA, confirmation) for confirmation in (1, 2, 3)]
        take_one = [m for m in told[1:13] if m.command == IMAGE_START]
        assert [(m.param1, m.param2, m.param3, m.param4) for m in take_one] == [
            (0.0, 0.0, 1.0, shot * 6 + number) for number in range(1, 7)
        ]
        assert {m.param5 for m in told if m.get_type() == "COMMAND_LONG" and m.command == DIGICAM} == {1.0}
    assert not only(rig.heard, "COMMAND_LONG") and not only(rig.heard, "CAMERA_TRIGGER")


def test_a_camera_is_asked_in_its_system_and_answers_once() -> None:
    rig = Rig()
    rig.run(1.5)
    assert (rig.topics.camera_status.active_sys_id, rig.topics.camera_status.active_comp_id) == (1, CAMERA)
    rig.onboard.clear()
    rig.trigger.handle_command(rig.now_us, VehicleCommand(DIGICAM, param5=1.0))
    rig.run(0.1)
    assert {m.target_system for m in only(rig.onboard, "COMMAND_LONG")} == {1}
    rig.run(3.0)
    assert len(only(rig.onboard, "COMMAND_LONG")) == 12, "nothing is repeated"
    assert len(rig.images()) == 1


def test_an_image_is_told_above_the_terrain_and_as_the_gimbal_looks() -> None:
    """-1 m where the ground is not known; nothing before the place is (CameraFeedback::Run)."""
    rig = Rig()
    shoot = VehicleCommand(DIGICAM, param5=1.0)
    rig.trigger.handle_command(1_000, shoot)
    rig.trigger.update(1_000)
    rig.run(3.0)
    assert not rig.images(1) and only(rig.onboard, "CAMERA_TRIGGER")
    topics = rig.topics
    rig.trigger.handle_command(rig.now_us, shoot)
    rig.run(0.1)
    assert [(image.relative_alt, image.camera_id) for image in rig.images(1)] == [(-1000, 1)]
    alt_m = topics.vehicle_global_position.alt
    topics.vehicle_global_position = topics.vehicle_global_position._replace(
        terrain_alt=alt_m - 2.5, terrain_alt_valid=True
    )
    topics.vehicle_attitude = topics.vehicle_attitude._replace(q=quaternion(0.1, 0.0, 1.0))
    gimbal_q = quaternion(0.0, -1.0, 0.5)
    for flags, expected in ((0, quaternion(0.0, -1.0, 1.5)), (mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK, gimbal_q)):
        topics.gimbal_device_attitude_status = GimbalDeviceAttitudeStatus(rig.now_us, flags, gimbal_q)
        rig.now_us += 500_000
        rig.trigger.handle_command(rig.now_us, shoot)
        rig.trigger.update(rig.now_us)
        assert topics.camera_capture.ground_distance == pytest.approx(2.5)
        assert topics.camera_capture.q == pytest.approx(expected)
    rig.now_us += 1_000_000
    rig.trigger.handle_command(rig.now_us, shoot)
    rig.trigger.update(rig.now_us)
    assert topics.camera_capture.q == topics.vehicle_attitude.q


def test_a_landing_centres_the_gimbal_a_quarter_of_a_second_after_it_begins() -> None:
    """Flown on PX4 v1.18: 1001, 1000, 1001 to component 0 on all links; the first is repeated, as nobody answers."""
    rig = Rig()
    rig.run(3.0)
    rig.set_mode(4, 2)
    rig.arm()
    rig.run(10.0)
    rig.heard.clear()
    rig.set_mode(4, 6)
    rig.run(0.2)
    assert only(rig.heard, "COMMAND_LONG") == []
    rig.run(4.0)
    sent = only(rig.heard, "COMMAND_LONG")
    assert {(m.target_system, m.target_component) for m in sent} == {(1, 0)}
    assert [(m.command, m.param1, m.param2, m.param3, m.param4, m.confirmation) for m in sent if m.command == 1001] == [
        (1001, 1.0, 1.0, -1.0, -1.0, 0),
        (1001, -3.0, -3.0, -1.0, -1.0, 0),
        *((1001, 1.0, 1.0, -1.0, -1.0, confirmation) for confirmation in (1, 2, 3)),
    ]
    (centre,) = (m for m in sent if m.command == 1000)
    assert all(math.isnan(value) for value in (centre.param1, centre.param2, centre.param3, centre.param4))
    assert (centre.param5, centre.confirmation) == (2.0, 0)


def test_a_return_ends_with_an_idle_item_as_a_command() -> None:
    """Flown on PX4 v1.18: command 0 with NAV_ACC_RAD, NAV_LOITER_RAD and the height of home."""
    rig = Rig()
    rig.run(3.0)
    rig.set_mode(4, 2)
    rig.arm()
    rig.run(10.0)
    rig.set_mode(4, 5)
    rig.run_until_disarmed()
    idle = next(m for m in only(rig.heard, "COMMAND_LONG") if m.command == 0)
    assert (idle.param1, idle.param2, idle.param3, idle.param5, idle.param6) == (0.0, 10.0, 80.0, 0.0, 0.0)
    assert math.isnan(idle.param4)
    assert idle.param7 == pytest.approx(rig.topics.home_position.alt, abs=0.1)


def test_items_that_need_no_flying_are_told_to_all() -> None:
    rig = Rig()
    rig.fly(item(178, 0, 0, 0, 1.0, 3.0, -1.0, 0.0)._replace(frame=2), item(WAYPOINT, 50, 0, 20))
    (speed,) = (m for m in only(rig.heard, "COMMAND_LONG") if m.command == 178 and m.confirmation == 0)
    assert (speed.target_component, speed.param1, speed.param2, speed.param3) == (0, 1.0, 3.0, -1.0)


@pytest.mark.parametrize(
    ("params", "sent"),
    [
        ((101.0, 0.0, 1.0, math.nan), (DIGICAM, CAMERA)),
        ((101.0, 2.0, 0.0, math.nan), (IMAGE_START, 101)),
        ((0.5, 2.0, 0.0, math.nan), (IMAGE_START, CAMERA)),
        ((math.nan, 2.0, math.nan, math.nan), (IMAGE_START, CAMERA)),
        ((math.inf, 2.0, math.inf, math.nan), (IMAGE_START, CAMERA)),
    ],
)
def test_which_camera_takes_images(params: tuple[float, ...], sent: tuple[int, int]) -> None:
    """Navigator::publish_vehicle_command; numbers become whole ones as in C, also those that are none."""
    navigator = Rig().navigator
    navigator._payload.issue(command_of(IMAGE_START, *params))
    assert [(given.command, given.target_component) for given in navigator._state.outgoing.waiting] == [sent]


def test_by_time_and_by_command() -> None:
    rig = Rig()
    rig.parameters.set("TRIG_MODE", 1)
    trigger = rig.trigger = CameraTrigger(rig.topics, rig.parameters, OutgoingCommands())
    trigger.handle_command(0, VehicleCommand(214, param1=500.0))
    trigger.handle_command(0, VehicleCommand(2003, param1=1.0, param2=1.0, param3=0.0))
    rig.run(2.0)
    assert rig.topics.camera_trigger.seq == 3
    trigger.handle_command(rig.now_us, VehicleCommand(2003, param1=0.0, param2=1.0, param3=0.0))
    rig.run(0.1)
    stamp = rig.topics.camera_trigger.timestamp
    rig.run(2.0)
    assert rig.topics.camera_trigger.timestamp == stamp
    assert STEP_US < 500_000


def test_only_the_newest_three_commands_are_repeated() -> None:
    rig = Rig()
    rig.mavlink._wires.clear()
    for number in range(10):
        command = VehicleCommand(IMAGE_STOP, float(number), target_system=1, target_component=CAMERA)
        rig.navigator._state.outgoing.give(command)
        rig.run(0.04)
    rig.run(5.0)
    sent = [m.param1 for m in only(rig.heard, "COMMAND_LONG")]
    assert sent == [*range(10), *(7, 8, 9) * 3]
