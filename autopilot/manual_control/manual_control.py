"""Which sticks are flown, and what they ask for beside flying. PX4's manual_control (v1.18).

COM_RC_IN_MODE chooses among RC and joysticks (MANUAL_CONTROL of each link): 0 RC, 1 joysticks, 2 both with fallback,
3 both but the first is kept, 4 none, 5 and 7 RC before joysticks, 6 and 8 joysticks before RC; of several joysticks the
first link goes before the others in 5 and 6, the last one in 7 and 8. Sticks that are silent for COM_RC_LOSS_T are not
valid any more. Gestures of the left stick arm and disarm (MAN_ARM_GESTURE), both sticks together kill
(MAN_KILL_GEST_T); RC switches choose modes (COM_FLTMODEn), arm, kill and move the landing gear; sticks that move faster
than MAN_OVERRIDE_SPD take over.

Left out: VTOL, camera and payload switches.
"""

import math

from sitl_emu.autopilot.constants import GEAR_DOWN, GEAR_UP, NavState, RequestedAction
from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    SOURCE_RC,
    SOURCE_UNKNOWN,
    ActionRequest,
    LandingGear,
    ManualControlInput,
    ManualControlSetpoint,
    ManualControlSwitches,
    Topics,
)

RC_ONLY, MAVLINK_ONLY, FALLBACK, FIRST, DISABLED = range(5)
RC_ASCENDING, ASCENDING_RC, RC_DESCENDING, DESCENDING_RC = range(5, 9)
"""COM_RC_IN_MODE; the last four put all sources in an order."""
MOVING_TIME_CONSTANT_S = 0.05
"""Of the filter on the speed of a stick."""
FEWEST_MOVES = 3
"""In the same direction, one after the other: what does less is noise."""
RUNS_EVERY_US = 200_000
HYSTERESIS_US = 1_000_000
"""How long a gesture or a button is held."""
FAR, NEAR_CENTRE = 0.9, 0.1
THROTTLE_DOWN = -0.8
AT_REST = (0.0, 0.0, 0.0, -1.0)
"""Roll, pitch, yaw and throttle, instead of sticks that are held in the corners to kill."""
NEVER_US = 1 << 62
STICK_GESTURE, RC_SWITCH, RC_BUTTON, RC_MODE_SLOT = 0, 1, 2, 3
"""action_request SOURCE."""
OFF, ON = 3, 1
MODE_OF_SLOT_VALUE = {mode.slot: state for state, mode in FLIGHT_MODES.items() if mode.slot is not None}
"""COM_FLTMODEn."""


class StickSpeed:
    """Filtered speed of a stick, in full deflections a second (PX4's MovingDiff)."""

    def __init__(self) -> None:
        self._last = math.nan
        self._speed = 0.0
        self._direction = 0.0
        self._moves = 0

    def exceeds(self, limit: float, value: float, dt_s: float) -> bool:
        """Whether the stick, which is at `value` now, moves faster than the limit."""
        if dt_s <= 0.0 or not math.isfinite(value):
            return False
        if math.isfinite(self._last):
            speed = (value - self._last) / dt_s
            self._speed += (speed - self._speed) * dt_s / (MOVING_TIME_CONSTANT_S + dt_s)
            if speed:
                self._moves = self._moves + 1 if speed * self._direction > 0.0 else 1
                self._direction = speed
        self._last = value
        return abs(self._speed) > limit and self._moves >= FEWEST_MOVES


class Held:
    """True once something has lasted for a while."""

    def __init__(self, for_us: int) -> None:
        self.for_us = for_us
        self._since_us: int | None = None
        self.state = False

    def rises(self, now_us: int, condition: bool) -> bool:
        """Whether it becomes true with this look."""
        if not condition:
            self._since_us, self.state = None, False
            return False
        if self._since_us is None:
            self._since_us = now_us
        before = self.state
        self.state = self.state or now_us - self._since_us >= self.for_us
        return self.state and not before


def wants(mode: int, source: int, chosen: int, first: int) -> bool:
    """Whether COM_RC_IN_MODE wants sticks of a source flown instead of those that are now.

    `chosen` is their source, `first` that of the first of all; SOURCE_UNKNOWN: there are none (PX4's
    ManualControlSelector::isInputValid). RC is before the MAVLink links in number.
    """
    is_rc, free = source == SOURCE_RC, chosen in (SOURCE_UNKNOWN, source)
    if mode == RC_ONLY:
        return is_rc
    if mode == MAVLINK_ONLY:
        return not is_rc and free
    if mode == FIRST:
        return first in (SOURCE_UNKNOWN, source)
    if mode == RC_ASCENDING:
        return free or source < chosen
    if mode == ASCENDING_RC:
        return free or (not is_rc and (chosen == SOURCE_RC or source < chosen))
    if mode == RC_DESCENDING:
        return free or is_rc or (chosen != SOURCE_RC and source > chosen)
    if mode == DESCENDING_RC:
        return free or source > chosen
    return mode == FALLBACK and free


class ManualControl:
    """Writes manual_control_setpoint and action_request."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._version = -1
        self._rc, self._mavlink = topics.manual_control_rc, topics.manual_control_mavlink
        self._switches = topics.manual_control_switches
        self._previous: ManualControlSwitches | None = None
        """Switches as they last were while RC was flown."""
        self._chosen = ManualControlInput()
        self._first = SOURCE_UNKNOWN
        self._valid = False
        self._lost_us = NEVER_US
        self._due_us = 0
        self._called_by = SOURCE_UNKNOWN
        """Whose sticks were chosen last: theirs are looked at as soon as they are told."""
        self._speeds = tuple(StickSpeed() for _ in range(4))
        self._arm, self._disarm, self._kill = Held(HYSTERESIS_US), Held(HYSTERESIS_US), Held(HYSTERESIS_US)
        self._button = Held(HYSTERESIS_US)
        self._requests = 0

    def update(self, now_us: int) -> None:
        """At 83 Hz; a few comparisons while nobody holds a stick.

        It runs when the sticks that were chosen last are told, when switches are, and 200 ms after it ran last: then
        others are looked at, too, and what is silent is found to be. Sticks are published each time.
        """
        topics = self._topics
        rc, mavlink = topics.manual_control_rc, topics.manual_control_mavlink
        if now_us < self._due_us and not self._is_called(rc, mavlink, topics.manual_control_switches):
            return
        self._due_us = now_us + RUNS_EVERY_US
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._copy_parameters()
            source = self._chosen.data_source
            if self._valid and not wants(self._mode, source, source, self._first):
                self._lost_us = now_us  # COM_RC_IN_MODE wants others now (ManualControlSelector::isInputValid)
        if now_us >= self._lost_us:
            self._lose(now_us)
        if rc is not self._rc:
            self._rc = rc
            self._choose(now_us, rc)
        if mavlink is not self._mavlink:
            self._mavlink = mavlink
            self._choose(now_us, mavlink)
        if self._valid:
            self._called_by = self._chosen.data_source
            self._publish(now_us)
        if topics.manual_control_switches is not self._switches:
            self._take_switches(now_us)

    def _is_called(self, rc: ManualControlInput, mavlink: ManualControlInput, switches: ManualControlSwitches) -> bool:
        source = self._called_by
        return (
            (rc is not self._rc and source == SOURCE_RC)
            or (mavlink is not self._mavlink and source == mavlink.data_source)
            or (switches is not self._switches and source != SOURCE_UNKNOWN)
        )

    def _copy_parameters(self) -> None:
        value = self._parameters
        self._mode = int(value["COM_RC_IN_MODE"])
        self._timeout_us = round(float(value["COM_RC_LOSS_T"]) * 1e6)
        self._override_speed = float(value["MAN_OVERRIDE_SPD"])
        self._gestures = bool(value["MAN_ARM_GESTURE"]) and not value["RC_MAP_ARM_SW"]
        kill_s = float(value["MAN_KILL_GEST_T"])
        self._kill.for_us = round(kill_s * 1e6) if kill_s > 0.0 else NEVER_US
        self._slots = tuple(int(value[f"COM_FLTMODE{n}"]) for n in range(1, 7))
        self._arm_is_button = bool(value["COM_ARM_SWISBTN"])

    # --- which sticks -----------------------------------------------------------------------------------------

    def _choose(self, now_us: int, sticks: ManualControlInput) -> None:
        """Take these sticks if COM_RC_IN_MODE wants them, and no others are in use."""
        source, lost_us = sticks.data_source, sticks.timestamp + self._timeout_us
        chosen = self._chosen.data_source if self._valid else SOURCE_UNKNOWN
        if now_us >= lost_us or not wants(self._mode, source, chosen, self._first):
            return
        self._chosen, self._valid, self._lost_us = sticks, True, lost_us
        self._first = self._first or source

    def _lose(self, now_us: int) -> None:
        self._lost_us, self._valid = NEVER_US, False
        self._previous = None
        self._speeds = tuple(StickSpeed() for _ in range(4))
        for gesture in (self._arm, self._disarm, self._kill, self._button):
            gesture.rises(now_us, condition=False)
        sticks = self._topics.manual_control_setpoint
        self._topics.manual_control_setpoint = sticks._replace(timestamp=now_us, valid=False, sticks_moving=False)

    def _publish(self, now_us: int) -> None:
        chosen, before = self._chosen, self._topics.manual_control_setpoint
        sticks = (chosen.roll, chosen.pitch, chosen.yaw, chosen.throttle)
        if self._watch_gestures(now_us, *sticks):
            # Until the next sample comes that is what was sampled, and no gesture (ManualControl::processInput).
            sticks = AT_REST
            self._chosen = chosen._replace(roll=0.0, pitch=0.0, yaw=0.0, throttle=-1.0)
        dt_s, limit = (now_us - before.timestamp) * 1e-6, self._override_speed
        moving = limit >= 0.0 and any(
            speed.exceeds(limit, value, dt_s) for speed, value in zip(self._speeds, sticks, strict=True)
        )
        self._topics.manual_control_setpoint = ManualControlSetpoint(
            now_us, True, *sticks, moving, chosen.data_source, chosen.buttons, chosen.aux
        )

    # --- gestures and switches --------------------------------------------------------------------------------

    def _watch_gestures(self, now_us: int, roll: float, pitch: float, yaw: float, throttle: float) -> bool:
        """Whether the sticks are held as they are to kill."""
        low = throttle < THROTTLE_DOWN
        centred = abs(roll) < NEAR_CENTRE and abs(pitch) < NEAR_CENTRE
        if self._gestures:
            if self._arm.rises(now_us, low and yaw > FAR and centred):
                self._request(now_us, RequestedAction.ARM, STICK_GESTURE)
            if self._disarm.rises(now_us, low and yaw < -FAR and centred):
                self._request(now_us, RequestedAction.DISARM, STICK_GESTURE)
        kills = self._kill.for_us != NEVER_US and low and yaw < -FAR and roll > FAR and pitch < -FAR
        if self._kill.rises(now_us, kills):
            self._request(now_us, RequestedAction.KILL, STICK_GESTURE)
        return kills

    def _take_switches(self, now_us: int) -> None:
        switches = self._switches = self._topics.manual_control_switches
        if not self._valid or self._chosen.data_source != SOURCE_RC:
            self._previous = None
            return
        before, self._previous = self._previous, switches
        if before is None:
            if not self._topics.vehicle_status.armed:  # in flight the mode stays until the switch is moved
                self._choose_mode(now_us, switches.mode_slot)
            return
        if switches.mode_slot != before.mode_slot:
            self._choose_mode(now_us, switches.mode_slot)
        if self._arm_is_button:
            if self._button.rises(now_us, switches.arm == ON):
                self._request(now_us, RequestedAction.TOGGLE_ARMING, RC_BUTTON)
        elif switches.arm != before.arm and switches.arm in (ON, OFF):
            action = RequestedAction.ARM if switches.arm == ON else RequestedAction.DISARM
            self._request(now_us, action, RC_SWITCH)
        pairs = (
            (switches.return_to_launch, before.return_to_launch, NavState.AUTO_RTL),
            (switches.loiter, before.loiter, NavState.AUTO_LOITER),
            (switches.offboard, before.offboard, NavState.OFFBOARD),
        )
        for position, was, mode in pairs:
            if position != was:
                if position == ON:
                    self._request(now_us, RequestedAction.SWITCH_MODE, RC_SWITCH, mode)
                elif position == OFF:
                    self._choose_mode(now_us, switches.mode_slot)
        if switches.kill != before.kill and switches.kill in (ON, OFF):
            action = RequestedAction.KILL if switches.kill == ON else RequestedAction.UNKILL
            self._request(now_us, action, RC_SWITCH)
        if switches.terminate != before.terminate and switches.terminate == ON:
            self._request(now_us, RequestedAction.TERMINATION, RC_SWITCH)
        if switches.gear != before.gear and before.gear in (ON, OFF) and switches.gear in (ON, OFF):
            self._topics.landing_gear = LandingGear(now_us, GEAR_UP if switches.gear == ON else GEAR_DOWN)

    def _choose_mode(self, now_us: int, slot: int) -> None:
        mode = MODE_OF_SLOT_VALUE.get(self._slots[slot - 1]) if slot else None
        if mode is not None:
            self._request(now_us, RequestedAction.SWITCH_MODE, RC_MODE_SLOT, mode)

    def _request(self, now_us: int, action: RequestedAction, source: int, mode: NavState = NavState.MANUAL) -> None:
        self._requests += 1
        kept = self._topics.action_requests[-7:]
        self._topics.action_requests = (*kept, ActionRequest(self._requests, now_us, action, source, mode))
