"""The selection file that lies on the autopilot's card, fetched before take-off."""

from sitl_emu.gcs.ftp import FtpGet
from sitl_emu.missions.companion.companion import AUTOPILOT_LINK
from sitl_emu.missions.companion.onboard import Onboard, Script
from sitl_emu.missions.companion.perception import Perception
from sitl_emu.missions.companion.selection import MFTP, Selected, parsed
from sitl_emu.missions.companion.steps.commanding import StepFailed


def select(onboard: Onboard, perception: Perception) -> Script:
    """Until what is looked for is known: at once, unless the option `selection` names a file on the autopilot."""
    if perception.selection_path is None:
        return
    detector, name = perception.detector, MFTP + perception.selection_path
    assert isinstance(detector, Selected)  # as `perception_of` makes it where there is a path
    got = yield from onboard.do(AUTOPILOT_LINK, FtpGet(onboard.system_id, perception.selection_path))
    if got.error is not None:
        raise StepFailed(f"selection {name}: {got.error}; put the file there by MAVLink FTP")
    try:
        detector.selection = parsed(got.content.decode(errors="replace"), name, detector.known)
    except ValueError as error:
        raise StepFailed(f"selection {error}") from None
    chosen = ", ".join(f"{label} {wanted.weight:g}" for label, wanted in detector.selection.items())
    onboard.note("selected", f"{name}: {chosen}")
