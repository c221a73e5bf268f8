"""A flight mode that points the gimbal itself: PX4 v1.18's tasks/Utility/Gimbal.

It asks the gimbal manager for the primary control while somebody else has it, and gives back what it has asked for.
"""

from typing import Final

from sitl_emu.autopilot.commands.vehicle_commands import give_inside, tell
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import (
    NAN,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
    Topics,
    Vector3,
    VehicleCommand,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.attitude import heading

AUTOPILOT: Final[int] = mavlink.MAV_COMP_ID_AUTOPILOT1
LEVEL: Final[int] = mavlink.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | mavlink.GIMBAL_MANAGER_FLAGS_PITCH_LOCK
ALL_LOCKED: Final[int] = LEVEL | mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK
TOLD_WITHIN_US: Final = 2_000_000
"""A gimbal that has told nothing for longer is not there (Gimbal::checkForTelemetry)."""
UNCHANGED, RELEASE = -1.0, -3.0


class GimbalControl:
    """Of one flight mode."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._system_id = int(parameters["MAV_SYS_ID"])
        self._seen: GimbalManagerStatus | None = None
        self._has_asked = False

    def is_there(self, now_us: int) -> bool:
        """Whether there is a gimbal that tells its attitude."""
        told_us = self._topics.gimbal_device_attitude_status.timestamp
        return told_us > 0 and now_us < told_us + TOLD_WITHIN_US

    @property
    def yaw(self) -> float:
        """Where it looks, against north; NaN unless all its axes are locked there."""
        status = self._topics.gimbal_device_attitude_status
        return heading(status.q) if status.device_flags == ALL_LOCKED else NAN

    def turn(self, now_us: int, pitch_rate: float, yaw_rate: float) -> None:
        """Turn it by these rates, rad/s, whatever the vehicle does beneath it."""
        status = self._topics.gimbal_manager_status
        if status.timestamp and status is not self._seen:
            self._seen = status
            if (status.primary_control_sysid, status.primary_control_compid) != (self._system_id, AUTOPILOT):
                self._has_asked = True
                # To the component that has the system's number, as PX4's Gimbal.cpp has it: only where MAV_SYS_ID is
                # 1 that is the gimbal manager.
                own = float(self._system_id), float(AUTOPILOT)
                _configure(self._topics, now_us, self._system_id, own, target_component=self._system_id)
        self._point(now_us, ALL_LOCKED, (NAN, pitch_rate, yaw_rate))

    def release(self, now_us: int) -> None:
        """Leave it to whoever asks next, if it was asked for."""
        self._seen = None
        if self._has_asked:
            self._has_asked = False
            self._point(now_us, LEVEL, (NAN, 0.0, 0.0))
            release(self._topics, now_us, self._system_id)

    def _point(self, now_us: int, flags: int, rates: Vector3) -> None:
        self._topics.gimbal_manager_set_attitude = GimbalManagerSetAttitude(
            now_us, self._system_id, AUTOPILOT, flags, angular_velocity=rates
        )


def release(topics: Topics, now_us: int, system_id: int) -> None:
    """The autopilot gives up the primary control, if it has it (releaseGimbalControl)."""
    _configure(topics, now_us, system_id, (RELEASE, RELEASE))


def _configure(
    topics: Topics, now_us: int, system_id: int, primary: tuple[float, float], target_component: int = AUTOPILOT
) -> None:
    """`primary`: system and component that are to have the primary control; the secondary one stays."""
    command = VehicleCommand(
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, *primary, UNCHANGED, UNCHANGED, 0.0, 0.0, 0.0,
        target_system=system_id, target_component=target_component, source_system=system_id, source_component=AUTOPILOT,
        from_external=False,
    )  # fmt: skip
    give_inside(topics, now_us, command)
    tell(topics, now_us, command)
