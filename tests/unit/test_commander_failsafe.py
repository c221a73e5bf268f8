"""What happens when something fails in flight: one transcript per failure, after PX4's own."""

import math

import pytest

from sitl_emu.autopilot.commander.arming_checks.checks import settings_of
from sitl_emu.autopilot.commander.arming_checks.findings import Findings
from sitl_emu.autopilot.commander.arming_checks.flight_time import FlightTimeCheck
from sitl_emu.autopilot.commander.failsafe import Failsafe
from sitl_emu.autopilot.commander.failsafe_framework import Action, Notice
from sitl_emu.autopilot.commander.mode_requirements import ALL_MODES, missing, runnable_modes
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import layout, table
from sitl_emu.autopilot.flight_mode import Need
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    FailsafeFlags,
    GcsHeartbeats,
    ManualControlSetpoint,
    OffboardSetpoint,
    TrajectorySetpoint,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from tests.typed import now

from .navigation_fake import FakeVehicle

CRITICAL, ACTIVE = 5, 4
NAV_LAND = mavlink.MAV_CMD_NAV_LAND
HOLD_TEXT = "Failsafe activated: entering Hold for 5 seconds"
GOOD = FailsafeFlags(
    *(False,) * 11, battery_warning=0, local_position_invalid_relaxed=False, global_position_invalid_relaxed=False
)


def flying(up_m: float = 10.0, kind: VehicleKind = VehicleKind.MULTICOPTER, **parameters: float) -> FakeVehicle:
    """A vehicle in HOLD that has forgotten its texts and modes."""
    vehicle = FakeVehicle(kind, **parameters)
    vehicle.run(3.0)
    vehicle.take_off(up_m)
    vehicle.take_texts()
    del vehicle.modes[:-1]
    return vehicle


def events_told(vehicle: FakeVehicle) -> list[str]:
    """The names of the last events."""
    names = {row["id"]: name for name, row in table()["events"].items()}
    return [names[event.id] for event in vehicle.events.recent]


def status(vehicle: FakeVehicle) -> int:
    return vehicle.topics.vehicle_status.system_status


def test_without_sticks_from_the_start_their_absence_is_no_failure() -> None:
    vehicle = flying()
    vehicle.run(5.0)
    assert vehicle.modes == ["AUTO_LOITER"]
    assert not vehicle.topics.vehicle_status.failsafe


def test_lost_sticks_hold_then_return() -> None:
    vehicle = flying()
    for step in range(100):
        vehicle.topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, True)
        vehicle.step()
        if step == 50:  # modes hear of sticks a run of the checks later
            vehicle.set_mode(3)
    vehicle.run(3.0)
    assert vehicle.modes == ["AUTO_LOITER", "POSCTL", "AUTO_LOITER"]
    assert status(vehicle) == CRITICAL
    vehicle.run(4.0)
    assert vehicle.modes[-1] == "AUTO_RTL"
    assert vehicle.take_texts()[:3] == [
        HOLD_TEXT,
        "Failsafe activated",
        "RTL: start return at 500 m (10 m above destination)",
    ]


def test_a_pilot_who_lands_takes_over_and_the_mode_of_before_comes_back() -> None:
    vehicle = flying()
    for _ in range(10):
        vehicle.topics.manual_control_setpoint = ManualControlSetpoint(vehicle.now_us, True)
        vehicle.step()
    vehicle.set_mode(3)
    vehicle.run(8.0)
    assert now(vehicle.mode) is NavState.AUTO_RTL
    assert vehicle.result(NAV_LAND) == 0
    vehicle.step()
    assert now(vehicle.mode) is NavState.AUTO_LAND
    assert status(vehicle) == ACTIVE
    vehicle.run_until_disarmed()
    assert vehicle.mode is NavState.POSCTL


@pytest.mark.parametrize(("action", "mode"), [(2, "AUTO_RTL"), (3, "AUTO_LAND")])
def test_lost_ground_station(action: int, mode: str) -> None:
    vehicle = flying(NAV_DLL_ACT=action, COM_DL_LOSS_T=10, COM_FAIL_ACT_T=2.0)
    vehicle.gcs = False
    vehicle.run(13.5)
    assert vehicle.modes == ["AUTO_LOITER"]
    assert status(vehicle) == CRITICAL
    vehicle.run(2.0)
    assert vehicle.modes == ["AUTO_LOITER", mode]
    vehicle.gcs = True
    vehicle.run(1.0)
    assert vehicle.modes[-1] == mode
    assert "GCS connection regained" in vehicle.take_texts()


@pytest.mark.parametrize("orbits", [False, True])
def test_who_is_terminated_by_a_failsafe_goes_on_to_show_what_was_asked_for(orbits: bool) -> None:
    """Seen on a PX4 v1.18 (Commander.cpp: nav_state_display); an orbit is Hold as soon as a failsafe acts."""
    vehicle = flying(NAV_DLL_ACT=5, COM_DL_LOSS_T=5)
    if orbits:
        assert vehicle.result(mavlink.MAV_CMD_DO_ORBIT, 8.0, 3.0) == 0
    vehicle.gcs = False
    vehicle.run(10.0)
    status = vehicle.topics.vehicle_status
    assert (status.nav_state, status.nav_state_display) == (NavState.TERMINATION, NavState.AUTO_LOITER)
    assert status.nav_state_user_intention is status.nav_state_display


def test_a_hold_of_less_than_half_a_second_is_told_as_one_of_none() -> None:
    """PX4's notifyUser asks what follows the hold, not how long it is."""
    vehicle = flying(NAV_DLL_ACT=2, COM_FAIL_ACT_T=0.3)
    vehicle.gcs = False
    vehicle.run(14.0)
    failsafe = [text for text in vehicle.take_texts() if text.startswith("Failsafe")]
    assert failsafe == ["Failsafe activated: entering Hold for 0 seconds", "Failsafe activated"]
    holds = layout("commander_failsafe_enter_hold")[0]
    assert [event.arguments for event in vehicle.events.recent if event.id == holds]


@pytest.mark.parametrize("mode", [NavState.AUTO_LAND, NavState.AUTO_RTL])
def test_who_is_disarmed_where_nobody_can_arm_is_checked_in_the_mode_of_afterwards(mode: NavState) -> None:
    """Commander::run leaves LAND before it runs the checks: they have nothing new to tell."""
    vehicle = flying()
    assert vehicle.set_mode(4, 6 if mode is NavState.AUTO_LAND else 5) == 0
    vehicle.run(3.0)
    assert now(vehicle.mode) is mode
    vehicle.events.recent.clear()
    assert vehicle.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196) == 0
    vehicle.run(3.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    assert events_told(vehicle) == ["commander_disarmed_by"]


def test_lost_ground_station_does_nothing_by_default() -> None:
    vehicle = flying()
    vehicle.gcs = False
    vehicle.run(20.0)
    assert (vehicle.modes, status(vehicle)) == (["AUTO_LOITER"], ACTIVE)


def test_a_link_that_comes_back_within_the_hold_leaves_the_failsafe_to_the_pilot() -> None:
    """The action ends with a change of the mode (ClearCondition::OnModeChangeOrDisarm), not with its reason."""
    vehicle = flying(NAV_DLL_ACT=2)
    vehicle.gcs = False
    vehicle.run(14.0)
    assert now(vehicle.topics.vehicle_status.failsafe)
    vehicle.gcs = True
    vehicle.run(5.0)
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_RTL"]
    vehicle.set_mode(4, 3)
    vehicle.run(0.2)
    assert vehicle.mode is NavState.AUTO_LOITER
    assert not vehicle.topics.vehicle_status.failsafe


def test_lost_position_descends_at_once_and_holds_again_when_it_is_back() -> None:
    vehicle = flying()
    vehicle.gps = False
    vehicle.run(0.5)
    assert vehicle.modes == ["AUTO_LOITER", "DESCEND"]
    assert vehicle.take_texts() == ["Failsafe activated"]
    vehicle.gps = True
    vehicle.run(1.5)
    assert vehicle.modes[-1] == "AUTO_LOITER"
    assert status(vehicle) == ACTIVE


def offboard(vehicle: FakeVehicle, seconds: float) -> None:
    """Send setpoints at 50 Hz."""
    for _ in range(round(seconds * 25)):
        hover = TrajectorySetpoint(vehicle.now_us, position=(0.0, 0.0, -10.0))
        vehicle.topics.offboard_setpoint = OffboardSetpoint(vehicle.now_us, trajectory=hover)
        vehicle.step()


def test_lost_offboard_setpoints_return_at_once() -> None:
    vehicle = flying(COM_OF_LOSS_T=1.0)
    offboard(vehicle, 0.5)
    assert vehicle.set_mode(6) == 0
    offboard(vehicle, 1.0)
    assert vehicle.mode is NavState.OFFBOARD
    vehicle.run(1.3)
    assert vehicle.modes == ["AUTO_LOITER", "OFFBOARD", "AUTO_RTL"]
    assert vehicle.take_texts()[0] == "Failsafe activated"
    vehicle.run_until_disarmed()
    assert vehicle.mode is NavState.OFFBOARD


def test_offboard_loss_action_hold() -> None:
    vehicle = flying(COM_OBL_RC_ACT=5)
    offboard(vehicle, 0.5)
    vehicle.set_mode(6)
    offboard(vehicle, 0.5)
    vehicle.run(1.5)
    assert vehicle.modes[-1] == "AUTO_LOITER"


def test_low_battery_is_told_critical_returns_emergency_lands() -> None:
    vehicle = flying(30.0)
    vehicle.battery = vehicle.battery._replace(warning=1)
    vehicle.run(5.0)
    assert vehicle.take_texts() == ["Low battery"]
    vehicle.battery = vehicle.battery._replace(warning=2)
    vehicle.run(1.2)
    assert vehicle.take_texts() == ["Critical battery", HOLD_TEXT]
    vehicle.battery = vehicle.battery._replace(warning=3)
    vehicle.run(1.0)
    assert vehicle.take_texts() == ["System does not support shutdown"]
    assert vehicle.mode is NavState.AUTO_LOITER
    vehicle.run(3.5)
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_LAND"]
    assert vehicle.take_texts() == ["Failsafe activated"]


def test_battery_that_is_only_warned_of_changes_nothing() -> None:
    vehicle = flying(COM_LOW_BAT_ACT=0)
    vehicle.battery = vehicle.battery._replace(warning=3)
    vehicle.run(10.0)
    assert (vehicle.modes, status(vehicle)) == (["AUTO_LOITER"], ACTIVE)


def test_a_fence_with_return_holds_first() -> None:
    vehicle = flying(GF_ACTION=3, GF_MAX_HOR_DIST=30.0)
    vehicle.north = 90.0
    vehicle.run(1.0)
    assert vehicle.modes == ["AUTO_LOITER"]
    assert vehicle.take_texts() == ["Geofence: exceeding maximum distance to Home", HOLD_TEXT]
    vehicle.run(5.0)
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_RTL"]


def test_a_fence_that_warns_is_no_failsafe() -> None:
    vehicle = flying(GF_ACTION=1, GF_MAX_HOR_DIST=30.0)
    vehicle.north = 90.0
    vehicle.run(1.0)
    assert (vehicle.take_texts(), status(vehicle)) == (["Geofence: exceeding maximum distance to Home"], ACTIVE)
    vehicle.result(NAV_LAND)
    vehicle.step()
    assert "Failsafe activated" not in vehicle.take_texts()
    assert vehicle.mode is NavState.AUTO_LAND


def test_flight_time_limit_returns() -> None:
    vehicle = flying(COM_FLT_TIME_MAX=30)
    vehicle.run(30.0)
    assert vehicle.mode is NavState.AUTO_RTL
    assert "Maximum flight time reached" in vehicle.take_texts()


@pytest.mark.parametrize(
    ("longest_s", "warned"),
    [
        (200, [("commander_max_flight_time_warning_seconds", 19)]),
        (1300, [("commander_max_flight_time_warning_minutes", 2), ("commander_max_flight_time_warning_minutes", 1)]),
    ],
)
def test_the_end_of_the_flight_time_is_told_before(longest_s: int, warned: list[tuple[str, int]]) -> None:
    """In its last tenth: each full minute, or once if there is less (flightTimeCheck.cpp)."""
    topics, settings = FakeVehicle().topics, settings_of(Parameters(VehicleKind.MULTICOPTER, {}))
    settings = settings._replace(com_flt_time_max_us=longest_s * 1_000_000)
    topics.vehicle_status = topics.vehicle_status._replace(takeoff_time=1)
    limit, told = FlightTimeCheck(), []
    for now_us in range(0, longest_s * 1_000_000, 100_000):
        findings = Findings()
        limit.check(now_us, topics, settings, findings)
        told += [(notice.event, notice.arguments[0]) for notice in findings.notices]
    assert told == warned


def failsafe_action(flags: FailsafeFlags, mode: NavState, **parameters: float) -> tuple[Action, NavState]:
    """What a failsafe without hold flies for these flags."""
    failsafe = Failsafe(Parameters(VehicleKind.MULTICOPTER, {"COM_FAIL_ACT_T": 0.0} | parameters), lambda *_: None)
    asked = {"armed": True, "user_mode": mode, "mode_changes": 0}
    failsafe.update(0, flags=GOOD, **asked)  # type: ignore[arg-type]
    flown = failsafe.update(1000, flags=flags, **asked)  # type: ignore[arg-type]
    return failsafe.selected, flown


@pytest.mark.parametrize(
    ("parameters", "finished", "action"),
    [
        ({"COM_RC_IN_MODE": 4, "NAV_DLL_ACT": 0}, True, Action.RTL),
        ({"COM_RCL_EXCEPT": 1, "NAV_DLL_ACT": 0}, True, Action.RTL),
        ({"COM_RC_IN_MODE": 4, "NAV_DLL_ACT": 0}, False, Action.NONE),
        ({"COM_RC_IN_MODE": 1, "NAV_DLL_ACT": 0}, True, Action.NONE),
    ],
)
def test_a_finished_mission_that_nobody_leads_returns(
    parameters: dict[str, float], finished: bool, action: Action
) -> None:
    failsafe = Failsafe(Parameters(VehicleKind.MULTICOPTER, {"COM_FAIL_ACT_T": 0.0} | parameters), lambda *_: None)
    failsafe.update(
        1_000_000,
        armed=True,
        user_mode=NavState.AUTO_MISSION,
        mode_changes=0,
        flags=GOOD._replace(gcs_connection_lost=True),
        mission_finished=finished,
    )
    assert failsafe.selected is action


def test_a_position_of_low_accuracy_returns_at_once_and_holds_again_when_it_is_better() -> None:
    """COM_POS_LOW_EPH, below the 0.5 m that are flown with here; COM_POS_LOW_ACT is Return by default."""
    vehicle = flying()
    vehicle.parameters.set("COM_POS_LOW_EPH", 0.4)
    vehicle.run(0.3)
    assert vehicle.modes == ["AUTO_LOITER", "AUTO_RTL"]
    assert vehicle.take_texts()[:2] == ["Position estimate has low accuracy", "Failsafe activated"]
    vehicle.parameters.set("COM_POS_LOW_EPH", 0.6)
    vehicle.run(0.3)
    assert vehicle.modes[2:] == ["AUTO_LOITER"]


@pytest.mark.parametrize(
    ("mode", "com_pos_low_act", "action"),
    [
        (NavState.AUTO_MISSION, 0, Action.NONE),
        (NavState.AUTO_MISSION, 1, Action.WARN),
        (NavState.AUTO_LOITER, 2, Action.HOLD),
        (NavState.AUTO_LOITER, 4, Action.TERMINATE),
        (NavState.AUTO_LOITER, 5, Action.LAND),
        (NavState.ORBIT, 5, Action.NONE),
    ],
)
def test_low_position_accuracy_is_minded_in_missions_and_hold(
    mode: NavState, com_pos_low_act: int, action: Action
) -> None:
    flags = GOOD._replace(position_accuracy_low=True)
    assert failsafe_action(flags, mode, COM_POS_LOW_ACT=com_pos_low_act)[0] is action


@pytest.mark.parametrize(
    ("com_wind_max_act", "action"),
    [(2, Action.HOLD), (3, Action.RTL), (4, Action.TERMINATE), (5, Action.LAND)],
)
def test_wind_above_its_limit(com_wind_max_act: int, action: Action) -> None:
    flags = GOOD._replace(wind_limit_exceeded=True)
    assert failsafe_action(flags, NavState.AUTO_MISSION, COM_WIND_MAX_ACT=com_wind_max_act)[0] is action


def test_a_propeller_out_of_balance_is_warned_of() -> None:
    assert failsafe_action(GOOD._replace(fd_imbalanced_prop=True), NavState.AUTO_LOITER)[0] is Action.WARN


def test_everything_good_flies_what_was_asked_for() -> None:
    for mode in NavState:
        if runnable_modes(GOOD) >> mode & 1 and mode is not NavState.TERMINATION:
            assert failsafe_action(GOOD, mode) == (Action.NONE, mode)


def test_position_without_position_falls_back_to_altitude() -> None:
    flags = GOOD._replace(
        local_position_invalid=True, local_position_invalid_relaxed=True, global_position_invalid=True
    )
    assert failsafe_action(flags, NavState.POSCTL) == (Action.FALLBACK_ALTCTL, NavState.ALTCTL)


def test_nothing_left_to_fly_by_terminates() -> None:
    flags = GOOD._replace(attitude_invalid=True, local_position_invalid=True, global_position_invalid=True)
    assert failsafe_action(flags, NavState.AUTO_LOITER) == (Action.TERMINATE, NavState.TERMINATION)


def test_the_worst_action_wins() -> None:
    flags = GOOD._replace(geofence_breached=True, gcs_connection_lost=True)
    selected, _ = failsafe_action(flags, NavState.AUTO_LOITER, GF_ACTION=2, NAV_DLL_ACT=3)
    assert selected is Action.LAND


def test_of_two_reasons_for_the_same_the_later_is_told_when_it_is_flown() -> None:
    """PX4's checkFailsafe takes the last free slot, and getSelectedAction the first that asks for the worst."""
    notices: list[Notice] = []
    failsafe = Failsafe(Parameters(VehicleKind.MULTICOPTER, {"NAV_DLL_ACT": 2}), notices.append)
    lost = GOOD._replace(manual_control_signal_lost=True)
    for second, flags in enumerate((GOOD, lost, lost._replace(gcs_connection_lost=True), *(lost,) * 6)):
        asked = {"armed": True, "user_mode": NavState.AUTO_LOITER, "mode_changes": 0}
        failsafe.update(second * 1_000_000, flags=flags, **asked)  # type: ignore[arg-type]
    told = [(Action.HOLD, 1), (Action.WARN, 2), (Action.RTL, 2)]
    assert [(notice.action, notice.cause) for notice in notices] == told


def test_link_loss_exceptions() -> None:
    flags = GOOD._replace(manual_control_signal_lost=True)
    assert failsafe_action(flags, NavState.AUTO_MISSION)[0] is Action.RTL
    assert failsafe_action(flags, NavState.AUTO_MISSION, COM_RCL_EXCEPT=1)[0] is Action.NONE
    assert failsafe_action(flags, NavState.AUTO_LOITER, COM_RCL_EXCEPT=1)[0] is Action.RTL
    assert failsafe_action(flags, NavState.AUTO_LOITER, COM_RCL_EXCEPT=2)[0] is Action.NONE


def test_requirements_cover_every_mode_and_say_what_is_missing() -> None:
    assert sum(1 << mode for mode in NavState) == ALL_MODES
    assert missing(GOOD) is Need.OTHER
    assert Need.HOME_POSITION in missing(GOOD._replace(home_position_invalid=True))
    assert not runnable_modes(GOOD) >> NavState.EXTERNAL1 & 1


def tipped_over(vehicle: FakeVehicle) -> FakeVehicle:
    """On its nose for long enough (FD_FAIL_P 60 deg for 0.3 s)."""
    vehicle.euler = (0.0, math.radians(-75.0), 0.0)
    vehicle.run(0.6)
    return vehicle


def test_a_vehicle_that_tips_over_while_it_takes_off_is_disarmed() -> None:
    """Until 3 s after COM_SPOOLUP_TIME."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    vehicle.arm()
    vehicle.take_texts()
    tipped_over(vehicle)
    assert not vehicle.armed
    assert "Disarmed by failsafe" in vehicle.take_texts()


def test_a_vehicle_that_tips_over_in_flight_warns_or_ends_the_flight() -> None:
    """CBRK_FLIGHTTERM is 121212 (broken) by default."""
    vehicle = tipped_over(flying())
    assert vehicle.armed
    assert vehicle.mode is NavState.AUTO_LOITER
    assert vehicle.take_texts() == ["Preflight Fail: Attitude failure (pitch)"]
    assert tipped_over(flying(CBRK_FLIGHTTERM=0)).mode is NavState.TERMINATION


@pytest.mark.parametrize(
    ("parameter", "value", "mode"),
    [
        ("COM_PARACHUTE", 2, NavState.AUTO_LOITER),
        ("COM_PARACHUTE", 3, NavState.AUTO_RTL),
        ("COM_PARACHUTE", 4, NavState.AUTO_LAND),
        ("COM_ARM_ODID", 2, NavState.AUTO_LOITER),
        ("COM_ARM_ODID", 3, NavState.AUTO_RTL),
        ("COM_ARM_ODID", 4, NavState.AUTO_LAND),
        ("COM_ARM_ODID", 5, NavState.TERMINATION),
    ],
)
def test_lost_parachute_and_remote_id(parameter: str, value: int, mode: NavState) -> None:
    """By PX4's fromParachuteActParam and fromOdidFailActParam: from 3 on, their loss is a reason to end the flight."""
    vehicle = flying()
    vehicle.topics.gcs_heartbeats = GcsHeartbeats(0, 0, vehicle.now_us, True, vehicle.now_us, True)
    vehicle.run(0.2)
    vehicle.parameters.set(parameter, value)
    vehicle.run(5.0)
    assert vehicle.mode is NavState.AUTO_LOITER
    vehicle.run(6.5)
    assert vehicle.mode is mode
