"""One aircraft's part in a swarm: what it says and hears over the peer link, sealed; the work, and the air.

A companion makes one when its autopilot was heard, hands it the TUNNEL messages of the peer link and the time, and
sends what `on_time` returns:

    swarm = Swarm(now_us, key_of(options), onboard.system_id, members, home, lawnmower(area, seen, overlap))
    swarm.on_message(now_us, telemetry.unix_us(now_us), msg)
    out = [(PEER_LINK, msg) for msg in swarm.on_time(now_us, telemetry.unix_us(now_us), state, parked=True)]
"""

import math
from collections.abc import Collection, Mapping, Sequence

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.geodesy import to_metres
from sitl_emu.missions.companion.area import Corner
from sitl_emu.missions.companion.coverage import Line
from sitl_emu.missions.companion.swarm.airspace import Airspace
from sitl_emu.missions.companion.swarm.extents import Cell
from sitl_emu.missions.companion.swarm.key import SwarmKey
from sitl_emu.missions.companion.swarm.records import State, parsed
from sitl_emu.missions.companion.swarm.seal import Refusal, Seal, is_sealed
from sitl_emu.missions.companion.swarm.sharing import Sharing


class Swarm:
    """Seal, sharing and airspace of one aircraft."""

    def __init__(
        self,
        now_us: int,
        key: SwarmKey,
        system: int,
        members: Collection[int],
        origin: tuple[float, float],
        lines: Sequence[Line] = (),
        *,
        swaths: Sequence[Collection[Cell]] = (),
    ) -> None:
        """`members`: the systems of all, ours among them. `origin`: latitude and longitude near by, in degrees.

        `lines`, `swaths`: see `Sharing`.
        """
        self.system = system
        self.seal = Seal(key, frozenset(members))
        self.sharing = Sharing(now_us, system, members, lines, swaths=swaths)
        self.airspace = Airspace(system, members)
        self._origin = origin

    @property
    def counts(self) -> Mapping[str, int]:
        """What was taken, and what was refused and why; for a companion's status."""
        refused = {f"sealed refused: {why}": count for why, count in sorted(self.seal.refused.items())}
        return {"sealed taken": self.seal.taken, **refused}

    def on_message(self, now_us: int, unix_us: int, msg: mavlink.MAVLink_message) -> None:
        """A message of the peer link, at the runner's time and at the autopilot's (0: not known yet)."""
        opened = self.seal.open(unix_us, self.system, msg) if is_sealed(msg) else None
        if opened is None:
            return
        records = parsed(opened.content)
        if records is None:
            self.seal.refused[Refusal.CONTENT] += 1
            return
        before = self.sharing.states.get(opened.sender)
        self.sharing.hear(now_us, opened.sender, opened.stamp_us, records)
        state = self.sharing.states.get(opened.sender)
        if state is not None and state is not before:
            self.airspace.hear(now_us, opened.sender, self.place(state), state.column, state.clear_of)

    def on_time(self, now_us: int, unix_us: int, own: State, *, parked: bool) -> list[mavlink.MAVLink_message]:
        """Goes on, and returns what is to be broadcast. `own`: of ourselves, but for the columns of air.

        `parked`: we stand on the ground with motors off.

        Nothing is said before the time is known: nobody could tell it from what was said on another day.
        """
        self.sharing.step(now_us)
        speed_m_s = math.hypot(own.v_north, own.v_east)
        self.airspace.step(now_us, self.place(own), speed_m_s, self.sharing.audible(now_us), parked=parked)
        state = own._replace(column=self.airspace.column, clear_of=self.airspace.clear_of)
        content = self.sharing.say(now_us, state) if unix_us else None
        return [self.seal.seal(unix_us, self.system, content)] if content is not None else []

    def place(self, state: State) -> Corner:
        """Where somebody is, in metres from our origin."""
        return to_metres(state.lat_deg, state.lon_deg, *self._origin)
