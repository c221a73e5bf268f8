"""The UGV's report on a target: a COMMAND_INT between the two companions, acknowledged and retried.

MAVLink has no message for it, but a command for one's own use that carries a place: MAV_CMD_SPATIAL_USER_1
(https://mavlink.io/en/messages/common.html#MAV_CMD_SPATIAL_USER_1), sent from component 191 to component 191:
param1 is the result, param2 the detector's score, param3 the class (index in `LABELS`, -1 none), param4 the distance in
m between target and vehicle as its camera saw it (NaN if it did not); x and y repeat the latitude and longitude of the
NAV_WAYPOINT that was sent, exactly: they tell which target is meant. A target may be reported on more than once:
STARTED when the UGV sets out, PILOT_TOOK_OVER or FAILSAFE while somebody else has it, STARTED again when it is given
back, then what became of it.
"""

import math
from enum import IntEnum
from typing import NamedTuple

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.missions.companion.companion import COMPONENT_ID

SPATIAL_USER_1 = 31005
FRAME_GLOBAL_RELATIVE_ALT = 3
LABELS = ("weed", "disease")
TRIES = 40


class Result(IntEnum):
    """What became of the inspection, or how it stands."""

    NOT_SEEN = 0
    CONFIRMED = 1
    """Seen, with the label that the scout gave it."""
    NOT_REACHED = 2
    PILOT_TOOK_OVER = 3
    FAILSAFE = 4
    WRONG_LABEL = 5
    """Something was seen where the target should be, but with another label."""
    STARTED = 6


INTERIM = (Result.STARTED, Result.PILOT_TOOK_OVER, Result.FAILSAFE)
"""Results that another will follow, where the vehicle is given back."""


class Report(NamedTuple):
    """One report. `x`, `y`: the place of the target as it was asked for, 1e-7 deg."""

    result: Result
    score: float
    label: str
    distance_m: float
    x: int
    y: int


def command_of(system: int, report: Report) -> Command:
    """The command that carries a report to the companion of a system, tried for 20 s."""
    label = LABELS.index(report.label) if report.label in LABELS else -1
    params = (float(report.result), report.score, float(label), report.distance_m)
    place = (report.x, report.y, 0.0)
    return Command(system, COMPONENT_ID, SPATIAL_USER_1, params, place, FRAME_GLOBAL_RELATIVE_ALT, tries=TRIES)


def report_of(msg: mavlink.MAVLink_message) -> Report | None:
    """The report in a message, None if it is none."""
    if msg.get_type() != "COMMAND_INT" or msg.command != SPATIAL_USER_1:
        return None
    known = math.isfinite(msg.param1) and int(msg.param1) in list(Result)
    if not known or not math.isfinite(msg.param3):
        return None
    index = int(msg.param3)
    label = LABELS[index] if 0 <= index < len(LABELS) else ""
    return Report(Result(int(msg.param1)), msg.param2, label, msg.param4, msg.x, msg.y)


def ack_of(msg: mavlink.MAVLink_message, accepted: bool) -> mavlink.MAVLink_message:
    """The acknowledgement of a report's message."""
    result = mavlink.MAV_RESULT_ACCEPTED if accepted else mavlink.MAV_RESULT_DENIED
    return mavlink.MAVLink_command_ack_message(
        SPATIAL_USER_1, result, 0, 0, msg.get_srcSystem(), msg.get_srcComponent()
    )
