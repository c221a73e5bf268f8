"""Components that a flight may need: a parachute, a remote id, traffic avoidance, a mission computer."""

import pytest

from sitl_emu.autopilot.commander.arming_checks.findings import Component
from sitl_emu.autopilot.constants import NavState

from .navigation_fake import FakeVehicle, item, settled


@pytest.mark.parametrize(
    ("parameter", "value", "may_arm", "texts"),
    [
        ("COM_PARACHUTE", 0, True, []),
        ("COM_PARACHUTE", 1, True, []),
        ("COM_PARACHUTE", 2, False, ["Preflight Fail: Parachute system missing"]),
        ("COM_ARM_ODID", 0, True, []),
        ("COM_ARM_ODID", 1, True, ["Preflight Fail: Open Drone ID system missing"]),
        ("COM_ARM_ODID", 3, False, ["Preflight Fail: Open Drone ID system missing"]),
        ("COM_ARM_TRAFF", 0, True, []),
        ("COM_ARM_TRAFF", 1, True, ["Preflight Fail: Traffic avoidance system missing"]),
        ("COM_ARM_TRAFF", 2, False, ["Preflight Fail: Traffic avoidance system missing"]),
        ("COM_ARM_TRAFF", 3, True, ["Preflight Fail: Traffic avoidance system missing"]),
    ],
)
def test_components_that_a_flight_may_need(parameter: str, value: int, may_arm: bool, texts: list[str]) -> None:
    vehicle = settled()
    vehicle.parameters.set(parameter, value)
    vehicle.run(0.2)
    assert bool(vehicle.topics.health_report.can_arm_mode_flags >> NavState.AUTO_LOITER & 1) is may_arm
    assert vehicle.take_texts() == texts


def test_a_parachute_is_the_recovery_system() -> None:
    """Well until somebody wants one (streams/SYS_STATUS.hpp: fillOutComponent)."""

    def recovery_system() -> tuple[int, int, int]:
        vehicle.run(0.2)
        report = vehicle.topics.health_report
        return report.present_extended, report.enabled_extended, report.health_extended

    vehicle = settled()
    assert recovery_system() == (0, 0, 1)
    vehicle.parameters.set("COM_PARACHUTE", 1)
    assert recovery_system() == (0, 1, 0)
    heartbeats = vehicle.topics.gcs_heartbeats
    vehicle.topics.gcs_heartbeats = heartbeats._replace(parachute_us=vehicle.now_us, parachute_healthy=True)
    assert recovery_system() == (1, 1, 1)
    vehicle.topics.gcs_heartbeats = heartbeats._replace(parachute_us=vehicle.now_us, parachute_healthy=False)
    assert recovery_system() == (1, 1, 0)


def test_without_a_traffic_avoidance_system_a_mission_alone_is_refused() -> None:
    vehicle = settled(COM_ARM_TRAFF=3)
    vehicle.upload(item(22, 0, 0, 10), item(16, 20, 0, 10), item(20))
    vehicle.run(0.2)
    assert vehicle.set_mode(4, 4) == 0
    assert vehicle.arm() == 1
    vehicle.topics.gcs_heartbeats = vehicle.topics.gcs_heartbeats._replace(adsb_us=vehicle.now_us)
    assert vehicle.arm() == 0


def all_are_heard(vehicle: FakeVehicle) -> None:
    now_us = vehicle.now_us
    vehicle.topics.gcs_heartbeats = vehicle.topics.gcs_heartbeats._replace(
        onboard_us=now_us, parachute_us=now_us, open_drone_id_us=now_us, adsb_us=now_us
    )


def test_a_remote_id_is_never_told_as_present() -> None:
    """PX4's openDroneIDCheck.cpp has no setIsPresent; COM_PARACHUTE's has one."""
    vehicle = settled(COM_ARM_ODID=1, COM_PARACHUTE=1)
    all_are_heard(vehicle)
    vehicle.run(0.2)
    present = vehicle.commander._checks._findings.health_present
    assert (present & Component.PARACHUTE, present & Component.OPEN_DRONE_ID) == (Component.PARACHUTE, 0)


def test_components_come_and_go() -> None:
    """PX4's Commander::dataLinkCheck: a heartbeat is told of for 2.36 s; 3 or 5 s later it is missed."""
    vehicle = settled()
    all_are_heard(vehicle)
    vehicle.run(5.3)
    assert vehicle.take_texts() == []
    vehicle.run(0.5)
    assert "Traffic avoidance system lost\t" not in vehicle.said  # nobody wants one
    assert [text for text in vehicle.take_texts() if text.endswith("lost")] == [
        "Parachute system lost",
        "Remote ID system lost",
    ]
    vehicle.parameters.set("COM_ARM_TRAFF", 3)
    vehicle.run(1.5)
    assert [text for text in vehicle.take_texts() if text.endswith("lost")] == ["Traffic avoidance system lost"]
    vehicle.run(0.2)
    assert [text for text in vehicle.take_texts() if text.endswith("lost")] == ["Connection to mission computer lost"]
    all_are_heard(vehicle)
    vehicle.run(1.0)
    assert vehicle.take_texts() == [
        "Onboard controller regained",
        "Parachute system regained",
        "Remote ID system regained",
        "Traffic avoidance system regained",
    ]
