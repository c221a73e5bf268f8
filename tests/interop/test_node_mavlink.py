"""node-mavlink, a second MAVLink implementation, reads every byte that a vehicle sends in a busy minute.

`npm ci` in tests/interop/node sets it up (make does where there is npm). Where there is no Node.js the test is skipped.
"""

import json
import math
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.core import framing
from tests.hostile import LINKS, Victim

FOLDER = Path(__file__).with_name("node")
INSTALLED = FOLDER / "node_modules" / "node-mavlink"
HOVER_S = 40.0
SAMPLES = 20
NODE_LIMIT_S = 330.0
EVERY_STREAM_US = 100_000.0
FEWEST_FRAMES = 20_000

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("node") is None, reason="NOT TESTED: no Node.js here, so no second implementation"),
    pytest.mark.skipif(not INSTALLED.exists(), reason=f"NOT TESTED: node-mavlink is missing; npm ci --prefix {FOLDER}"),
]


class Recorder(Victim):
    """A vehicle of which everything that it sends on any link is kept."""

    def __init__(self, folder: Path) -> None:
        storage.prepare(folder)
        super().__init__("sihsim_hex", folder)
        self.sent: list[bytearray] = [bytearray() for _ in range(LINKS)]

    def take(self, link: int) -> bytes:
        """Keep what is taken."""
        said = super().take(link)
        self.sent[link] += said
        return said

    def check_sent(self) -> None:
        """Take everything."""
        for link in range(LINKS):
            self.take(link)


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """What four links sent while a vehicle took off, hovered and answered our clients; one of them signed at last."""
    vehicle = Recorder(tmp_path_factory.mktemp("vehicle"))
    vehicle.record()
    vehicle.run(HOVER_S / 2)
    for number in sorted(mavlink.mavlink_map):
        vehicle.say(mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, number, *[0.0] * 6))
        vehicle.say(
            mavlink.MAVLink_command_long_message(
                1, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, number, EVERY_STREAM_US, *[0.0] * 5
            )
        )
    vehicle.run(HOVER_S / 2)
    return [bytes(sent) for sent in vehicle.sent]


def read(data: bytes, folder: Path) -> Any:
    """What node-mavlink makes of the frames."""
    frames_file, magic_file = folder / "frames.bin", folder / "magic.json"
    frames_file.write_bytes(data)
    magic_file.write_text(json.dumps({number: kind.crc_extra for number, kind in mavlink.mavlink_map.items()}))
    command = ["node", str(FOLDER / "decode.mjs"), str(frames_file), str(magic_file), str(SAMPLES)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=NODE_LIMIT_S, cwd=FOLDER)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def same(ours: Any, theirs: Any) -> bool:
    """Whether a field has the same value in both, whatever the languages make of it."""
    if isinstance(ours, bytes):
        ours = ours.decode(errors="replace")
    if isinstance(ours, list):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(ours, str):
        return ours.rstrip("\0") == str(theirs).rstrip("\0")
    if isinstance(ours, float):
        return math.isnan(ours) if theirs == "NaN" else theirs is None or ours == pytest.approx(float(theirs), rel=1e-6)
    return bool(int(theirs) == ours)


def samples(data: bytes) -> Iterator[tuple[int, int, Any]]:
    """Message id, number of its kind, and the message as pymavlink reads it."""
    ear: Any = mavlink.MAVLink(None)
    counts: dict[int, int] = {}
    for frame in framing.split(data):
        number = framing.message_id(frame)
        count = counts.get(number, 0)
        counts[number] = count + 1
        if count < SAMPLES:
            yield number, count, ear.decode(bytearray(frame))


@pytest.mark.parametrize("link", range(LINKS), ids=["gcs", "onboard", "payload", "gimbal"])
def test_every_frame_is_right_and_says_the_same(frames: list[bytes], link: int, tmp_path: Path) -> None:
    data = frames[link]
    found = read(data, tmp_path)
    assert (found["crcErrors"], found["invalid"], found["failures"]) == (0, 0, [])
    assert found["valid"] == len(framing.split(data)) == found["decoded"] + sum(found["fieldless"].values())
    for number, count, message in samples(data):
        if str(number) not in found["messages"]:
            continue
        theirs = found["messages"][str(number)][count]
        assert theirs["header"] == [message.get_seq(), message.get_srcSystem(), message.get_srcComponent()]
        for field, value in theirs["fields"].items():
            if field in message.fieldnames:
                assert same(getattr(message, field), value), f"{message.get_type()}.{field}: {value}"


def test_the_recording_is_a_busy_one(frames: list[bytes]) -> None:
    kinds = [{framing.message_id(frame) for frame in framing.split(data)} for data in frames]
    assert sum(len(framing.split(data)) for data in frames) > FEWEST_FRAMES
    for name in ("PARAM_VALUE", "MISSION_ITEM_INT", "FILE_TRANSFER_PROTOCOL", "COMMAND_ACK", "EVENT", "STATUSTEXT"):
        assert getattr(mavlink, f"MAVLINK_MSG_ID_{name}") in kinds[0], name
    assert len(kinds[0]) > 50


def test_signed_frames_are_read_too(tmp_path: Path) -> None:
    vehicle = Recorder(tmp_path / "vehicle")
    vehicle.say(mavlink.MAVLink_setup_signing_message(1, 1, [7] * 32, 1))
    vehicle.run(1.0)
    found = read(bytes(vehicle.sent[1]), tmp_path)
    assert (found["crcErrors"], found["invalid"], found["failures"]) == (0, 0, [])
    assert found["valid"] == len(framing.split(bytes(vehicle.sent[1]))) > 100
    assert all(framing.is_signed(frame) for frame in framing.split(bytes(vehicle.sent[1]))[1:])
