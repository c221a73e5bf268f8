"""What the mission's programs see with, by the names that their option `detector` knows; the default first.

From the air the hand-made detector is the better one still, from the mast the network (`networks/field.md` has the
figures). Scores mean another thing for each, and so do the figures that confirm a target: the network's were chosen on
fields of seeds 300 to 306.
"""

from sitl_emu.missions.agriculture.detector import LABELS, ClassicalDetector
from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.confirmation import STANDING, SURVEYING
from sitl_emu.missions.companion.detector import Detector
from sitl_emu.missions.companion.perception import Known
from sitl_emu.missions.companion.selection import Selected, Wanted
from sitl_emu.missions.companion.yolo import OnnxDetector

NETWORK = "field"
LEAST = 0.15
"""Score from which the network's finds count: confirmation weighs them over many frames."""

APART_IOU = 0.3
"""Boxes that overlap more are of one patch: patches lie metres apart, and two boxes of one would share its score."""


def network() -> Detector:
    """The network `field`, asked for patches alone, of which a place has one."""
    found = OnnxDetector(networks.path_of(NETWORK), LEAST, APART_IOU, one_label=True)
    return Selected(found, {label: Wanted() for label in LABELS})


FROM_THE_AIR = {
    "classical": Known(ClassicalDetector, SURVEYING),
    "network": Known(network, SURVEYING._replace(confirm_score=0.3, report_score=0.38)),
}
FROM_THE_MAST = {
    "network": Known(network, STANDING._replace(confirm_score=0.2, report_score=0.25)),
    "classical": Known(ClassicalDetector, STANDING),
}
