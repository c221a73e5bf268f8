"""Where to go: runs the navigator's modes and publishes what they want to fly.

PX4's Navigator (src/modules/navigator/navigator_main.cpp, v1.18). Writes position_setpoint_triplet, mission_result,
geofence_result and vehicle_roi. Which mode is active, follows from vehicle_status; what was commanded, from
vehicle_commands.
"""

import math
from typing import ClassVar, Final

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, answer_later
from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.navigator.course import Course
from sitl_emu.autopilot.navigator.geofence import Area, Geofence
from sitl_emu.autopilot.navigator.land import Land
from sitl_emu.autopilot.navigator.loiter import Loiter
from sitl_emu.autopilot.navigator.mission import Mission
from sitl_emu.autopilot.navigator.mission_commands import change_speed
from sitl_emu.autopilot.navigator.mission_legs import stop_below_ceiling
from sitl_emu.autopilot.navigator.payload import Payload
from sitl_emu.autopilot.navigator.precland import PrecLand
from sitl_emu.autopilot.navigator.roi import ROI_COMMANDS, Roi
from sitl_emu.autopilot.navigator.rtl import Rtl
from sitl_emu.autopilot.navigator.state import NavigatorState, settings_of
from sitl_emu.autopilot.navigator.takeoff import Takeoff
from sitl_emu.autopilot.navigator.traffic import Traffic
from sitl_emu.autopilot.navigator.vtol_takeoff import VtolTakeoff
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import (
    DistanceSensorModeChangeRequest,
    MissionResult,
    NavigatorStatus,
    Topics,
    VehicleCommand,
    VehicleStatus,
)
from sitl_emu.core import dialect as mavlink

INTERVAL_US: Final = 50_000
"""How often the estimate wakes the navigator (Navigator::run, orb_set_interval of vehicle_local_position)."""
STATUS_EVERY_US: Final = 500_000
FAILURE_HAGL: Final = 1
"""navigator_status.failure."""
TELLS_OF_ITSELF: Final = frozenset(
    (NavState.AUTO_MISSION, NavState.AUTO_TAKEOFF, NavState.AUTO_VTOL_TAKEOFF, NavState.AUTO_LAND)
)
"""Modes that publish mission_result as they begin."""
CHANGE_MODE = mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
Mode = Takeoff | VtolTakeoff | Loiter | Course | Mission | Rtl | Land | PrecLand


class Navigator:
    """The modes and the one that is active."""

    COMMANDS: ClassVar[frozenset[int]] = frozenset()
    """All commands go to the commander, who passes on what it has accepted."""

    def __init__(
        self,
        topics: Topics,
        parameters: Parameters,
        dataman: Dataman,
        say: Say,
        send_event: SendEvent,
        outgoing: OutgoingCommands | None = None,
    ) -> None:
        """`say` tells the ground, `send_event` does so without a text; its commands go to `outgoing`."""
        self._topics = topics
        self._parameters = parameters
        self._dataman = dataman
        self._state = state = NavigatorState(
            topics, parameters, dataman, say, outgoing if outgoing is not None else OutgoingCommands()
        )
        self._version = parameters.version
        self._roi = Roi(state)
        self._geofence = Geofence(state)
        self.traffic = Traffic(state, send_event)
        self._takeoff = Takeoff(state)
        self._vtol_takeoff = VtolTakeoff(state)
        self._loiter = Loiter(state, self._geofence)
        self._course = Course(state, self._geofence)
        self._payload = Payload(state)
        self._mission = Mission(state, self._roi, self._payload, self._geofence)
        self._rtl = Rtl(state, self._mission, self._roi, self._payload)
        self._modes: dict[NavState, Mode] = {
            NavState.AUTO_TAKEOFF: self._takeoff,
            NavState.AUTO_VTOL_TAKEOFF: self._vtol_takeoff,
            NavState.AUTO_LOITER: self._loiter,
            NavState.GUIDED_COURSE: self._course,
            NavState.AUTO_MISSION: self._mission,
            NavState.AUTO_RTL: self._rtl,
            NavState.AUTO_LAND: Land(state),
            NavState.AUTO_PRECLAND: PrecLand(state),
        }
        self._mode: Mode | None = None
        self._nav_state: NavState | None = None
        self._has_reset = False
        """The triplet was published as none since a mode of the navigator was chosen last
        (_pos_sp_triplet_published_invalid_once)."""
        self._due_us = 0
        self._status: VehicleStatus | None = None
        self._plans: tuple[object, ...] = ()
        self._commands_seen = 0
        self._repositioned_us: int | None = None
        """When a place to hold at was commanded, until a vehicle_status is newer
        (_wait_for_vehicle_status_timestamp)."""
        self._is_too_high = False
        self._published: tuple[object, ...] = ()
        self._published_mode: tuple[object, ...] = ()
        """Of it MISSION_STATE follows, which PX4 tells without publishing mission_result anew."""

    @property
    def fence_areas(self) -> tuple[Area, ...]:
        """Areas of the fence that are watched."""
        return self._geofence.areas

    def handle_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Nothing comes here: COMMANDS is empty."""
        raise ValueError(f"command {command.command} is the commander's")

    def set_current_mission_item(self, now_us: int, seq: int) -> bool:
        """MISSION_SET_CURRENT; False for an item that is not in the mission."""
        self._state.now_us = now_us
        self._take_parameters()
        accepted = self._mission.set_current(seq)
        self._publish_mission_result(now_us)
        return accepted

    def mission_changed(self, now_us: int) -> None:
        """A plan was uploaded or cleared; also noticed by itself at the next update."""
        self._state.now_us = now_us
        self._take_parameters()
        self._mission.take_plan()
        self._publish_mission_result(now_us)

    def update(self, now_us: int) -> None:
        """Run where PX4's navigator wakes: at 20 Hz, and at once for a new vehicle_status or mission.

        It wakes itself by moving on in the mission (MissionBase::setMissionIndex publishes that): what is done at once
        is done in no time, and of the items that are so, the links see only the last.
        """
        state = self._state
        if not self._wakes(now_us):
            return
        state.now_us = now_us
        for _ in range(len(self._dataman.mission.items) + 1):
            seq = self._dataman.current_seq
            self._run()
            if self._dataman.current_seq == seq:
                break
        self._plans = self._plans_now()
        self._publish_mission_result(now_us)
        self._publish_status(now_us)

    def _wakes(self, now_us: int) -> bool:
        status, plans = self._topics.vehicle_status, self._plans_now()
        if now_us < self._due_us and status is self._status and plans == self._plans:
            return False
        # Whatever woke it, it reads the estimate, and counts from there (uORB's SubscriptionInterval::copy).
        self._due_us = min(max(self._due_us + INTERVAL_US, now_us), now_us + INTERVAL_US)
        self._status, self._plans = status, plans
        return True

    def _plans_now(self) -> tuple[object, ...]:
        plans = self._dataman
        return id(plans.mission), id(plans.fence), id(plans.rally), plans.current_seq

    def _run(self) -> None:
        """One run: commands, fence, and the mode that is active."""
        state, topics = self._state, self._topics
        self._take_parameters()
        self._mission.take_plan()
        self._loiter.note_ground_station()
        if self._geofence.update():
            self._loiter.hold_here()
        self._take_commands()
        self.traffic.update()
        status = topics.vehicle_status
        if self._repositioned_us is not None and status.timestamp > self._repositioned_us:
            self._repositioned_us = None
        self._run_mode(status.nav_state if status.armed else None)
        self._has_reset = self._has_reset and status.nav_state not in self._modes
        if self._mode is None and not self._has_reset:
            # Again and again where a mode of the navigator is chosen that does not run, for want of arming.
            self._has_reset = True
            state.reset_triplet()
        if state.triplet is not topics.position_setpoint_triplet:
            topics.position_setpoint_triplet = state.triplet
        self._payload.update()

    def _take_parameters(self) -> None:
        """Before anything else, whatever has woken the navigator (Navigator::run): what comes obeys what was set."""
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._state.settings = settings_of(self._parameters)

    def _publish_status(self, now_us: int) -> None:
        """Twice a second, and when something has changed. A failure lasts as long as its mode."""
        topics = self._topics
        mode, last = self._mode, topics.navigator_status
        flown = NavState.AUTO_MISSION if mode is self._mission else topics.vehicle_status.nav_state
        failure = FAILURE_HAGL if self._is_too_high else last.failure if last.nav_state == flown else 0
        if (flown, failure) != last[1:] or now_us - last.timestamp >= STATUS_EVERY_US:
            topics.navigator_status = NavigatorStatus(now_us, int(flown), failure)
        self._is_too_high = False
        request = int((mode is self._rtl or mode is self._mission) and mode.is_landing)
        known = topics.distance_sensor_mode_change_request
        if known.timestamp == 0 or known.request_on_off != request:
            topics.distance_sensor_mode_change_request = DistanceSensorModeChangeRequest(now_us, request)

    def _take_commands(self) -> None:
        """What the commander has passed on; behind a place to hold at, none before another vehicle_status has come.

        The next command could make another place of it. What the navigator has to answer, it answers as late.
        """
        records = self._topics.vehicle_commands
        if not records or records[-1].number == self._commands_seen:
            return
        for record in records:
            if self._repositioned_us is not None:
                return
            if record.number > self._commands_seen:
                self._commands_seen = record.number
                if self._take_command(record.command):
                    self._repositioned_us = record.timestamp

    def _take_command(self, command: VehicleCommand) -> bool:
        """Whether it has chosen a place to hold at."""
        status, number = self._topics.vehicle_status, command.command
        in_hold = status.nav_state is NavState.AUTO_LOITER
        if number == mavlink.MAV_CMD_NAV_TAKEOFF:
            self._takeoff.request(command)
        elif number == mavlink.MAV_CMD_NAV_VTOL_TAKEOFF:
            self._vtol_takeoff.request(command)
        elif number == mavlink.MAV_CMD_DO_REPOSITION:
            changes_mode = math.isfinite(command.param2) and int(command.param2) & CHANGE_MODE
            if status.armed and (in_hold or changes_mode):
                self._loiter.reposition(command, in_hold=self._mode is self._loiter)
                return True
        elif number == mavlink.MAV_CMD_DO_CHANGE_ALTITUDE:
            if self._mode is self._course:
                self._course.change_altitude(command.param1)
            elif status.armed and in_hold:
                self._loiter.change_altitude(command.param1, in_hold=self._mode is self._loiter)
                return True
        elif number == mavlink.MAV_CMD_MISSION_START:
            self._mission.start_at(int(command.param1))
        elif number == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            change_speed(self._state, command)
            answer_later(self._topics, command, CommandResult(mavlink.MAV_RESULT_ACCEPTED))
        elif number in ROI_COMMANDS:
            self._roi.take(command)
            answer_later(self._topics, command, CommandResult(mavlink.MAV_RESULT_ACCEPTED))
        return False

    def _run_mode(self, nav_state: NavState | None) -> None:
        """Run the mode; None while disarmed: no mode runs then, and what was flown before is forgotten.

        A mode that begins, does no more in that run (NavigatorMode::run). A return leaves a mission to land that is on
        its landing pattern; it begins when that mission is sent back to an item before it.
        """
        state = self._state
        mode = self._modes.get(nav_state) if nav_state is not None else None
        if mode is self._rtl and self._mode is self._mission and self._mission.is_landing:
            mode = self._mission
        goes_on = mode is self._mission and self._mode is self._mission
        begins = mode is not self._mode or (nav_state is not self._nav_state and not goes_on)
        self._nav_state = nav_state
        if mode is not self._rtl:
            self._rtl.on_inactive()
        if begins:
            state.finished = False
            if mode is not self._mission:
                self._mission.on_inactive()
            if mode is not self._mode and not self._keeps_setpoint(mode):
                state.reset_triplet()
            before, self._mode = self._mode, mode
            if mode is not None:
                mode.on_activation()
            if isinstance(before, PrecLand) and mode is not before and mode is not self._course:
                before.on_inactivation()  # PX4 goes through its modes in order, and this one comes after all but Course
        elif mode is not None:
            mode.on_active()
            self._is_too_high = stop_below_ceiling(state) or self._is_too_high

    def _keeps_setpoint(self, mode: Mode | None) -> bool:
        """HOLD stays where a takeoff has led, or where the vehicle holds already (Navigator::run)."""
        current = self._state.triplet.current
        holds = current.valid and current.type == SetpointType.LOITER
        return mode is self._loiter and (holds or self._mode is self._takeoff)

    def _publish_mission_result(self, now_us: int) -> None:
        mission, plans, status = self._mission, self._dataman, self._topics.vehicle_status
        told = (
            plans.mission,
            plans.fence,
            plans.rally,
            plans.current_seq,
            self._state.told_reached,
            mission.seq_reached_us,
            mission.valid,
            self._state.mission_finished,
            self._state.mission_failure,
            self._state.finished,
        )
        mode, mode_before = (status.nav_state, status.armed), self._published_mode
        begins = status.nav_state in TELLS_OF_ITSELF and mode[:1] != mode_before[:1]
        is_new = told != self._published or mission.jumps.followed >= 0 or begins
        if not is_new and mode == mode_before:
            return
        self._published, self._published_mode = told, mode
        self._topics.mission_result = MissionResult(
            timestamp=now_us if is_new else self._topics.mission_result.timestamp,
            mission_id=plans.mission.opaque_id,
            geofence_id=plans.fence.opaque_id,
            rally_id=plans.rally.opaque_id,
            valid=mission.valid,
            finished=self._state.finished,
            failure=self._state.mission_failure,
            seq_current=self._state.mission_seq,
            seq_reached=self._state.told_reached,
            seq_reached_timestamp=mission.seq_reached_us,
            seq_total=len(plans.mission.items),
            item_do_jump_changed=mission.jumps.followed >= 0,
            item_changed_index=max(mission.jumps.followed, 0),
            mission_state=mission.mission_state(),
        )
        mission.jumps.followed = -1
