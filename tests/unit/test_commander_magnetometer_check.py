"""How many compasses arming wants, and which of them count."""

import pytest

from sitl_emu.autopilot.commander.arming_checks import magnetometer
from sitl_emu.autopilot.commander.arming_checks.findings import Findings
from sitl_emu.core import dialect as mavlink

from .navigation_fake import settled


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"SYS_HAS_MAG": 2}, "Preflight Fail: Found 1 compass (required: 2)"),
        ({"CAL_MAG0_PRIO": 0}, "Preflight Fail: Found 0 compass (required: 1)"),
        ({"CAL_MAG0_PRIO": -1}, "Preflight Fail: Found 0 compass (required: 1)"),
        ({"CAL_MAG0_PRIO": -1, "CAL_MAG0_ID": 0}, "Preflight Fail: Compass 0 uncalibrated"),
        ({"CAL_MAG0_PRIO": 0, "SYS_HAS_MAG": 0}, None),
    ],
)
def test_as_many_compasses_as_sys_has_mag_says_are_calibrated_and_enabled(
    parameters: dict[str, int], text: str | None
) -> None:
    """Asked of a real PX4: a priority of -1, which is PX4's default, does not count."""
    vehicle = settled()
    for name, value in parameters.items():
        vehicle.parameters.set(name, value)
    vehicle.run(3.0)
    assert vehicle.take_texts() == ([] if text is None else [text])
    assert (vehicle.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0) is (text is None)


def test_a_compass_that_the_filter_has_stopped_using_is_told_with_its_event() -> None:
    vehicle = settled()
    flags = vehicle.topics.estimator_status_flags
    vehicle.topics.estimator_status_flags = flags._replace(cs_mag_fault=True)
    vehicle.run(0.2)
    assert "Compass needs calibration - Land now!\t" in vehicle.said


def test_a_compass_that_the_estimator_takes_for_faulty_forbids_arming() -> None:
    vehicle = settled()
    vehicle.topics.estimator_status_flags = vehicle.topics.estimator_status_flags._replace(cs_mag_fault=True)
    findings = Findings()
    magnetometer.check(vehicle.now_us, vehicle.topics, vehicle.commander._checks._settings, findings)
    assert list(findings.texts) == ["Preflight Fail: Compass 0 fault"]
