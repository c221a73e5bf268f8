"""What the mission's programs see with, by the names that their option `detector` knows; the default first.

From the air the hand-made detector finds what the network finds, and takes other things for targets: so both are asked,
and looked at is what lies within WITHIN_DEG of straight down. What is seen well on the way there may be seen badly from
the other side, against its shade: a target is reported once its rays cross at 45 degrees. On fields 300 to 313 (the
flight of `tools/agriculture/score_detector.py --spacing 13 --every 3`) `both` gives its 56 targets 0.58 or more, and no
other thing more than 0.54; with 0.55, chosen so, it finds 55 of the 56 of fields 320 to 333 (but a weed of 0.37 m
radius), and takes nothing else for one. The network alone finds the 56 with a score of 0.29 or more, and of other
things has three at 0.42 to 0.54.
From the mast the network is the better one (`networks/field.md` has the figures). Scores mean another thing for each,
and so do the figures that confirm a target: those of the mast were chosen on fields of seeds 300 to 306, those of
`network` from the air on fields 300 to 318, both with networks before this one.

Of vehicles they know nothing. A rover 12 to 20 m below the camera (36 frames over fields 300 and 304, with a network
before this one) gets from `both` at most 0.26 up to 15 m and 0.43 at 20, from the hand-made one alone 0.53 and 0.78 (a
weed), from the network 0.17; a hexacopter before the mast (16 frames) nothing from the network, and up to 0.61 from the
hand-made one.
"""

from sitl_emu.missions.agriculture.detector import LABELS, ClassicalDetector
from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.agreeing import Agreeing
from sitl_emu.missions.companion.confirmation import STANDING, SURVEYING
from sitl_emu.missions.companion.detector import Detector
from sitl_emu.missions.companion.perception import Known
from sitl_emu.missions.companion.selection import Selected, Wanted
from sitl_emu.missions.companion.yolo import OnnxDetector

NETWORK = "field"
LEAST = 0.15
"""Score from which the network's finds count: confirmation weighs them over many frames."""
SUSPECTED = 0.05
"""The same where another detector has to agree."""
APART_IOU = 0.3
"""Boxes that overlap more are of one patch: patches lie metres apart, and two boxes of one would share its score."""

WITHIN_DEG = 37.0
"""From the picture's middle to its upper and lower edge; lines 13 m apart at 15 m, as `plan: field` has them, come as
near as 23 degrees to every place."""


def network(least: float = LEAST) -> Detector:
    """The network `field`, asked for patches alone, of which a place has one."""
    found = OnnxDetector(networks.path_of(NETWORK), least, APART_IOU, one_label=True)
    return Selected(found, {label: Wanted() for label in LABELS})


def both() -> Detector:
    """The hand-made detector's finds, as far as the network agrees."""
    return Agreeing(ClassicalDetector(), network(SUSPECTED))


FROM_THE_AIR = {
    "both": Known(
        both, SURVEYING._replace(confirm_score=0.4, report_score=0.55, settled_deg=45.0, within_deg=WITHIN_DEG)
    ),
    "classical": Known(ClassicalDetector, SURVEYING),
    "network": Known(network, SURVEYING._replace(confirm_score=0.3, report_score=0.38)),
}
FROM_THE_MAST = {
    "network": Known(network, STANDING._replace(confirm_score=0.2, report_score=0.25)),
    "classical": Known(ClassicalDetector, STANDING),
}
