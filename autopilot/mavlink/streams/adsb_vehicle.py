"""ADSB_VEHICLE: aircraft nearby that others told of, told again (PX4: streams/ADSB_VEHICLE.hpp)."""

import math

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.autopilot.topics import TransponderReport
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import float32, product, truncated

ID = mavlink.MAVLINK_MSG_ID_ADSB_VEHICLE


def since(context: Context, number: int) -> tuple[int, list[Fields]]:
    """Every report once."""
    reports = context.topics.transponder_reports
    if not reports or reports[-1].number == number:
        return number, []
    new = (report for report in reports if report.number > number and report.retranslate)
    return reports[-1].number, [_message(report) for report in new]


def fields(now_us: int, context: Context) -> Fields | None:
    """Reports are told as they come, and not on request."""
    return None


def _message(report: TransponderReport) -> Fields:
    """1e-7 deg, mm, cdeg, cm/s; fractions are cut off, so that most numbers come out as they came in, or one less."""
    turns = float32(float32(report.heading) / float32(math.pi))
    return (
        report.icao_address,
        truncated(report.lat * 1e7),
        truncated(report.lon * 1e7),
        truncated(product(report.altitude, 1e3)),
        truncated(product(product(turns, 180.0), 100.0)),
        truncated(product(report.hor_velocity, 100.0)),
        truncated(product(report.ver_velocity, 100.0)),
        report.flags,
        report.squawk,
        report.altitude_type,
        report.callsign,
        report.emitter_type,
        report.tslc,
    )
