"""What `--dds` costs: processor time of an iris that hovers with it, beside one that hovers without, in real time.

    python tools/bench_dds_cpu.py [SECONDS] [INSTANCE]      # needs pip install 'sitl-emu[ros2]'

Two launches side by side, INSTANCE (40) with `--dds` and the next without; both take off, and the processor time that
their processes take is counted for SECONDS (60) of hovering, that of the DDS agent apart. Nobody listens on DDS: all is
written then, and nothing sent. Shares are of the time that was simulated meanwhile, which a machine that can't follow
makes less of: its speed is told, too.
"""

import argparse
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for tests.launched and tools.bench_memory

from sitl_emu import compiled
from tests.launched import launched
from tools.bench_memory import ACTIVE, STANDBY, Station, cpu_s, family

READY_LIMIT_S = 120.0
CLIMB_S = 20.0
LOOK_S = 0.1
BEAT_S = 1.0


def wait(stations: list[Station], seconds: float) -> None:
    """Keep the links alive for a time."""
    end_s, beat_s = time.monotonic() + seconds, 0.0
    while time.monotonic() < end_s:
        if time.monotonic() >= beat_s:
            beat_s = time.monotonic() + BEAT_S
            for station in stations:
                station.heartbeat()
        for station in stations:
            station.listen()
        time.sleep(LOOK_S)


def until(stations: list[Station], state: int) -> None:
    """Wait until all are in a state; ends the process where they don't get there."""
    end_s = time.monotonic() + READY_LIMIT_S
    while any(station.state < state for station in stations):
        wait(stations, BEAT_S)
        if state == ACTIVE:
            for station in stations:
                if station.state < state:
                    station.take_off()
        if time.monotonic() > end_s:
            sys.exit("they do not fly")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seconds", type=float, nargs="?", default=60.0, help="of hovering, 60")
    parser.add_argument("instance", type=int, nargs="?", default=40, help="of the one with --dds, 40")
    wanted = parser.parse_args()
    seconds, instance = wanted.seconds, wanted.instance
    with (
        launched("iris", "--dds", "--instance", str(instance)) as told,
        launched("iris", "--instance", str(instance + 1)) as silent,
    ):
        stations = [Station(instance), Station(instance + 1)]
        until(stations, STANDBY)
        until(stations, ACTIVE)
        wait(stations, CLIMB_S)
        agents = [pid for pid in family([told.pid]) if pid != told.pid]
        before = cpu_s([told.pid]), cpu_s(agents), cpu_s([silent.pid])
        began_s, began_ms = time.monotonic(), [station.boot_ms for station in stations]
        wait(stations, seconds)
        took_s = time.monotonic() - began_s
        after = cpu_s([told.pid]), cpu_s(agents), cpu_s([silent.pid])
        flown_s = [(station.boot_ms - ms) / 1000.0 for station, ms in zip(stations, began_ms, strict=True)]
    times_s = (flown_s[0], flown_s[0], flown_s[1])
    both, agent, without = (
        100.0 * (end - begin) / time_s for begin, end, time_s in zip(before, after, times_s, strict=True)
    )
    how = "compiled" if compiled.in_use() else "plain Python"
    speed = min(flown_s) / took_s
    print(f"{how}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, {speed:.2f} of real time")
    print(f"without --dds: {without:.1f} % of a core")
    print(f"with --dds: {both - agent:.1f} %, and its agent {agent:.1f} %")


if __name__ == "__main__":
    main()
