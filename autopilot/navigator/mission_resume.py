"""How a mission goes on that was left: where, and what it says again to gimbal and camera.

PX4's MissionBase (on_activation, on_active, cacheItem; src/modules/navigator/mission_base.cpp, v1.18). What was said
last of each kind before the item at which it goes on is said again: a camera's mode at once, a gimbal's place once the
vehicle is as high as it shall be, and that pictures are taken from the next item on. A mission that was taking pictures
goes back to the place before the one that it was left at, so that none is missing; it has its speed from the next item
on too, and that of where it was left. A speed that was not said again before it was left once more is kept.
"""

from collections.abc import Sequence

from sitl_emu.autopilot.commands.vehicle_commands import nearest
from sitl_emu.autopilot.navigator.mission_block import WITH_POSITION
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.core import dialect as mavlink

MODE, GIMBAL_OWNER, GIMBAL, TRIGGER = "camera mode", "gimbal configure", "gimbal control", "camera trigger"
SPEED = "speed"
IMAGE_START = mavlink.MAV_CMD_IMAGE_START_CAPTURE
TRIGGER_CONTROL = mavlink.MAV_CMD_DO_TRIGGER_CONTROL
TRIGGER_DISTANCE = mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST
KIND = {
    mavlink.MAV_CMD_SET_CAMERA_MODE: MODE,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: GIMBAL_OWNER,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: GIMBAL,
    TRIGGER_DISTANCE: TRIGGER,
    TRIGGER_CONTROL: TRIGGER,
    IMAGE_START: TRIGGER,
    mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: TRIGGER,
    mavlink.MAV_CMD_DO_CHANGE_SPEED: SPEED,
}


class MissionResume:
    """Knows where a mission was left, and what is still to be said since it went on."""

    def __init__(self) -> None:
        self._left_seq = self._begun_seq = -1
        self._unsaid: dict[str, MissionItem] = {}

    def leave(self, seq: int) -> None:
        """The mission is left at an item."""
        self._left_seq = seq

    def forget(self) -> None:
        """It is another mission now, or another item was chosen."""
        self._left_seq = -1

    def note(self, seq: int) -> None:
        """The current item while another mode is flown: whoever has moved it on, it is not gone back from there."""
        if seq != self._left_seq:
            self._left_seq = -1

    def begin(self, items: Sequence[MissionItem], seq: int) -> int | None:
        """The mission begins or goes on at an item; the place to go back to first, if it is to."""
        place = None
        self._unsaid = {kind: item for kind, item in self._unsaid.items() if kind == SPEED}
        for item in items[:seq]:
            if item.command in KIND:
                self._unsaid[KIND[item.command]] = item
            elif item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
                self._unsaid.pop(SPEED, None)
        if self._left_seq > 0 and takes_pictures(self._unsaid.get(TRIGGER)):
            before = reversed(range(self._left_seq))
            place = next((each for each in before if items[each].command in WITH_POSITION), None)
        self._begun_seq, self._left_seq = seq if place is None else place, -1
        return place

    def is_on(self, seq: int) -> bool:
        """Whether the mission has come beyond the item at which it went on."""
        return seq > self._begun_seq

    def due(self, seq: int, *, climbing: bool) -> list[MissionItem]:
        """Items to be said again now; each once."""
        kinds = [MODE]
        if not climbing:
            kinds += [GIMBAL_OWNER, GIMBAL]
        if self.is_on(seq) and takes_pictures(self._unsaid.get(TRIGGER)):
            kinds.append(TRIGGER)
        return [self._unsaid.pop(kind) for kind in kinds if kind in self._unsaid]

    def take_speed(self) -> MissionItem | None:
        """The item that gave the speed, if it is still to be said again, which now is done."""
        return self._unsaid.pop(SPEED, None)


def takes_pictures(item: MissionItem | None) -> bool:
    """Whether pictures are taken after this item of a camera trigger."""
    if item is None:
        return False
    starts = item.command == TRIGGER_CONTROL and nearest(item.param1) == 1
    return starts or item.command == IMAGE_START or (item.command == TRIGGER_DISTANCE and item.param1 > 0.0)
