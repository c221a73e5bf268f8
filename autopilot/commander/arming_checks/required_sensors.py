"""Sensors that are to be there, by number: SYS_HAS_NUM_DIST, SYS_HAS_NUM_OF, SYS_HAS_NUM_GNSS (0: nobody asks).

PX4's distanceSensorChecks, opticalFlowCheck and gnssRedundancyCheck. Without the receivers that are wanted
COM_GNSSLOSS_ACT is flown (failsafe.py), and arming is forbidden where that does more than warn; the others always
forbid it.

Left out: a second receiver of our own, and how far two of them disagree.
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.sensors.distance_sensors import distance_sensors
from sitl_emu.autopilot.topics import Topics

FRESH_US: Final = 1_000_000
FIX_3D: Final = 3
MOST_DISTANCE_SENSORS: Final = 10
"""ORB_MULTI_MAX_INSTANCES (uORB.h): PX4 asks for no more, whatever SYS_HAS_NUM_DIST says."""
MOST_RECEIVERS: Final = 2
"""GPS_MAX_INSTANCES: there are no more to be missed."""


def check_sight(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Distance sensors, in the order of ours, and optical flow, of which there are no texts."""
    ages_us = [now_us - sensor.timestamp for sensor in distance_sensors(topics) if sensor.timestamp]
    for number in range(min(settings.sys_has_num_dist, MOST_DISTANCE_SENSORS)):
        event, text = "check_distance_sensor_missing", f"Preflight Fail: Distance Sensor {number} missing"
        if number < len(ages_us):
            event, text = "check_distance_sensor_invalid", f"Preflight Fail: No valid distance sensor {number} data"
            if ages_us[number] < FRESH_US:
                continue
        failure = ALL_MODES, Component.DISTANCE_SENSOR, Severity.ERROR, event, number
        findings.health_failure(*failure, text=text)
    seen_us = topics.vehicle_optical_flow.timestamp
    if settings.sys_has_num_of and not (seen_us and now_us - seen_us < FRESH_US):
        event = "check_optical_flow_sensor_invalid" if seen_us else "check_optical_sensor_missing"
        findings.health_failure(ALL_MODES, Component.OPTICAL_FLOW, Severity.ERROR, event)
    if settings.sys_has_num_dist > 0 and ages_us:
        findings.health_present |= Component.DISTANCE_SENSOR
    if settings.sys_has_num_of and seen_us:
        findings.health_present |= Component.OPTICAL_FLOW


def check_receivers(now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
    """Events alone; each receiver that lacks a fix, but those that are not wanted."""
    gps, wanted = topics.sensor_gps, settings.sys_has_num_gnss
    online = gps.timestamp > 0 and now_us - gps.timestamp < FRESH_US
    fixed = online and gps.fix_type >= FIX_3D
    if wanted <= int(fixed):
        return
    findings.gnss_lost = True
    forbids = settings.com_gnssloss_act > 0
    modes, level = (ALL_MODES, Severity.ERROR) if forbids else (NO_MODE, Severity.WARNING)
    for receiver in range(int(fixed), min(wanted, MOST_RECEIVERS)):
        event = "check_gnss_receiver_no_fix" if receiver == 0 and online else "check_gnss_receiver_offline"
        findings.health_failure(modes, Component.GPS, level, event, receiver)
