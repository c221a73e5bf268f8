"""What the mission's programs see with, by the names that their option `detector` knows; the default first.

`network` is the trained one (`networks/disaster.md` has its figures), `colour` a baseline that knows how often each
colour is of each class (`companion/colour.py`), to compare with, and to fly with where no network is.
"""

from pathlib import Path

from sitl_emu.missions.companion import networks
from sitl_emu.missions.companion.colour import ColourDetector
from sitl_emu.missions.companion.confirmation import SURVEYING
from sitl_emu.missions.companion.detector import Detector
from sitl_emu.missions.companion.perception import Known
from sitl_emu.missions.companion.yolo import OnnxDetector

SCATTERED = ("debris_field",)
"""Of these a picture from low shows pieces, and does not tell where they end (`flight.WHOLE`)."""
SPREADING = ("fire_region",)
"""These move on while the vehicle goes down to their edge."""
NETWORK = "disaster"
COLOURS = Path(__file__).with_name("colours.json")
LEAST = 0.25
"""Score from which the network's finds count; ultralytics' usual one."""
CONFIRMING = SURVEYING._replace(confirmations=3, confirm_score=0.3)


def network() -> Detector:
    """The network `disaster`."""
    return OnnxDetector(networks.path_of(NETWORK), LEAST)


def colour() -> Detector:
    """By the colour of pixels alone."""
    return ColourDetector(COLOURS)


FROM_THE_AIR = {
    **({"network": Known(network, CONFIRMING)} if NETWORK in networks.names() else {}),
    "colour": Known(colour, CONFIRMING._replace(confirm_score=0.5)),
}
