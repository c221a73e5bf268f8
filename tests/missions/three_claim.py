"""A mission for tests: irises that stand in examples/own_world, sight one place, and agree on who serves it."""

from sitl_emu.companion import PEER_LINK, Companion, Onboard, Outgoing, Script, Scripted, Status, mavlink, steps
from sitl_emu.gcs.geodesy import from_metres
from sitl_emu.mission import Mission, Options, Program
from sitl_emu.missions.companion.swarm.key import SwarmKey, for_a_run, key_of
from sitl_emu.missions.companion.swarm.records import Doing, Sighting, Stage, State
from sitl_emu.missions.companion.swarm.swarm import Swarm

HOME = (47.397742, 8.545594)
SERVING_S = 2.0


class Claimant(Scripted):
    """One of them; the lowest system has the lowest cost."""

    def __init__(self, key: SwarmKey, members: list[int]) -> None:
        super().__init__(self._claim)
        self._key, self._members = key, members
        self._swarm: Swarm | None = None

    @property
    def status(self) -> Status:
        """With what was taken and refused."""
        return super().status._replace(counts=self._swarm.counts if self._swarm is not None else {})

    def on_message(self, now_us: int, link: str, msg: mavlink.MAVLink_message) -> Outgoing:
        """The swarm hears the peers."""
        if self._swarm is not None and link == PEER_LINK:
            self._swarm.on_message(now_us, self.onboard.telemetry.unix_us(now_us), msg)
        return super().on_message(now_us, link, msg)

    def on_time(self, now_us: int) -> Outgoing:
        """The swarm goes on, also when this one's script has ended."""
        out, place = super().on_time(now_us), self.onboard.telemetry.place
        if self._swarm is not None and place is not None:
            own = State(Doing.WAITING, place.lat_deg, place.lon_deg, place.alt_amsl_m, 0.0, 0.0, 0.0)
            unix_us = self.onboard.telemetry.unix_us(now_us)
            out += [(PEER_LINK, msg) for msg in self._swarm.on_time(now_us, unix_us, own, parked=True)]
        return out

    def _claim(self, onboard: Onboard) -> Script:
        yield from steps.heard(onboard)
        yield from steps.ready(onboard, timeout_s=60.0)
        system = onboard.system_id
        self._swarm = swarm = Swarm(onboard.now_us, self._key, system, self._members, HOME)
        onboard.say(self._key.said)
        place = from_metres(10.0, 0.2 * (system - self._members[0]), *HOME)
        swarm.sharing.see(0, Sighting((0, 0), 0, 3, 0.8, *place, 489.0, 0.5, 0.5, 0.0))
        while True:
            sharing = swarm.sharing
            targets = sharing.targets()
            merged = [one for one in targets if len(one.keys) == len(self._members)]
            if merged and sharing.claim(onboard.now_us, merged[0]).stage == Stage.SERVED:
                break
            target = sharing.want(onboard.now_us, {one.key: 10.0 * system for one in merged})
            if target is not None:
                yield from steps.pause(onboard, SERVING_S)
                if sharing.in_touch(onboard.now_us):
                    sharing.serve(onboard.now_us)
                    onboard.note("served", f"{len(targets)} target", sightings=len(target.keys))
            yield
        yield from steps.pause(onboard, 5.0)  # until all have heard of it


def program(options: Options) -> Companion:
    """The companion."""
    first = options.whole("first", 1, 1, 250)
    return Claimant(key_of(options), [first, first + 1, first + 2])


MISSION = Mission(programs={"three-claim": Program(program, lambda options, setting: for_a_run(options, setting.seed))})
