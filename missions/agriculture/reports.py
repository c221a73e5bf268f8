"""What scouts are told of their targets: each report goes to whoever asked, until it is acknowledged.

One report at a time goes to each system, as an acknowledgement does not say which it is for (`report.py`). Where none
comes, the system is told anew when it is heard again: who has waited through a longer silence still waits for it.
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
        self._telling: dict[int, tuple[Command, Report]] = {}
        """The report that each system is being told."""
        self._unheard_us: dict[int, int] = {}
        """When it was given up to tell a system, of those that are to be heard again first."""

    @property
    def idle(self) -> bool:
        """Whether all has been told, to those that are heard."""
        waiting = any(reports for system, reports in self._waiting.items() if system not in self._unheard_us)
        return not waiting and not self._telling

    def tell(self, job: Job, result: Result) -> None:
        """All who asked for a job are to be told how it stands."""
        for asker in job.askers:
            self.tell_one(asker, job, result)

    def tell_one(self, asker: Asker, job: Job, result: Result) -> None:
        """One who asked for a job is to be told how it stands."""
        self._waiting[asker.system].append(job.report_to(asker, result))

    def on_time(self) -> None:
        """Goes on: a report that was not taken is noted, and the next one sent."""
        for system, (command, report) in list(self._telling.items()):
            if command.outcome is not None:
                del self._telling[system]
                if command.outcome.result is None:
                    self._waiting[system].appendleft(report)
                    self._unheard_us[system] = self._onboard.now_us
                if not command.outcome.accepted:
                    text = f"report to system {system}: {command.outcome.text}"
                    self._onboard.note("failed", text, system=system)
        for system, reports in self._waiting.items():
            peer, since_us = self._onboard.peer.peers.get(system), self._unheard_us.get(system)
            if since_us is not None and peer is not None and peer.heard_us > since_us:
                del self._unheard_us[system]
            if reports and system not in self._telling and system not in self._unheard_us:
                report = reports.popleft()
                command = command_of(system, report)
                self._telling[system] = command, report
                self._onboard.start(PEER_LINK, command)
