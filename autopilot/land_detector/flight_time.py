"""How long this vehicle has flown in its life: LND_FLIGHT_T_HI and LND_FLIGHT_T_LO, 64 bits of microseconds together.

PX4's LandDetector::Run (v1.18): counted from the first takeoff after arming until disarming.
"""

from typing import Final

from sitl_emu.autopilot.parameters import Parameters

LOW_BITS: Final = 32


class FlightTime:
    """Adds up flights."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._takeoff_us: int | None = None

    def update(self, now_us: int, *, armed: bool, landed: bool) -> None:
        """Run at 83 Hz."""
        if not armed:
            if self._takeoff_us is not None:
                self._add(now_us - self._takeoff_us)
                self._takeoff_us = None
        elif not landed and self._takeoff_us is None:
            self._takeoff_us = now_us

    def _add(self, flown_us: int) -> None:
        parameters, mask = self._parameters, (1 << LOW_BITS) - 1
        low, high = int(parameters["LND_FLIGHT_T_LO"]) & mask, int(parameters["LND_FLIGHT_T_HI"]) & mask
        total_us = (high << LOW_BITS | low) + flown_us
        parameters.set("LND_FLIGHT_T_HI", total_us >> LOW_BITS, notify=False)
        parameters.set("LND_FLIGHT_T_LO", total_us & mask, notify=False)
