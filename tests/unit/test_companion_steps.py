"""The steps that missions share, each against a stand-in for a PX4: what is sent, when it ends, and how it fails."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl_emu.gcs.geodesy import distance_m, from_metres
from sitl_emu.gcs.mission import MissionItem
from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.camera import Image
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.confirmation import SURVEYING
from sitl_emu.missions.companion.detector import Detection
from sitl_emu.missions.companion.onboard import Onboard, Script, advanced
from sitl_emu.missions.companion.options import Options
from sitl_emu.missions.companion.perception import Known, perception_of
from sitl_emu.missions.companion.wire import Wire
from tests.unit.companion_px4 import HOLD, MISSION, STEP_US, FakePx4
from tests.unit.ftp_server import Server

HOME = (40.47, -86.99, 215.0)
NO_CHANGE: Callable[[int, FakePx4], None] = lambda now_us, px4: None  # noqa: E731


class Vehicle:
    """A companion's `Onboard` and its autopilot, joined by a wire that loses nothing."""

    def __init__(self, mav_type: int = 13) -> None:
        self.onboard, self.px4, self.wire = Onboard(), FakePx4(1, mav_type, 0.0, 0.0, 5.0), Wire(1, skip=())
        self.now_us = 0

    def run(self, script: Script, limit_s: float = 60.0, each: Callable[[int, FakePx4], None] = NO_CHANGE) -> float:
        """Until a script has ended; how long that took in seconds."""
        began_us, going = self.now_us, True
        while going:
            assert self.now_us - began_us < limit_s * 1e6, "the script did not end"
            self.now_us += STEP_US
            each(self.now_us, self.px4)
            for msg in self.px4.on_time(self.now_us):
                self.send(self.onboard.on_message(self.now_us, AUTOPILOT_LINK, msg)[1])
            self.onboard.watch_pilot(self.now_us)
            going = advanced(script) is not None
            self.send(self.onboard.on_time(self.now_us))
        return (self.now_us - began_us) * 1e-6

    def send(self, outgoing: Any) -> None:
        for link, msg in outgoing:
            if link == AUTOPILOT_LINK:
                for heard in Wire(skip=()).decode(self.wire.encode(msg)):
                    for answer in self.px4.on_message(self.now_us, heard):
                        self.send(self.onboard.on_message(self.now_us, AUTOPILOT_LINK, answer)[1])

    def armed(self) -> "Vehicle":
        self.run(steps.heard(self.onboard))
        self.run(steps.ready(self.onboard, 10.0))
        self.run(steps.arm(self.onboard))
        return self


def place(north_m: float, east_m: float) -> tuple[float, float]:
    return from_metres(north_m, east_m, *HOME[:2])


def item(north_m: float, east_m: float) -> MissionItem:
    lat, lon = place(north_m, east_m)
    return MissionItem(3, 16, x=round(lat * 1e7), y=round(lon * 1e7), z=0.0)


def test_ready_waits_for_the_autopilots_checks_and_says_how_long_it_waited_in_vain() -> None:
    one = Vehicle()
    one.run(steps.heard(one.onboard))
    one.run(steps.ready(one.onboard, 10.0))
    assert one.now_us == pytest.approx(one.px4.ready_us, abs=600_000)
    never = Vehicle()
    never.px4.ready_us = 1 << 60
    with pytest.raises(steps.StepFailed, match="autopilot not ready after 5 s"):
        never.run(steps.ready(never.onboard, 5.0))


def test_an_upload_ends_when_the_autopilot_has_it_and_a_refusal_names_what_was_refused() -> None:
    one = Vehicle()
    one.run(steps.heard(one.onboard))
    one.run(steps.upload(one.onboard, [item(5.0, 0.0), item(9.0, 0.0)]))
    assert len(one.px4.missions.items[0]) == 2
    one.px4.missions.refuse = 14
    with pytest.raises(steps.StepFailed, match="upload of rally points failed: denied"):
        one.run(steps.upload(one.onboard, [item(5.0, 0.0)], 2))


def test_arming_ends_with_an_armed_vehicle_and_a_refusal_is_asked_again() -> None:
    one = Vehicle().armed()
    assert (one.px4.armed, one.onboard.telemetry.armed) == (True, True)
    one.run(steps.disarm(one.onboard))
    assert (one.px4.armed, one.onboard.telemetry.armed) == (False, False)
    refusing = Vehicle()
    refusing.run(steps.heard(refusing.onboard))
    refusing.px4.ack = lambda command: 1
    with pytest.raises(steps.StepFailed, match="arming refused: temporarily rejected"):
        refusing.run(steps.arm(refusing.onboard, tries=3))
    assert [command for command, _ in refusing.px4.commands] == [400] * 3


def test_going_to_a_place_ends_with_a_standstill_there() -> None:
    one = Vehicle(mav_type=10).armed()
    seconds = one.run(steps.go_to(one.onboard, *place(20.0, 10.0), HOME[2], within_m=1.0, timeout_s=30.0))
    assert (one.px4.north_m, one.px4.east_m) == pytest.approx((20.0, 10.0), abs=0.1)
    assert seconds > 22.4 / one.px4.speed_m_s + steps.moving.STILL_S
    with pytest.raises(steps.StepFailed, match=r"\d\.\d m from the waypoint after 2 s"):
        one.run(steps.go_to(one.onboard, *place(50.0, 10.0), HOME[2], within_m=1.0, timeout_s=2.0))


def test_a_vehicle_that_somebody_disarms_on_the_way_does_not_arrive() -> None:
    one = Vehicle(mav_type=10).armed()

    def disarm(now_us: int, px4: FakePx4) -> None:
        px4.armed &= now_us < 6_000_000

    with pytest.raises(steps.StepFailed, match="disarmed on the way"):
        one.run(steps.go_to(one.onboard, *place(50.0, 0.0), HOME[2], 1.0, 60.0), each=disarm)


def test_centring_follows_an_estimate_that_moves_and_ends_over_it() -> None:
    one = Vehicle(mav_type=10).armed()
    estimate = [place(10.0, 0.0)]

    def better(now_us: int, px4: FakePx4) -> None:
        if px4.north_m > 5.0:
            estimate[0] = place(12.0, 3.0)

    one.run(steps.centre(one.onboard, lambda: estimate[0], HOME[2], within_m=1.0, timeout_s=30.0), each=better)
    here = one.onboard.telemetry.place
    assert here is not None and distance_m(here.lat_deg, here.lon_deg, *place(12.0, 3.0)) < 1.0
    assert sum(command == 192 for command, _ in one.px4.commands) == 2
    with pytest.raises(steps.StepFailed, match="the target is lost"):
        one.run(steps.centre(one.onboard, lambda: None, HOME[2], 1.0, 30.0))


def test_a_mission_that_was_left_is_resumed_where_it_was_left() -> None:
    one = Vehicle(mav_type=10).armed()
    way = [item(10.0, 0.0), item(20.0, 0.0), item(30.0, 0.0)]
    one.run(steps.upload(one.onboard, way))
    one.px4.mode = MISSION
    one.run(steps.pause(one.onboard, 30.0, until=lambda: one.onboard.telemetry.mission_current == 1))
    left: list[int] = []

    def aside() -> Script:
        left.append((yield from steps.leave(one.onboard)))
        assert one.px4.mode == HOLD
        yield from steps.go_to(one.onboard, *place(15.0, 9.0), HOME[2], 1.0, 30.0)
        one.px4.seq = 0  # whatever the autopilot took for the current item meanwhile
        yield from steps.resume(one.onboard, left[0])

    one.run(aside())
    assert left == [1] and one.px4.mode == MISSION and one.px4.seq == 1


def test_a_return_home_ends_landed_and_disarmed() -> None:
    one = Vehicle().armed()
    one.run(steps.upload(one.onboard, [item(10.0, 0.0)._replace(command=22, z=6.0), item(10.0, 0.0)]))
    one.px4.mode = MISSION
    one.run(steps.pause(one.onboard, 30.0, until=lambda: one.px4.north_m > 5.0))
    one.run(steps.return_home(one.onboard))
    assert not one.px4.armed and one.px4.up_m == 0.0
    assert abs(one.px4.north_m) < 0.5
    with pytest.raises(steps.StepFailed, match="did not land and disarm"):
        one.run(steps.arm(one.onboard))
        one.run(steps.until_landed(one.onboard, timeout_s=3.0))


def test_an_autopilot_that_falls_silent_is_told_from_one_that_does_not_move() -> None:
    one = Vehicle().armed()
    silent = [False]
    speak = one.px4.on_time
    one.px4.on_time = lambda now_us: [] if silent[0] else speak(now_us)  # type: ignore[method-assign]
    assert one.onboard.silence == ""
    with pytest.raises(steps.StepFailed, match="does not move, and is armed"):
        one.run(steps.until_landed(one.onboard))
    silent[0] = True
    with pytest.raises(steps.StepFailed, match=r"nothing heard of the autopilot for 20\.\d s"):
        one.run(steps.until_landed(one.onboard))
    silent[0] = False
    one.run(steps.pause(one.onboard, 1.0))
    assert one.onboard.silence == ""
    said = [event.kind for event in one.onboard.events() if event.kind.startswith("autopilot")]
    assert said == ["autopilot_silent", "autopilot_heard"]


class TwoFires:
    labels = ("fire", "water")

    def detect(self, image: Image, gsd_m: float | None = None) -> list[Detection]:
        scores = (("fire", 0.9), ("fire", 0.5), ("water", 0.9))
        return [Detection(label, score, 1.0, 1.0, 2.0, 2.0) for label, score in scores]


def carrying(files: Path) -> Vehicle:
    """A vehicle whose autopilot has a card."""
    one = Vehicle()
    server, commands = Server(files), one.px4.on_message

    def on_message(now_us: int, msg: Any) -> list[Any]:
        is_ftp = msg.get_type() == "FILE_TRANSFER_PROTOCOL"
        return server.on_message(now_us, msg) if is_ftp else commands(now_us, msg)

    one.px4.on_message = on_message  # type: ignore[method-assign]
    one.run(steps.heard(one.onboard))
    return one


def test_what_is_looked_for_is_read_from_the_autopilots_card(tmp_path: Path) -> None:
    (tmp_path / "selection.json").write_text('{"fire": {"weight": 0.8, "threshold": 0.6}}')
    perception = perception_of(Options({"selection": "mftp:///selection.json"}), {"fires": Known(TwoFires, SURVEYING)})
    assert perception.detector.detect(np.zeros((2, 2, 3), np.uint8)) == []
    one = carrying(tmp_path)
    one.run(steps.select(one.onboard, perception))
    found = perception.detector.detect(np.zeros((2, 2, 3), np.uint8))
    assert [(each.label, round(each.score, 6)) for each in found] == [("fire", 0.72)]
    assert perception.detector.labels == ("fire",)
    assert [event.text for event in one.onboard.events()] == ["mftp:///selection.json: fire 0.8"]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (None, "selection mftp:///selection.json: .*put the file there by MAVLink FTP"),
        ("{fire", "selection 'mftp:///selection.json': can't be read as a JSON file"),
        ('{"smoke": 1}', "selection 'smoke': no class of this detector; it knows fire, water"),
        ('{"fire": 0}', "looks for nothing"),
    ],
)
def test_a_selection_that_is_missing_or_wrong_is_told_before_take_off(
    tmp_path: Path, text: str | None, wanted: str
) -> None:
    if text is not None:
        (tmp_path / "selection.json").write_text(text)
    perception = perception_of(Options({"selection": "mftp:///selection.json"}), {"fires": Known(TwoFires, SURVEYING)})
    one = carrying(tmp_path)
    with pytest.raises(steps.StepFailed, match=wanted):
        one.run(steps.select(one.onboard, perception))
