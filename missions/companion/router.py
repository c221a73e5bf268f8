"""Whether a message that came in on one of a companion's links is for the companion.

MAVLink's addressing by target system and component (https://mavlink.io/en/guide/routing.html), as narrow as the job
allows: nothing of a peer goes on to our autopilot, neither commands nor missions. Who arms a vehicle or changes its
mission is its own companion or its pilot; a peer asks the companion (`mission_server.py`), which decides when. Nor does
anything of our autopilot go on to a peer: `peer_link.py` sends what a peer should know of us.
"""

from sitl_emu.core import dialect as mavlink
from sitl_emu.missions.companion.companion import COMPONENT_ID


def is_for_companion(msg: mavlink.MAVLink_message, system: int) -> bool:
    """Whether it is addressed to the companion of our `system`, to all its components, or to everybody."""
    target_system: int = getattr(msg, "target_system", 0)
    target_component: int = getattr(msg, "target_component", 0)
    return target_system == 0 or (target_system == system and target_component in (0, COMPONENT_ID))
