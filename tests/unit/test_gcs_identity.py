"""Who a vehicle is, what its messages' intervals are, and its metadata, asked of our own autopilot."""

from typing import Any

import pytest

from sitl_emu.gcs.component_metadata import ACTUATORS, EVENTS, GENERAL, PARAMETER, ComponentMetadata, path_of
from sitl_emu.gcs.identity import Identity
from sitl_emu.gcs.message_interval import DEFAULT_US, STOPPED_US, read_interval, set_interval
from sitl_emu.gcs.message_request import MessageRequest
from sitl_emu.gcs.set_mode import SetModeMessage

from .gcs_link import converse
from .mavlink_peer import Peer, only

ATTITUDE, HOME_POSITION, CAMERA_SETTINGS = 30, 242, 260


def asked(peer: Peer, service: Any, **how: Any) -> Any:
    converse(peer, service, 60.0, lambda: service.done, **how)
    assert service.done
    return service


def test_a_vehicle_tells_its_version_and_its_modes() -> None:
    identity = asked(Peer(), Identity(1))
    assert identity.complete
    assert identity.release == "1.18.0"
    assert identity.modes[4 << 16 | 3 << 24].name == "Hold"
    assert identity.modes[4 << 16 | 3 << 24].selectable


@pytest.mark.parametrize("name", ["COMMAND_ACK", "AUTOPILOT_VERSION", "AVAILABLE_MODES"])
def test_what_is_lost_of_it_is_asked_for_again(name: str) -> None:
    whole, holed = asked(Peer(), Identity(1)), asked(Peer(), Identity(1), lost=frozenset({name}))
    assert holed.complete
    assert holed.modes == whole.modes


def test_a_message_comes_though_its_ack_does_not() -> None:
    peer = Peer()
    peer.fly()
    request = asked(peer, MessageRequest(1, HOME_POSITION), lost=frozenset({"COMMAND_ACK"}))
    assert request.message.get_type() == "HOME_POSITION"


def test_a_message_that_a_vehicle_does_not_have_is_refused() -> None:
    request = asked(Peer(), MessageRequest(1, CAMERA_SETTINGS))
    assert (request.message, request.refusal) == (None, "denied")


def test_a_message_of_which_there_is_nothing_yet_is_asked_for_again() -> None:
    peer = Peer()
    request = MessageRequest(1, HOME_POSITION)
    converse(peer, request, 2.0)
    assert not request.done
    peer.fly()
    assert asked(peer, request).message.get_type() == "HOME_POSITION"


def test_an_interval_is_set_read_and_put_back() -> None:
    peer = Peer()
    asked(peer, set_interval(1, ATTITUDE, DEFAULT_US))
    before = asked(peer, read_interval(1, ATTITUDE)).message.interval_us
    assert asked(peer, set_interval(1, ATTITUDE, 500_000)).outcome.accepted
    assert asked(peer, read_interval(1, ATTITUDE)).message.interval_us == 500_000
    asked(peer, set_interval(1, ATTITUDE, STOPPED_US))
    assert not only(peer.fly_and_run(1.0), "ATTITUDE")
    asked(peer, set_interval(1, ATTITUDE, DEFAULT_US))
    assert asked(peer, read_interval(1, ATTITUDE)).message.interval_us == before


def test_the_old_message_for_a_mode_is_acknowledged_as_the_command() -> None:
    assert asked(Peer(), SetModeMessage(1, "hold")).outcome == (True, 0, "accepted")


def test_the_files_that_describe_a_vehicle_are_fetched_and_unpacked() -> None:
    metadata = asked(Peer(), ComponentMetadata(1))
    assert metadata.errors == []
    assert {GENERAL, PARAMETER, EVENTS, ACTUATORS} <= set(metadata.files)
    assert any(entry["name"] == "MPC_XY_VEL_MAX" for entry in metadata.files[PARAMETER]["parameters"])


def test_files_that_are_there_already_are_not_fetched() -> None:
    first = asked(Peer(), ComponentMetadata(1))
    again = asked(Peer(), ComponentMetadata(1, cache=first.fetched))
    assert again.files == first.files
    assert again.fetched == {}


def test_a_component_in_a_uri_is_left_out_of_the_path() -> None:
    assert path_of("mftp://etc/extras/x.json.xz") == "etc/extras/x.json.xz"
    assert path_of("mftp://[;comp=1]etc/extras/x.json.xz") == "etc/extras/x.json.xz"
