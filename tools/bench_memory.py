"""Memory of a fleet: its proportional set size after boot and in hover, and what kind of memory it is.

    python tools/bench_memory.py [VEHICLES] [MODEL] [--apart | --per-process N]

Launches the vehicles (20 `sihsim_hex`) with one `sitl-emu launch`, N in a process, or with `--apart` each with its own,
as another benchmark does that knows nothing of ours; waits until all are armable, takes them into the air and lets them
hover for half a minute of simulated time. PSS counts a page that n processes share as 1/n in each, so that the sum is
what the fleet takes of the machine (/proc/PID/smaps, Linux). In hover it tells the processor time of all, too, and how
fast they flew.
"""

import argparse
import contextlib
import os
import re
import socket
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for tests.launched

from sitl_emu.core import dialect as mavlink
from sitl_emu.core import ports
from tests.launched import launched

READY_LIMIT_S = 300.0
HOVER_S = 30.0
"""Of the vehicles' time, after take-off began."""
STANDBY, ACTIVE = 3, 4
FIRST_INSTANCE = 0
MIB = 1024.0
"""KiB in a MiB: smaps counts in KiB."""


class Station:
    """A ground station of one vehicle: says that it is there, and reads the vehicle's state and clock."""

    def __init__(self, instance: int) -> None:
        gcs = ports.gcs(instance)
        self.system = ports.system_id(instance)
        self.state, self.boot_ms = 0, 0
        self._there = ("127.0.0.1", gcs.local)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._coder = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)

    def say(self, message: mavlink.MAVLink_message) -> None:
        """To the vehicle."""
        self._socket.sendto(message.pack(self._coder), self._there)

    def heartbeat(self) -> None:
        """The link stays alive, and its vehicle knows where to send."""
        self.say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, ACTIVE, 3))

    def take_off(self) -> None:
        """Arm, and climb to MIS_TAKEOFF_ALT."""
        nan = float("nan")
        self.say(mavlink.MAVLink_command_long_message(self.system, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
        self.say(mavlink.MAVLink_command_long_message(self.system, 1, 22, 0, nan, nan, nan, nan, nan, nan, nan))

    def listen(self) -> None:
        """Take in what has come."""
        with contextlib.suppress(BlockingIOError):
            while True:
                self._on_datagram(self._socket.recv(65535))

    def _on_datagram(self, data: bytes) -> None:
        for message in self._coder.parse_buffer(bytearray(data)) or ():
            if message.get_type() == "HEARTBEAT" and message.get_srcComponent() == 1:
                self.state = message.system_status
            elif message.get_type() == "ATTITUDE":
                self.boot_ms = message.time_boot_ms


@contextlib.contextmanager
def fleet(count: int, model: str, apart: bool, per_process: int) -> Iterator[list[int]]:
    """Launch the vehicles; the processes of the launchers."""
    with contextlib.ExitStack() as stack:
        if apart:
            each = [stack.enter_context(launched(model, "--instance", str(index))) for index in range(count)]
        else:
            each = [stack.enter_context(launched(f"{model}:{count}", "--per-process", str(per_process)))]
        yield [process.pid for process in each]


def family(launchers: list[int]) -> list[int]:
    """The launchers and the vehicles that they forked."""
    found = list(launchers)
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if entry.name.isdigit() and int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1]) in launchers:
                found.append(int(entry.name))
    return found


def cpu_s(launchers: list[int]) -> float:
    """Processor time that they have had, in user and kernel."""
    ticks = 0
    for pid in family(launchers):
        utime, stime = (Path("/proc") / str(pid) / "stat").read_text().rsplit(")", 1)[1].split()[11:13]
        ticks += int(utime) + int(stime)
    return ticks / os.sysconf("SC_CLK_TCK")


def kind_of(mapping: str) -> str:
    """What a mapping holds, from its name in smaps."""
    if mapping in ("[heap]", ""):
        return "heap" if mapping else "anonymous"
    return "libraries" if mapping.startswith("/") else "other"


def memory(pids: list[int]) -> tuple[Counter[str], Counter[str]]:
    """PSS and private memory in KiB, by kind of mapping."""
    pss, private = Counter[str](), Counter[str]()
    for pid in pids:
        kind = ""
        for line in Path(f"/proc/{pid}/smaps").read_text().splitlines():
            if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
                kind = kind_of(line[73:].strip())
            elif line.startswith("Pss:"):
                pss[kind] += int(line.split()[1])
            elif line.startswith("Private_"):
                private[kind] += int(line.split()[1])
    return pss, private


def report(title: str, pids: list[int]) -> None:
    """One line of the table."""
    pss, private = memory(pids)
    kinds = ", ".join(f"{kind} {pss[kind] / MIB:.0f} ({private[kind] / MIB:.0f})" for kind in sorted(pss))
    print(f"{title:12} {pss.total() / MIB:8.0f} MiB PSS ({private.total() / MIB:.0f} private): {kinds}", flush=True)


def wait(stations: list[Station], launchers: list[int], done: str) -> None:
    """Talk to the vehicles until each is `armable`, or has flown for HOVER_S (`flown`)."""
    end_s, beat_s, most = time.monotonic() + READY_LIMIT_S, 0.0, 0
    begin_ms = [station.boot_ms for station in stations]
    while time.monotonic() < end_s:
        if time.monotonic() > beat_s:
            beat_s = time.monotonic() + 0.5
            for station in stations:
                station.heartbeat()
            processes = len(family(launchers))
            most = max(most, processes)  # a launcher forks them one after the other
            if processes < most:
                sys.exit("bench_memory: a vehicle has ended")
        for station in stations:
            station.listen()
        if done == "armable" and all(station.state == STANDBY and station.boot_ms for station in stations):
            return
        if done == "flown" and all(
            station.boot_ms - begin > HOVER_S * 1000 and station.state == ACTIVE
            for station, begin in zip(stations, begin_ms, strict=True)
        ):
            return
        time.sleep(0.01)
    sys.exit(f"bench_memory: not all vehicles were {done} within {READY_LIMIT_S:.0f} s: {[s.state for s in stations]}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("vehicles", type=int, nargs="?", default=20)
    parser.add_argument("model", nargs="?", default="sihsim_hex")
    parser.add_argument("--apart", action="store_true", help="each vehicle by a launch of its own")
    parser.add_argument("--per-process", type=int, default=1, metavar="N", help="vehicles that share a process")
    wanted = parser.parse_args()
    stations = [Station(FIRST_INSTANCE + index) for index in range(wanted.vehicles)]
    how = "a launch each" if wanted.apart else f"one launch, {wanted.per_process} in a process"
    print(f"{wanted.vehicles} {wanted.model}, {how}; PSS (private) in MiB")
    with fleet(wanted.vehicles, wanted.model, wanted.apart, wanted.per_process) as launchers:
        wait(stations, launchers, "armable")
        report("after boot", family(launchers))
        for station in stations:
            station.take_off()
        spent_s, began_s = cpu_s(launchers), time.monotonic()
        begin_ms = [station.boot_ms for station in stations]
        wait(stations, launchers, "flown")
        spent_s, passed_s = cpu_s(launchers) - spent_s, time.monotonic() - began_s
        flown_s = sum(s.boot_ms - begin for s, begin in zip(stations, begin_ms, strict=True)) / 1e3
        report("in hover", family(launchers))
        each_ms, factor = spent_s / flown_s * 1e3, flown_s / len(stations) / passed_s
        print(f"{'':12} {each_ms:8.1f} ms of CPU per vehicle and simulated second, {factor:.2f} x real time")


if __name__ == "__main__":
    main()
