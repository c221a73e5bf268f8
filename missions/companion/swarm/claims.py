"""Who serves which target: claims that all pass on, so that each target is served once, without a centre.

An aircraft *bids*: the target, what it would cost it (s), its system. Of two bids the lower cost counts, of equal costs
the lower system. It is *engaged* once every other that it hears has told it back as the owner: of two that bid for one
target one at least has given way then, in whatever order and however often messages came, so that no two are engaged
while they hear each other. What has been engaged is not outbid; what is *served* stays so.

A claim stands in a round. A lost owner's claims, those that have stood for `LASTS_US`, and those that their owner gives
up are free in the next round, and what is of a later round counts. So an owner that was only not heard for a while
learns that it is one no more as soon as it hears the others again.

All is one order (`rank`), and of each target everybody keeps the highest it has heard of: messages may come twice, late
or in any order. No clock, no messages: `sharing.py` feeds it.
"""

from collections.abc import Collection, Iterable

from sitl_emu.missions.companion.swarm.records import Claim, Key, Stage, as_sent

LASTS_US = 300_000_000
"""Longest that an owner may take to serve; ours: a flight of 25 minutes serves five targets then, or more."""
NOBODY = 0


def rank(claim: Claim) -> tuple[bool, int, Stage, float, int]:
    """Which of two claims on a target counts: the greater."""
    return claim.stage == Stage.SERVED, claim.round, claim.stage, -claim.cost_s, -claim.owner


class Claims:
    """What one aircraft knows of all claims."""

    def __init__(self, system: int) -> None:
        self._system = system
        self.known = dict[Key, Claim]()
        self._told = dict[int, dict[Key, Claim]]()
        """What each other has said, by its system."""
        self._since_us = dict[tuple[Key, int], int]()
        """When a target was first claimed in a round, as far as we know."""

    def hear(self, now_us: int, sender: int, claim: Claim) -> None:
        """What another knows of a target."""
        told = self._told.setdefault(sender, {})
        if claim.key not in told or rank(claim) > rank(told[claim.key]):
            told[claim.key] = claim
        self._take(now_us, claim)

    def join(self, now_us: int, keys: Collection[Key]) -> Claim:
        """Several sightings are one target: what is claimed of one is claimed of all; the claim that counts."""
        claims = [self.known[key] for key in keys if key in self.known]
        best = max(claims, key=rank, default=Claim((0, 0), 0, Stage.FREE, NOBODY, 0.0))
        for key in keys:
            self._take(now_us, best._replace(key=key))
        return best

    def bid(self, now_us: int, keys: Collection[Key], cost_s: float) -> None:
        """We would serve a target, if nobody can do it at a lower cost."""
        last = self.join(now_us, keys)
        for key in keys:
            self._take(now_us, as_sent(Claim(key, last.round, Stage.BID, self._system, cost_s)))

    def may_bid(self, claim: Claim, cost_s: float) -> bool:
        """Whether a bid of ours would count before this claim."""
        ours = as_sent(Claim(claim.key, claim.round, Stage.BID, self._system, cost_s))
        return claim.owner != self._system and claim.stage < Stage.ENGAGED and rank(ours) > rank(claim)

    def engage(self, now_us: int, keys: Collection[Key], others: Iterable[int]) -> bool:
        """Whether a target that we have bid for is ours now: all others have told us back as its owner."""
        claim = self.join(now_us, keys)
        if claim.owner != self._system or claim.stage < Stage.BID:
            return False
        if claim.stage == Stage.BID:
            told = [self._told.get(other, {}).get(keys_first(keys)) for other in others]
            if not all(one is not None and (one.owner, one.round) == (self._system, claim.round) for one in told):
                return False
            for key in keys:
                self._take(now_us, claim._replace(key=key, stage=Stage.ENGAGED))
        return True

    def stands_us(self, now_us: int, key: Key) -> int:
        """For how long a target has been claimed in this round, as far as we know."""
        claim = self.known.get(key)
        return now_us - self._since_us[key, claim.round] if claim is not None else 0

    def serve(self, now_us: int, keys: Collection[Key]) -> None:
        """A target has been served by us."""
        last = self.join(now_us, keys)
        for key in keys:
            self._take(now_us, last._replace(key=key, stage=Stage.SERVED, owner=self._system))

    def release(self, now_us: int, owner: int) -> None:
        """An owner will not serve what it has claimed: it gives up, or is lost."""
        for key, claim in list(self.known.items()):
            if claim.owner == owner and claim.stage in (Stage.BID, Stage.ENGAGED):
                self._take(now_us, Claim(key, claim.round + 1, Stage.FREE, NOBODY, 0.0))

    def expire(self, now_us: int) -> None:
        """What was claimed too long ago is free."""
        for key, claim in list(self.known.items()):
            stands_us = now_us - self._since_us[key, claim.round]
            if claim.stage in (Stage.BID, Stage.ENGAGED) and stands_us > LASTS_US:
                self._take(now_us, Claim(key, claim.round + 1, Stage.FREE, NOBODY, 0.0))

    def _take(self, now_us: int, claim: Claim) -> None:
        known = self.known.get(claim.key)
        if known is None or rank(claim) > rank(known):
            self.known[claim.key] = claim
            self._since_us.setdefault((claim.key, claim.round), now_us)


def keys_first(keys: Collection[Key]) -> Key:
    """The name of a target of several sightings, by which it is bid for and told back."""
    return min(keys)
