"""What scouts are told of their targets: each report goes to whoever asked, until it is acknowledged.

One report at a time goes to each system, as an acknowledgement does not say which it is for (`report.py`).
"""

from collections import defaultdict, deque

from sitl_emu.gcs.command import Command
from sitl_emu.missions.agriculture.jobs import Asker, Job
from sitl_emu.missions.agriculture.report import Report, Result, command_of
from sitl_emu.missions.companion.companion import PEER_LINK
from sitl_emu.missions.companion.onboard import Onboard


class Reports:
    """All reports of one UGV."""

    def __init__(self, onboard: Onboard) -> None:
        self._onboard = onboard
        self._waiting: defaultdict[int, deque[Report]] = defaultdict(deque)
        """What each system is still to be told, in order."""
        self._telling: dict[int, Command] = {}
        """The report that each system is being told."""

    @property
    def idle(self) -> bool:
        """Whether all has been told."""
        return not any(self._waiting.values()) and not self._telling

    def tell(self, job: Job, result: Result) -> None:
        """All who asked for a job are to be told how it stands."""
        for asker in job.askers:
            self.tell_one(asker, job, result)

    def tell_one(self, asker: Asker, job: Job, result: Result) -> None:
        """One who asked for a job is to be told how it stands."""
        self._waiting[asker.system].append(job.report_to(asker, result))

    def on_time(self) -> None:
        """Goes on: a report that was not taken is noted, and the next one sent."""
        for system, command in list(self._telling.items()):
            if command.outcome is not None:
                del self._telling[system]
                if not command.outcome.accepted:
                    text = f"report to system {system}: {command.outcome.text}"
                    self._onboard.note("failed", text, system=system)
        for system, reports in self._waiting.items():
            if reports and system not in self._telling:
                self._telling[system] = command_of(system, reports.popleft())
                self._onboard.start(PEER_LINK, self._telling[system])
