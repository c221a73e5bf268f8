"""What the mission's programs see with, by the names that their option `detector` knows; the default first.

The network `field` sees both ways (its card, `networks/field.md`, has the figures). What confirms a target from the
air was chosen on 38 fields, 1 to 10, 300 to 313 and 320 to 333 (the flight of `tools/agriculture/score_detector.py
--spacing 13 --every 3`): for each class a score a little below the lowest of the targets that are found on 300 to 313,
and the width of a patch. On fields 340 to 349, which chose none of these, all 40 targets are found, and nothing else.
Both cameras ask the same network, so that disease weighs less before the mast, too.
"""

from sitl_emu.missions.agriculture.report import LABELS
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
WEIGHTS = {"weed": 1.0, "disease": 0.65}
"""Of scores: weeds between closed rows are harder to see than disease, for which pale corn is taken."""
PATCH_M = 0.7
"""The least that is a patch (`world/kinds/corn_field/field.py` grows them from 0.36 m radius on): single plants, which
are brighter than others here and there, are 0.6 m across to the network."""


def network() -> Detector:
    """The network `field`, asked for patches alone, of which a place has one."""
    found = OnnxDetector(networks.path_of(NETWORK), LEAST, APART_IOU, one_label=True)
    return Selected(found, {label: Wanted(WEIGHTS[label]) for label in LABELS})


FROM_THE_AIR = {
    "network": Known(network, SURVEYING._replace(confirm_score=0.3, report_score=0.35, least_width_m=PATCH_M)),
}
FROM_THE_MAST = {"network": Known(network, STANDING._replace(confirm_score=0.2, report_score=0.25))}
