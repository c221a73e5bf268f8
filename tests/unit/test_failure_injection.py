"""INJECT_FAILURE: which failures there are, how they are kept, what nonsense does (PX4's failure_injection_manager)."""

import math

import pytest

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.system.failure_injection import FailureInjectionManager
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.unit.mavlink_peer import GCS, GIMBAL, ONBOARD, PAYLOAD, Peer, command_long, only

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
GYRO, ACCEL, MAG, BARO, GPS, VIO, AIRSPEED, BATTERY, MOTOR = 0, 1, 2, 3, 4, 6, 8, 100, 101
OK, OFF, STUCK, WRONG = 0, 1, 2, 4
KINDS = {
    **dict.fromkeys((GYRO, ACCEL, MAG, BARO), frozenset((OK, OFF, STUCK))),
    **dict.fromkeys((GPS, AIRSPEED, MOTOR), frozenset((OK, OFF, STUCK, WRONG))),
    **dict.fromkeys((VIO, BATTERY), frozenset((OK, OFF))),
}
"""PX4 v1.18's FailureTable::isSupported."""
UNITS = (*range(10), *range(100, 107))


class Bench:
    def __init__(self, enabled: int = 1) -> None:
        self.topics = Topics()
        self.manager = FailureInjectionManager(
            self.topics, Parameters(VehicleKind.MULTICOPTER, {"SYS_FAILURE_EN": enabled})
        )

    def inject(self, unit: float, kind: float, instance: float = 0.0) -> int:
        """The answer, which names nobody where it is the manager's own."""
        asked = VehicleCommand(420, unit, kind, instance, source_system=255, source_component=190)
        refused = self.manager.handle_command(0, asked)
        if refused is not None:
            return refused.result
        (ack,), self.topics.vehicle_command_acks = self.topics.vehicle_command_acks, ()
        assert (ack.command.source_system, ack.command.source_component) == (0, 0)
        return ack.result

    def kind(self, unit: int, instance: int = 1) -> int:
        return self.topics.failure_injection.type_of(unit, instance)


def test_without_sys_failure_en_nothing_fails() -> None:
    bench = Bench(enabled=0)
    assert bench.inject(GPS, OFF) == DENIED
    assert bench.kind(GPS) == OK


@pytest.mark.parametrize("unit", UNITS)
def test_what_can_fail_how(unit: int) -> None:
    for kind in range(8):
        expected = ACCEPTED if kind in KINDS.get(unit, ()) else UNSUPPORTED
        assert Bench().inject(unit, kind) == expected, kind


@pytest.mark.parametrize("enabled", [0, 1])
def test_the_answer_names_nobody_and_goes_where_somebody_was_heard(enabled: int) -> None:
    """FailureInjectionManager.cpp, publishAck; what SYS_FAILURE_EN does not let is answered by the link that asked."""
    peer = Peer(lambda now_us, command: manager.handle_command(now_us, command))
    manager = FailureInjectionManager(peer.topics, Parameters(VehicleKind.MULTICOPTER, {"SYS_FAILURE_EN": enabled}))
    peer.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3), ONBOARD)
    messages = {GCS: peer.send(command_long(420, GPS, OFF)), ONBOARD: peer.received(ONBOARD), PAYLOAD: []}
    messages[GIMBAL] = peer.run(0.02, GIMBAL)
    acks = {link: only(at_once + peer.received(link), "COMMAND_ACK") for link, at_once in messages.items()}
    told = {link: [(ack.result, ack.target_system, ack.target_component) for ack in acks[link]] for link in acks}
    answer = [(ACCEPTED, 0, 0) if enabled else (DENIED, 255, 190)]
    assert told == {GCS: answer, ONBOARD: answer, PAYLOAD: [], GIMBAL: []}


def test_an_instance_fails_in_one_way_at_a_time_until_it_is_mended() -> None:
    bench = Bench()
    assert bench.inject(MOTOR, OFF) == ACCEPTED
    assert bench.inject(MOTOR, STUCK, 3) == ACCEPTED
    assert [bench.kind(MOTOR, motor) for motor in (1, 2, 3, 4)] == [OFF, OFF, STUCK, OFF]
    assert bench.inject(MOTOR, OK, 2) == ACCEPTED
    assert [bench.kind(MOTOR, motor) for motor in (1, 2, 3, 4)] == [OFF, OK, STUCK, OFF]
    assert bench.inject(MOTOR, OK) == ACCEPTED
    assert bench.topics.failure_injection.entries == ()


def test_an_instance_that_nobody_has_is_accepted_and_changes_nothing() -> None:
    bench = Bench()
    for instance in (17, 200, -1):
        assert bench.inject(GPS, OFF, instance) == ACCEPTED
    assert bench.kind(GPS) == OK


def test_more_than_sixteen_failures_are_rejected() -> None:
    bench = Bench()
    pairs = [(unit, kind) for unit, kinds in KINDS.items() for kind in sorted(kinds - {OK})]
    for unit, kind in pairs[:16]:
        assert bench.inject(unit, kind, kind + 1) == ACCEPTED
    before = bench.topics.failure_injection
    assert bench.inject(*pairs[16], 9) == TEMPORARILY_REJECTED
    assert bench.topics.failure_injection is before
    assert bench.inject(*pairs[0], 9) == ACCEPTED, "not one more, but more of one"


@pytest.mark.parametrize(("value", "means"), [(math.nan, 0), (math.inf, 0), (256.0 + GPS, GPS), (3.6, GPS)])
def test_numbers_are_taken_in_eight_bits(value: float, means: int) -> None:
    """As PX4's static_cast<uint8_t>(lroundf(...)); what is no number is 0, the gyro and every instance."""
    bench = Bench()
    assert bench.inject(value, OFF, math.nan) == ACCEPTED
    assert [bench.kind(means, instance) for instance in (1, 16)] == [OFF, OFF]
