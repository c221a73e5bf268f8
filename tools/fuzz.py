"""Throw hostile datagrams by the million at flying vehicles, and tell what broke and whether memory grew.

    python -m tools.fuzz [--datagrams 2000000] [--seed 1] [--model sihsim_hex ...]

Half of them are well-formed nonsense (every message of the dialect, fields at random, NaN and at their limits), half is
recorded traffic, spoiled. A new vehicle takes off every 100 000 datagrams, and one that fell over is replaced at once.
Exit status 1 if anything broke: each failure is shown once, with the last datagram in hex.
"""

import argparse
import collections
import random
import resource
import sys
import tempfile
import time
import traceback
from pathlib import Path

from sitl_emu.autopilot.storage import storage
from tests import hostile

PER_VEHICLE = 100_000
PER_TICK = 40


def resident_mib() -> float:
    """Memory of this process now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


class Fuzz:
    """The vehicles in turn, and what was seen."""

    def __init__(self, models: list[str], seed: int) -> None:
        self._models, self._chance = models, random.Random(seed)
        self._vehicles = 0
        self.sent = 0
        self.failures: collections.Counter[str] = collections.Counter()

    def fly(self, datagrams: int) -> int:
        """One vehicle under so many datagrams, or until it breaks; how many it bore."""
        model = self._models[self._vehicles % len(self._models)]
        self._vehicles += 1
        with tempfile.TemporaryDirectory(prefix="sitl_emu-") as folder:
            root = Path(folder)
            storage.prepare(root)
            victim = hostile.Victim(model, root)
            seeds = victim.record()
            nonsense = hostile.Nonsense(self._chance, victim.heard, victim.autopilot.parameters.announced)
            data = b""
            for number in range(datagrams):
                data = nonsense.frame() if self._chance.random() < 0.5 else hostile.mutated(self._chance, seeds)
                try:
                    victim.autopilot.on_datagram(number % hostile.LINKS, data)
                    if number % PER_TICK == 0:
                        victim.keep_open()
                        victim.tick()
                        victim.check_topics()
                except Exception as error:  # whatever it is, it is what we look for
                    self._note(error, model, data, victim)
                    return number + 1
            if not victim.answers():
                self._note(AssertionError("it does not answer any more"), model, data, victim)
        return datagrams

    def _note(self, error: Exception, model: str, data: bytes, victim: hostile.Victim) -> None:
        last = traceback.extract_tb(error.__traceback__)[-1:]
        place = f"{Path(last[0].filename).name}:{last[0].lineno}" if last else ""
        kind = f"{type(error).__name__} {place}"
        self.failures[kind] += 1
        if self.failures[kind] == 1:
            print(f"\n{model}: {kind}: {error}\nlast datagram: {data[:300].hex()}")
            print(f"parameters that differ: {victim.autopilot.parameters.changed()}", flush=True)
            traceback.print_exception(error, limit=-5)


def main() -> int:
    """Run until all datagrams are sent; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--datagrams", type=int, default=2_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--model", nargs="+", default=["sihsim_hex", "sihsim_rover_ackermann"], dest="models")
    options = parser.parse_args()
    fuzz = Fuzz(options.models, options.seed)
    begin_s, begin_cpu_s = time.monotonic(), time.process_time()
    warm: tuple[float, int] | None = None
    while fuzz.sent < options.datagrams:
        fuzz.sent += fuzz.fly(min(PER_VEHICLE, options.datagrams - fuzz.sent))
        now = (resident_mib(), hostile.objects())
        warm = warm or now
        cpu_s = time.process_time() - begin_cpu_s
        print(
            f"{fuzz.sent:>9} datagrams, {fuzz.sent / cpu_s:.0f} per CPU second, {fuzz.failures.total()} failures, "
            f"{now[0]:.1f} MiB, {now[1]} objects, {time.monotonic() - begin_s:.0f} s",
            flush=True,
        )
    assert warm is not None
    print(f"memory after the first vehicle {warm[0]:.1f} MiB, at the end {resident_mib():.1f} MiB")
    for kind, count in fuzz.failures.most_common():
        print(f"{count:>6} × {kind}")
    return 1 if fuzz.failures else 0


if __name__ == "__main__":
    sys.exit(main())
