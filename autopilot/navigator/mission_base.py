"""What MISSION and returns along a mission do alike, each for itself: PX4's MissionBase (mission_base.cpp, v1.18).

What is flown now is watched until it is done; on the way the vehicle looks at a region of interest, follows home's
height, and keeps off the ground. Whoever is left and goes on says again what was said to gimbal and camera, and goes
back a place if pictures were taken (`mission_resume.py`).
"""

import math
from abc import ABC, abstractmethod

from sitl_emu.autopilot.navigator.mission_block import LANDS, TAKEOFFS, Reached, Target, keep_off_ground
from sitl_emu.autopilot.navigator.mission_commands import MissionCommands
from sitl_emu.autopilot.navigator.mission_legs import Work, follow_home, setpoint_of
from sitl_emu.autopilot.navigator.mission_resume import MissionResume
from sitl_emu.autopilot.navigator.payload import Payload
from sitl_emu.autopilot.navigator.precland import PrecLand
from sitl_emu.autopilot.navigator.roi import Roi
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.core.geodesy import bearing_rad


class MissionBase(ABC):
    """A mode that flies a mission's items."""

    def __init__(self, state: NavigatorState, roi: Roi, payload: Payload) -> None:
        self._state = state
        self._roi = roi
        self._payload = payload
        self._commands = MissionCommands(state, roi, payload)
        self._precland = PrecLand(state)
        self._resume = MissionResume()
        self._aligns = self._speed_waits = False
        """It turns to its next leg at the place from which it goes on, and has its speed from there."""
        self._active = self._executing = False
        self._work = Work.DEFAULT
        self._target: Target | None = None
        self._reached = Reached()
        self._home_count = 0
        """home_position.update_count as this mode has followed it."""

    @property
    def items(self) -> tuple[MissionItem, ...]:
        """The mission as uploaded."""
        return self._state.dataman.mission.items

    @abstractmethod
    def next_place(self, seq: int) -> int | None:
        """The first item with a position from `seq` on."""

    @abstractmethod
    def _item_done(self) -> None:
        """The target is done."""

    def on_active(self) -> None:
        """Every cycle of the mode."""
        if self._target is None:
            return
        self._follow_home()
        if self._aligns and self._reached.update(self._state, self._target):
            self._align(self._target)
        self._go_on()
        if self._reached.update(self._state, self._target):
            self._item_done()
        self._look_at_roi()
        if self._work is Work.PRECISION_LAND:
            self._precland.on_active()
        if self._target is not None:
            self._target = keep_off_ground(self._state, self._target)

    # --- leaving, and going on --------------------------------------------------------------------------------

    def _leave(self) -> None:
        """Another mode is flown, or the vehicle is not armed any more (on_inactivation)."""
        self._active = False
        self._payload.leave_mission()
        self._resume.leave(self._state.dataman.current_seq)
        self._state.seq_reached = -1

    def _go_back(self) -> None:
        """The mode begins: at the place before the one that it was left at, if it took pictures there."""
        dataman = self._state.dataman
        place = self._resume.begin(self.items, dataman.current_seq)
        self._aligns = self._speed_waits = place is not None
        if place is not None:
            dataman.current_seq = place

    def _go_on(self) -> None:
        """Say again what was said before the mission was left."""
        seq = self._state.dataman.current_seq
        for item in self._resume.due(seq, climbing=self._work is Work.CLIMB):
            self._commands.issue(item)
        if self._speed_waits and self._resume.is_on(seq):
            self._speed_waits = False
            self._replay_speed()

    def _replay_speed(self) -> None:
        """Say again which speed was given last before the mission was left."""
        speed = self._resume.take_speed()
        if speed is not None:
            self._commands.issue(speed)

    def _align(self, target: Target) -> None:
        """Turn to the next leg before it is flown, where the place itself has no heading."""
        state, self._aligns = self._state, False
        following = self.next_place(state.dataman.current_seq + 1)
        if following is None or math.isfinite(target.yaw_rad):
            return
        there = self.items[following]
        yaw_rad = bearing_rad(target.lat_deg, target.lon_deg, there.lat_deg, there.lon_deg)
        self._target = target._replace(yaw_rad=yaw_rad, force_heading=True)
        self._reached.restart(state.now_us)
        triplet = state.triplet
        state.triplet = triplet._replace(timestamp=state.now_us, current=setpoint_of(state, self._target))

    # --- on the way -------------------------------------------------------------------------------------------

    def _begin(self, target: Target, work: Work) -> None:
        self._target, self._work = target, work
        self._reached.restart(self._state.now_us)

    def _follow_home(self) -> None:
        count = self._state.topics.home_position.update_count
        if count > self._home_count and self._target is not None:
            self._home_count, self._target = count, follow_home(self._state, self._target)

    def _look_at_roi(self) -> None:
        """Turn to the region of interest, but not in a climb that takes off, nor in a landing.

        Above the ground a takeoff's item is a waypoint like any other (Mission::handleTakeoff).
        """
        state, target = self._state, self._target
        if target is None or not state.traits.flies or target.command in TAKEOFFS | LANDS:
            return
        triplet = state.triplet
        yaw_rad = self._roi.yaw_rad(triplet.current)
        if yaw_rad is not None:
            self._target = target._replace(yaw_rad=yaw_rad)
            state.triplet = triplet._replace(timestamp=state.now_us, current=triplet.current._replace(yaw=yaw_rad))
