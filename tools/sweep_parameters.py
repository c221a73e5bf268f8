"""Set every parameter to its extremes in every phase of a flight, and tell what broke.

    python -m tools.sweep_parameters [--scene hex rover ...] [--ticks 25] [--combinations 200] [--seed 1]

Each parameter that the scene's vehicle has read is set to each extreme (infinite, huge, tiny, zero, negative), one at a
time, and then ten at a time as drawn; the vehicle flies on from the same moment for so many ticks of 4 ms each. Exit
status 1 if anything broke: each failure is shown once, with the values that were set.
"""

import argparse
import collections
import gc
import sys
import time

from tests import extremes


def sweep(scene: extremes.Scene, options: argparse.Namespace, failures: collections.Counter[str]) -> None:
    """All cases of a scene; tells each new failure at once."""
    begin_s = time.monotonic()
    flight = extremes.Flight(scene)
    gc.collect()
    gc.freeze()  # forks then share what is there
    names = flight.read()
    drawn = extremes.combinations(flight.parameters, names, options.seed, options.combinations)
    count = broken = 0
    for case in (*extremes.singles(flight.parameters, names), *drawn):
        error = flight.tried(case, options.ticks)
        count += 1
        if error:
            broken += 1
            place = extremes.place_of(error)
            failures[place] += 1
            if failures[place] == 1:
                print(f"\n{error}", flush=True)
    print(
        f"{scene.name}: {len(names)} parameters, {count} cases, {broken} broke, {time.monotonic() - begin_s:.0f} s",
        flush=True,
    )


def main() -> int:
    """Run the scenes; the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.sweep_parameters", description=(__doc__ or "").split("\n\n")[0]
    )
    parser.add_argument("--scene", nargs="+", default=[""], dest="scenes", help="parts of scenes' names")
    parser.add_argument("--ticks", type=int, default=25)
    parser.add_argument("--combinations", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    failures: collections.Counter[str] = collections.Counter()
    for scene in extremes.SCENES:
        if any(part in scene.name for part in options.scenes):
            sweep(scene, options, failures)
    for place, count in failures.most_common():
        print(f"{count:>6} × {place}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
