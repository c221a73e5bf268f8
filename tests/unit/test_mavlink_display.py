"""The link to what draws the vehicle: PX4's in custom mode, which SIH alone starts (px4-rc.mavlink)."""

from collections import Counter

import pytest

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import ActuatorOutputs, GroundTruth
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import DISPLAY, GCS, ONBOARD, Peer, only

HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def peer() -> Peer:
    return Peer(display=True)


def watched(seconds: float) -> Counter[str]:
    """How often each message comes, from a simulation that tells outputs and truth with every tick."""
    one, heard = peer(), Counter[str]()
    for _ in range(round(seconds / 0.004)):
        now_us = one.now_us + 4_000
        one.topics.actuator_outputs = ActuatorOutputs(now_us, (0.5,) * 6)
        one.topics.groundtruth = GroundTruth(now_us, lat=47.4, lon=8.5)
        heard.update(message.get_type() for message in one.run(0.004, DISPLAY))
    return heard


def test_it_tells_outputs_and_pose() -> None:
    """200 Hz are asked of outputs, every second of 250 a second is what comes: a real PX4's at 1 x sent 111 (0.9 x)."""
    heard = watched(4.0)
    assert heard.pop("HIL_ACTUATOR_CONTROLS") == pytest.approx(500, abs=2)
    assert heard.pop("HIL_STATE_QUATERNION") == pytest.approx(100, abs=1)
    assert heard.pop("HEARTBEAT") == pytest.approx(4, abs=1) and heard.pop("MISSION_CURRENT") == pytest.approx(4, abs=1)
    assert not heard - Counter(["CURRENT_EVENT_SEQUENCE"] * 4)


def test_outputs_that_are_tried_out_are_told_as_any() -> None:
    """MAV_MODE_FLAG_TEST_ENABLED is never among the flags (streams/HIL_ACTUATOR_CONTROLS.hpp)."""
    one = peer()
    one.topics.actuator_outputs = ActuatorOutputs(1, (0.5,) * 6, test_mode=True)
    told = only(one.run(0.1, DISPLAY), "HIL_ACTUATOR_CONTROLS")[0]
    assert told.controls[0] == 0.5 and not told.mode & mavlink.MAV_MODE_FLAG_TEST_ENABLED


def test_no_other_vehicle_has_it() -> None:
    assert [link.name for link in Peer().mavlink.links] == ["gcs", "onboard", "payload", "gimbal"]


def test_nothing_passes_between_it_and_the_other_links() -> None:
    """It is started without -f."""
    one, text = peer(), mavlink.MAVLink_statustext_message(6, b"ahoy")
    for link in (GCS, ONBOARD, DISPLAY):
        one.send(HEARTBEAT, link)
    one.received(ONBOARD)
    one.send(text, GCS)
    assert only(one.received(ONBOARD), "STATUSTEXT") and not only(one.received(DISPLAY), "STATUSTEXT")
    one.send(text, DISPLAY)
    assert not only(one.received(ONBOARD) + one.received(GCS), "STATUSTEXT")


def test_who_speaks_there_as_a_ground_station_is_told_texts_and_answered() -> None:
    one = peer()
    one.send(HEARTBEAT, DISPLAY)
    one.texts.say(Severity.INFO, "Takeoff detected")
    assert only(one.run(0.1, DISPLAY), "STATUSTEXT")
    ask = mavlink.MAVLink_param_request_read_message(1, 1, b"MAV_SYS_ID", -1)
    assert only(one.send(ask, DISPLAY) + one.run(0.1, DISPLAY), "PARAM_VALUE")
