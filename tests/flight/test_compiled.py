"""Compiled modules fly as their sources do, to the last bit; and no others than just these sources' are taken."""

import ast
import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sitl_emu import compiled

FLIGHT = """
import hashlib, sys
from pathlib import Path
from sitl_emu import compiled, vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.storage import storage
from sitl_emu.core import dialect as mavlink
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

model, root = sys.argv[1], Path(sys.argv[2])
storage.prepare(root)
data = vehicles.load(model)
if data.release is not None:
    data = vehicles.with_parcel(data, {})
autopilot = Autopilot(data.airframe, 0, root)
simulator = VehicleSimulator(data, Home(47.397742, 8.545594, 489.4, 0.0), 7, FlatGround(), name=model)
station, said, controls = mavlink.MAVLink(None, 255, 190), hashlib.sha256(), None
orders = {
    2000: (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0),
    2100: (mavlink.MAV_CMD_NAV_TAKEOFF,),
    4500: (mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,),
}
for tick in range(6500):
    messages = []
    if tick % 250 == 0:
        messages.append(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    if tick in orders:
        number, *params = orders[tick]
        filled = [*params, *[float("nan")] * (7 - len(params))]
        messages.append(mavlink.MAVLink_command_long_message(1, 1, number, 0, *filled))
    for message in messages:
        autopilot.on_datagram(0, bytes(message.pack(station)))
    controls = autopilot.step(simulator.tick(controls))
    for link in autopilot.mavlink.links:
        for datagram in link.outbox:
            said.update(bytes(datagram if isinstance(datagram, bytes) else datagram[0]))
        link.outbox.clear()
print(compiled.in_use(), simulator.pose(), said.hexdigest())
"""


def flown(model: str, folder: Path, plain: bool) -> tuple[str, str, str]:
    """Whether compiled modules flew, where it ended and what was said, and a digest of the flight log."""
    folder.mkdir()
    environment = {name: value for name, value in os.environ.items() if name != "SITL_EMU_PURE"}
    if plain:
        environment["SITL_EMU_PURE"] = "1"
    command = [sys.executable, "-P", "-c", FLIGHT, model, str(folder)]
    told = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    in_use, _, rest = told.partition(" ")
    logs = b"".join(path.read_bytes() for path in sorted(folder.rglob("*.ulg")))
    assert logs
    return in_use, rest, hashlib.sha256(logs).hexdigest()


@pytest.mark.parametrize("model", ["sihsim_hex", "m600", "responder", "rover"])
def test_they_fly_as_their_sources_do(model: str, tmp_path: Path) -> None:
    in_use, *compiled_flight = flown(model, tmp_path / "compiled", plain=False)
    if in_use != "True":
        pytest.skip("nothing is compiled of these sources (make setup does that where there is a C compiler)")
    in_use, *plain_flight = flown(model, tmp_path / "plain", plain=True)
    assert in_use == "False"
    assert compiled_flight == plain_flight


def test_a_changed_source_belongs_to_another_folder(tmp_path: Path) -> None:
    rooms = {room: tmp_path / room for room in compiled.HOT}
    source = rooms["core"] / "attitude.py"
    source.parent.mkdir()
    source.write_text("ONE = 1\n")
    files = compiled.sources(rooms)
    assert files == {"sitl_emu.core.attitude": source}
    before = compiled.folder(files)
    source.write_text("ONE = 2\n")
    assert compiled.folder(files) != before


@pytest.fixture
def rooms() -> dict[str, Path]:
    root = Path(compiled.__file__).parent
    if not (root / "autopilot").is_dir():
        pytest.skip("the links that make sets are not there")
    return {room: root / room for room in compiled.HOT}


def test_every_pattern_finds_a_file(rooms: dict[str, Path]) -> None:
    for room, patterns in compiled.HOT.items():
        for pattern in patterns:
            assert list(rooms[room].glob(pattern)), f"{room}: {pattern}"


def test_numbers_are_final(rooms: dict[str, Path]) -> None:
    for name, path in compiled.sources(rooms).items():
        for statement in ast.parse(path.read_text()).body:
            if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant):
                pytest.fail(f"{name}:{statement.lineno}: looked up by its name at every use: say `: Final = `")
