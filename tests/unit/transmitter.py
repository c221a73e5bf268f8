"""A vehicle whose pilot holds a transmitter, and the channels of that."""

from typing import Any

from sitl_emu.autopilot.manual_control.manual_control import ManualControl
from sitl_emu.autopilot.manual_control.rc_update import RcUpdate
from sitl_emu.autopilot.topics import SOURCE_MAVLINK_0, InputRc, ManualControlInput

from .navigation_fake import FakeVehicle

LOW, MIDDLE, HIGH = 1000, 1500, 2000
STICKS = {"RC_MAP_ROLL": 1, "RC_MAP_PITCH": 2, "RC_MAP_THROTTLE": 3, "RC_MAP_YAW": 4}
RC = STICKS | {"RC_CHAN_CNT": 8, "COM_RC_IN_MODE": 0}
SWITCHES = {"RC_MAP_FLTMODE": 5, "RC_MAP_KILL_SW": 6, "RC_MAP_ARM_SW": 7, "RC_MAP_RETURN_SW": 8}
MODES = {"COM_FLTMODE1": 8, "COM_FLTMODE4": 1, "COM_FLTMODE6": 2}


class Pilot(FakeVehicle):
    """A vehicle whose pilot holds a transmitter, a joystick or both."""

    def __init__(self, **parameters: float) -> None:
        super().__init__(**parameters)
        self.channels: list[int] | None = None
        self.joystick: tuple[float, float, float, float] | None = None
        self.rc_update = RcUpdate(self.topics, self.parameters)
        self.manual_control = ManualControl(self.topics, self.parameters)

    def step(self) -> None:
        if self.channels is not None:
            self.topics.input_rc = InputRc(self.now_us, tuple(self.channels))
        if self.joystick is not None:
            self.topics.manual_control_mavlink = ManualControlInput(self.now_us, SOURCE_MAVLINK_0, *self.joystick)
        self.rc_update.update()
        self.manual_control.update(self.now_us)
        super().step()

    @property
    def sticks(self) -> Any:
        return self.topics.manual_control_setpoint
