"""work_queue: PX4's threads and what runs in each (PX4: systemcmds/work_queue, WorkQueueManager.cpp).

Here modules run one after the other in a single thread, so that there are no queues to list.
"""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, usage
from sitl_emu.autopilot.shell.commands.module import COMMANDS

STATUS = "\nWork Queue: 0  threads                          RATE        INTERVAL\n"


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`work_queue status`; nothing is started or stopped."""
    if len(arguments) != 1:
        yield usage("work_queue", COMMANDS)
        return FAILURE
    if arguments[0] == "status":
        yield STATUS
    elif arguments[0] not in dict(COMMANDS):
        yield usage("work_queue", COMMANDS)
    return SUCCESS
