"""The process of one run of a campaign: `sitl-emu run` for a job that comes as a line of JSON on standard input.

When standard input is closed, whoever asked for the run wants it no more, or is no more: the run is ended as by
SIGTERM. Exit status 0 and 1 as `sitl-emu run`; 2 and 4 as in `flight.py`, with the reason in the last line.
"""

import json
import os
import signal
import sys
import threading
from pathlib import Path
from typing import NoReturn

from sitl_emu.run import checks, output, preflight, run_command, wiring
from sitl_emu.run.campaign.flight import EXIT_ACCIDENT, EXIT_REFUSED, Job
from sitl_emu.run.scenario import checked
from sitl_emu.run.trouble import Trouble


def main() -> NoReturn:
    """Fly the job."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = Job(**json.loads(sys.stdin.buffer.readline()))
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        status, said = fly(job)
    except Trouble as error:
        status, said = EXIT_REFUSED, str(error)
    print(" ".join(said.split()), flush=True)
    sys.exit(status)


def fly(job: Job) -> tuple[int, str]:
    """Exit status, and what is to be said last. Raises Trouble."""
    path = Path(job.folder) / "scenario.yaml"
    scenario = checked(dict(job.scenario), path)
    world = checks.check(scenario, job.seed, path)
    preflight.check(scenario, 0, isolated=job.isolated)
    folder = run_command.make_folder(Path(job.folder), scenario.name)
    wanted = wiring.Wanted(scenario, job.seed, None, folder, isolated=job.isolated)
    run_command.write_inputs(wanted, world)
    status, ending = run_command.fly(wanted, world, output.console())
    if ending.refused:
        return EXIT_REFUSED, ending.complaint
    return (EXIT_ACCIDENT, ending.complaint) if ending.accident else (status, f"seed {job.seed}")


def _end_with_input() -> None:
    while os.read(sys.stdin.fileno(), 1):  # not sys.stdin.read, whose lock this thread would hold at Python's end
        continue
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    main()
