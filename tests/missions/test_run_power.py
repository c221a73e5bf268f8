"""A run whose autopilot is rebooted and shut down by a ground station, as a launched one can be."""

import contextlib
import json
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml
from pymavlink import mavutil
from pyulog import ULog

from sitl_emu.core import ports
from tests.missions.runs import FIRST_INSTANCE, Run, short_scenario

LIMIT_S = 60.0
REBOOT, SHUT_DOWN = 1, 2
PREFLIGHT_REBOOT_SHUTDOWN = 246
REAL32, INT32 = 9, 6
STANDBY = 3


class Station:
    """A ground station of the first vehicle."""

    def __init__(self) -> None:
        instance = FIRST_INSTANCE
        self.system = ports.system_id(instance)
        self.link: Any = mavutil.mavlink_connection(f"udpout:127.0.0.1:{ports.gcs(instance).local}", source_system=255)

    def wait(self, kind: str, accept: Callable[[Any], bool]) -> Any:
        """The next accepted message of a kind."""
        until = time.monotonic() + LIMIT_S
        while time.monotonic() < until:
            self.link.mav.heartbeat_send(6, 8, 0, 0, 4)
            message = self.link.recv_match(type=kind, blocking=True, timeout=0.5)
            if message is not None and message.get_srcComponent() == 1 and accept(message):
                return message
        raise TimeoutError(f"no {kind} as awaited")

    def power(self, what: int) -> None:
        """MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN."""
        self.link.mav.command_long_send(self.system, 1, PREFLIGHT_REBOOT_SHUTDOWN, 0, what, 0, 0, 0, 0, 0, 0)
        ack = self.wait("COMMAND_ACK", lambda ack: ack.command == PREFLIGHT_REBOOT_SHUTDOWN)
        assert ack.result == 0

    def set(self, name: str, value: float | int) -> None:
        """PARAM_SET, until it is told; a whole number goes by its bytes."""
        kind = INT32 if isinstance(value, int) else REAL32
        (sent,) = struct.unpack("<f", struct.pack("<i", value)) if isinstance(value, int) else (value,)
        self.link.mav.param_set_send(self.system, 1, name.encode(), sent, kind)
        self.wait("PARAM_VALUE", lambda message: message.param_id == name)

    def read(self, name: str) -> float:
        """PARAM_REQUEST_READ."""
        self.link.mav.param_request_read_send(self.system, 1, name.encode(), -1)
        return float(self.wait("PARAM_VALUE", lambda message: message.param_id == name).param_value)


@contextlib.contextmanager
def station() -> Iterator[Station]:
    made = Station()
    with contextlib.closing(made.link):
        yield made


def flat(folder: Path, vehicles: int = 1) -> Path:
    """Vehicles without companions."""
    names = [f"uas{place}" for place in range(vehicles)]
    parts = [
        {"name": name, "model": "iris", "start": {"north_m": 0, "east_m": 5 * place, "heading_deg": 0}}
        for place, name in enumerate(names)
    ]
    scenario = {"name": "power", "world": {"kind": "flat"}, "vehicles": parts, "time_limit_s": 600}
    path = folder / "power.yaml"
    path.write_text(yaml.safe_dump(scenario))
    return path


def events(folder: Path) -> list[tuple[str, str]]:
    lines = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    return [(line["vehicle"], line["event"]) for line in lines]


def test_an_autopilot_of_a_run_reboots_with_its_parameters_and_its_shutdown_ends_the_run(tmp_path: Path) -> None:
    with Run(flat(tmp_path), tmp_path / "run", "--speed", "2") as run, station() as ground:
        ground.wait("HEARTBEAT", lambda heartbeat: heartbeat.system_status == STANDBY)
        ground.set("MPC_XY_CRUISE", 3.5)
        before_ms = ground.wait("ATTITUDE", lambda _attitude: True).time_boot_ms
        ground.wait("ATTITUDE", lambda attitude: attitude.time_boot_ms > before_ms + 3000)
        ground.power(REBOOT)
        ground.wait("ATTITUDE", lambda attitude: attitude.time_boot_ms < before_ms)
        ground.wait("HEARTBEAT", lambda heartbeat: heartbeat.system_status == STANDBY)
        assert ground.read("MPC_XY_CRUISE") == 3.5
        ground.power(SHUT_DOWN)
        assert run.wait(LIMIT_S) == 1
    assert events(run.out) == [("uas0", "autopilot rebooted"), ("uas0", "autopilot shut down")]
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "autopilot shut down: uas0"
    for log in ("uas0.ulg", "uas0-2.ulg"):
        assert "vehicle_attitude" in {dataset.name for dataset in ULog(str(run.out / log)).data_list}


def test_parameters_about_the_simulator_act_in_a_run_and_one_shutdown_leaves_the_others_flying(tmp_path: Path) -> None:
    with Run(flat(tmp_path, vehicles=2), tmp_path / "run", "--speed", "2") as run, station() as ground:
        ground.wait("GPS_RAW_INT", lambda gps: gps.satellites_visible == 16 and gps.fix_type >= 3)
        ground.set("SIM_GPS_USED", 3)
        ground.wait("GPS_RAW_INT", lambda gps: gps.satellites_visible == 3 and gps.fix_type < 3)
        ground.power(SHUT_DOWN)
        run.wait_until(lambda: events(run.out) == [("uas0", "autopilot shut down")])
        assert run.process.poll() is None


def test_in_lockstep_with_a_companion_a_reboot_loses_nothing_and_a_shutdown_is_the_outcome(tmp_path: Path) -> None:
    with Run(short_scenario(tmp_path, 600.0), tmp_path / "run", "--speed", "1") as run, station() as ground:
        ground.wait("HEARTBEAT", lambda _heartbeat: True)
        ground.power(REBOOT)
        run.wait_until(lambda: ("uas", "autopilot rebooted") in events(run.out))
        booted_ms = ground.wait("ATTITUDE", lambda _attitude: True).time_boot_ms
        ground.wait("ATTITUDE", lambda attitude: attitude.time_boot_ms > booted_ms + 1000)
        ground.power(SHUT_DOWN)
        assert run.wait(LIMIT_S) == 1
    assert ("uas", "autopilot shut down") in events(run.out)
    assert json.loads((run.out / "summary.json").read_text())["outcome"] == "autopilot shut down: uas"
