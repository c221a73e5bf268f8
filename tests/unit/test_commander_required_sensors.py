"""Sensors of which a number has to be there, before arming and in flight; a receiver's calibration."""

from typing import Any

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import DistanceSensorSample, SensorGps, VehicleOpticalFlow

from .navigation_fake import FakeVehicle, settled
from .test_commander_arming_checks import check
from .test_commander_failsafe import flying

OLD_US, NEW_US = 5_000_000, 7_000_000


def failures(vehicle: FakeVehicle) -> list[tuple[str, tuple[float, ...]]]:
    check(vehicle)
    found = vehicle.commander._checks._findings.failures
    return [(each.event, each.arguments) for each in found if "sensor" in each.event or "gnss" in each.event]


@pytest.mark.parametrize(
    ("parameters", "topics", "expected"),
    [
        ({}, {}, []),
        ({"SYS_HAS_NUM_DIST": 2**31 - 1}, {}, [("check_distance_sensor_missing", (n,)) for n in range(10)]),
        ({"SYS_HAS_NUM_DIST": 1}, {}, [("check_distance_sensor_missing", (0,))]),
        (
            {"SYS_HAS_NUM_DIST": 2},
            {"distance_sensors_outside": (DistanceSensorSample(OLD_US),)},
            [("check_distance_sensor_invalid", (0,)), ("check_distance_sensor_missing", (1,))],
        ),
        ({"SYS_HAS_NUM_DIST": 1}, {"distance_sensor": DistanceSensorSample(NEW_US)}, []),
        (
            {"SYS_HAS_NUM_DIST": 4},
            {
                "distance_sensor": DistanceSensorSample(NEW_US),
                "distance_sensors_outside": (DistanceSensorSample(NEW_US), DistanceSensorSample(OLD_US)),
            },
            [("check_distance_sensor_invalid", (2,)), ("check_distance_sensor_missing", (3,))],
        ),
        ({"SYS_HAS_NUM_OF": 1}, {}, [("check_optical_sensor_missing", ())]),
        (
            {"SYS_HAS_NUM_OF": 1},
            {"vehicle_optical_flow": VehicleOpticalFlow(OLD_US)},
            [("check_optical_flow_sensor_invalid", ())],
        ),
        ({"SYS_HAS_NUM_OF": 1}, {"vehicle_optical_flow": VehicleOpticalFlow(NEW_US)}, []),
        ({"SYS_HAS_NUM_GNSS": 1}, {"sensor_gps": SensorGps(NEW_US, fix_type=3)}, []),
        (
            {"SYS_HAS_NUM_GNSS": 1},
            {"sensor_gps": SensorGps(NEW_US, fix_type=2)},
            [("check_gnss_receiver_no_fix", (0,))],
        ),
        (
            {"SYS_HAS_NUM_GNSS": 1},
            {"sensor_gps": SensorGps(OLD_US, fix_type=3)},
            [("check_gnss_receiver_offline", (0,))],
        ),
        (
            {"SYS_HAS_NUM_GNSS": 2},
            {"sensor_gps": SensorGps(NEW_US, fix_type=3)},
            [("check_gnss_receiver_offline", (1,))],
        ),
    ],
)
def test_what_is_not_there_is_told(
    parameters: dict[str, float], topics: dict[str, Any], expected: list[tuple[str, tuple[float, ...]]]
) -> None:
    vehicle = settled(**parameters)
    for name, record in topics.items():
        setattr(vehicle.topics, name, record)
    assert failures(vehicle) == expected


@pytest.mark.parametrize(("com_gnssloss_act", "may_arm"), [(0, True), (1, False)])
def test_a_receiver_that_is_missing_forbids_arming_where_its_loss_would_end_the_flight(
    com_gnssloss_act: int, may_arm: bool
) -> None:
    vehicle = settled(SYS_HAS_NUM_GNSS=2, COM_GNSSLOSS_ACT=com_gnssloss_act)
    check(vehicle)
    assert bool(vehicle.topics.health_report.can_arm_mode_flags) is may_arm


@pytest.mark.parametrize(
    ("com_gnssloss_act", "mode"),
    [(0, NavState.AUTO_LOITER), (1, NavState.AUTO_RTL), (2, NavState.AUTO_LAND), (3, NavState.TERMINATION)],
)
def test_a_receiver_that_is_lost_in_flight(com_gnssloss_act: int, mode: NavState) -> None:
    """COM_GNSSLOSS_ACT; the filter goes on without it here."""
    vehicle = flying(COM_GNSSLOSS_ACT=com_gnssloss_act)
    vehicle.parameters.set("SYS_HAS_NUM_GNSS", 2)
    vehicle.run(6.0)
    assert vehicle.mode is mode


@pytest.mark.parametrize(
    ("parameter", "value", "com_rc_in_mode", "texts"),
    [
        ("RC3_TRIM", 900, 3, ["Preflight Fail: RC ERROR: RC3_TRIM < MIN (900/1000)"]),
        ("RC3_TRIM", 2100, 0, ["Preflight Fail: RC ERROR: RC3_TRIM > MAX (2100/2000)"]),
        ("RC18_MAX", 2501, 3, ["Preflight Fail: RC ERROR: RC18_MAX > 2500"]),
        ("RC18_MIN", -1, 3, ["Preflight Fail: RC ERROR: RC18_MIN < 0"]),
        ("RC3_TRIM", 900, 1, []),
        ("RC3_TRIM", 900, 4, []),
    ],
)
def test_a_channel_has_its_centre_between_its_ends(
    parameter: str, value: int, com_rc_in_mode: int, texts: list[str]
) -> None:
    vehicle = settled(COM_RC_IN_MODE=com_rc_in_mode)
    vehicle.parameters.set(parameter, value)
    check(vehicle)
    assert vehicle.take_texts() == texts
