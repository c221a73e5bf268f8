"""REQUEST_MESSAGE of what was said before: denied until there is something new, but of what is told on and on."""

import pytest

from sitl_emu.autopilot.topics import GimbalDeviceSetAttitude, GimbalManagerStatus, ManualControlSetpoint
from tests.unit.mavlink_peer import Peer, command_long, only

SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 511, 512
ACCEPTED, DENIED = 0, 2


@pytest.mark.parametrize(("number", "name"), [(24, "GPS_RAW_INT"), (29, "SCALED_PRESSURE"), (241, "VIBRATION")])
def test_a_message_without_anything_new_is_denied(number: int, name: str) -> None:
    """As from PX4, whose stream sends a fix, or a sample, once."""
    peer = Peer()
    peer.fly_and_run(0.3)
    peer.send(command_long(SET_MESSAGE_INTERVAL, number, -1.0))
    results = [only(peer.send(command_long(REQUEST_MESSAGE, number)), "COMMAND_ACK")[0].result for _ in range(2)]
    assert results == [ACCEPTED, DENIED]
    peer.fly_and_run(0.13)
    assert only(peer.send(command_long(REQUEST_MESSAGE, number)), name)


def test_who_the_aircraft_is_is_told_once_for_each_vehicle_status() -> None:
    """As from a real PX4, asked twelve times 50 ms apart (streams/OPEN_DRONE_ID_BASIC_ID.hpp)."""
    peer = Peer()
    for _ in range(2):
        peer.topics.vehicle_status = peer.topics.vehicle_status._replace(timestamp=peer.now_us)
        results = [only(peer.send(command_long(REQUEST_MESSAGE, 12900)), "COMMAND_ACK")[0].result for _ in range(2)]
        assert results == [ACCEPTED, DENIED]
        peer.fly_and_run(0.5)


@pytest.mark.parametrize("number", [281, 284])
def test_what_the_gimbals_manager_last_said_is_told_on_and_on(number: int) -> None:
    """PX4 copies it, new or not (streams/GIMBAL_MANAGER_STATUS.hpp, GIMBAL_DEVICE_SET_ATTITUDE.hpp)."""
    peer = Peer()
    peer.topics.gimbal_manager_status = GimbalManagerStatus(1)
    peer.topics.gimbal_device_set_attitude = GimbalDeviceSetAttitude(1)
    results = []
    for _ in range(2):
        peer.run(0.1)
        results.append(only(peer.send(command_long(REQUEST_MESSAGE, number)), "COMMAND_ACK")[0].result)
    assert results == [ACCEPTED] * 2


def test_sticks_are_told_once_until_they_speak_again() -> None:
    """As PX4, also the sticks that there are not (streams/MANUAL_CONTROL.hpp)."""
    peer = Peer()
    peer.fly_and_run(0.3)
    for roll in (0.0, 0.5):
        results = [only(peer.send(command_long(REQUEST_MESSAGE, 69)), "COMMAND_ACK")[0].result for _ in range(2)]
        assert results == [ACCEPTED, DENIED]
        peer.topics.manual_control_setpoint = ManualControlSetpoint(peer.now_us, True, roll=roll)
