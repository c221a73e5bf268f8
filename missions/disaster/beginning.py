"""What has to be true before a flight is begun: the vehicle stands disarmed, is one of the team, and gets ready."""

from sitl_emu.missions.companion import steps
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.disaster.settings import Settings


def ready(onboard: Onboard, settings: Settings) -> Script:
    """Until the autopilot is ready, and it is known what is looked for. Raises StepFailed; asks nothing of the vehicle.

    Who starts beside a vehicle that is armed, as a companion that was started again in the air, can't know whether the
    parcel is still there, nor what the others have been promised.
    """
    yield from steps.heard(onboard)
    team, system = settings.team, onboard.system_id
    if team is not None and system not in team.members:
        told = " ".join(map(str, team.members))
        raise steps.StepFailed(f"option members: {told}: without system {system}, the vehicle's; name all MAV_SYS_ID")
    if onboard.telemetry.armed:
        raise steps.StepFailed("the vehicle is armed, and may have let its parcel go; land and disarm it first")
    yield from steps.select(onboard, settings.perception)
    onboard.enter("waiting for health", "autopilot gets ready")
    yield from steps.ready(onboard, settings.ready_timeout_s)
