"""Which action is flown of all that are asked for: the worst, after a hold in which the pilot may take over.

PX4's FailsafeBase (src/modules/commander/failsafe/framework.cpp, v1.18). What is asked for, say the rules
(`failsafe.py`). An action holds first, for COM_FAIL_ACT_T; a delay that was used up grows again four times as slowly. A
pilot who changes the mode while an action is flown, or moves the sticks where that is allowed, takes over until
something new fails. An action that cannot be flown is replaced by the next worse one that can. Who lands or returns
already is only warned of what would make it return.

Left out: failsafes that external modes defer.
"""

from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.parameters import Parameters


class Action(IntEnum):
    """Further down is worse, and wins."""

    NONE = 0
    WARN = 1
    FALLBACK_POSCTL = 2
    FALLBACK_ALTCTL = 3
    FALLBACK_STAB = 4
    HOLD = 5
    RTL = 6
    LAND = 7
    DESCEND = 8
    DISARM = 9
    TERMINATE = 10


class Clear(IntEnum):
    """When an action ends."""

    WHEN_CONDITION_CLEARS = 0
    ON_MODE_CHANGE_OR_DISARM = 1
    ON_DISARM = 2
    NEVER = 3


class Takeover(IntEnum):
    """Whether the pilot may take over; the most restrictive of all active actions counts."""

    ALWAYS = 0
    BY_MODE = 1
    """Not by moving the sticks."""
    AUTO = 2
    """Always, after the hold; where there is none (COM_FAIL_ACT_T), by mode."""
    NEVER = 3


class Option(NamedTuple):
    """What a rule asks for."""

    action: Action = Action.NONE
    clear: Clear = Clear.WHEN_CONDITION_CLEARS
    takeover: Takeover = Takeover.AUTO
    cause: int = 0
    """failsafe_cause_t of the events; 0 is generic."""


Rule = tuple[str, bool, Option]
"""Its name, whether it fails, what it asks for."""
CAUSE_GENERIC: Final = 0
LEAST_HOLD_S: Final = 0.1
ALL_SLOTS = frozenset(range(8))
"""PX4 puts an action into the last free one, and tells of two alike the first's cause: often that of the later."""
REFILL: Final = 4
"""A delay that was used grows again so many times as slowly."""
NOT_DELAYED = frozenset((Action.NONE, Action.WARN, Action.HOLD, Action.DISARM, Action.TERMINATE))
TAKEN_OVER_FROM = frozenset((Action.HOLD, Action.RTL, Action.LAND, Action.DESCEND))
"""Modes that sticks fly need no taking over."""
_FALLBACK_MODES = (
    (Action.FALLBACK_POSCTL, NavState.POSCTL),
    (Action.FALLBACK_ALTCTL, NavState.ALTCTL),
    (Action.FALLBACK_STAB, NavState.STAB),
    (Action.HOLD, NavState.AUTO_LOITER),
    (Action.RTL, NavState.AUTO_RTL),
    (Action.LAND, NavState.AUTO_LAND),
    (Action.DESCEND, NavState.DESCEND),
)
MODE_OF_ACTION: Final = dict(_FALLBACK_MODES) | {Action.TERMINATE: NavState.TERMINATION}
ONLY_WARNED = {
    NavState.AUTO_LAND: (Action.RTL,),
    NavState.AUTO_RTL: (Action.RTL,),
    NavState.AUTO_PRECLAND: (Action.RTL, Action.LAND),
}
"""Who flies this already, is not made to."""


class Notice(NamedTuple):
    """What people are told of a failsafe."""

    action: Action
    cause: int
    user_mode: NavState
    delayed_action: Action = Action.NONE
    """What follows after the hold; NONE: it does not hold first."""
    hold_s: int = 0


class Situation(NamedTuple):
    """What an action is chosen for."""

    armed: bool
    user_mode: NavState
    user_mode_changed: bool
    """Somebody has asked for a mode since the last time, perhaps for the same one."""
    sticks_take_over: bool
    """The pilot moves the sticks, to have the vehicle back."""
    can_run: int
    """Bit per NavState: modes that could be flown."""
    fallback: Callable[[NavState], Action]
    """The action that a mode needs which can't be flown itself."""


class _Asked:
    """An action that is active."""

    __slots__ = ("failing", "option", "slot")

    def __init__(self, option: Option, slot: int) -> None:
        self.option, self.failing, self.slot = option, True, slot


class _Selected(NamedTuple):
    action: Action
    delayed: Action = Action.NONE
    cause: int = CAUSE_GENERIC
    user_mode: NavState = NavState.AUTO_LOITER
    taken_over: bool = False


class FailsafeFramework:
    """Keeps the active actions, and selects."""

    def __init__(
        self,
        parameters: Parameters,
        notice: Callable[[Notice], None],
        told_takeover: Callable[[], None] = lambda: None,
    ) -> None:
        """`told_takeover()`: the pilot has taken over from an action."""
        self._parameters, self._notice, self._told_takeover = parameters, notice, told_takeover
        self._active: dict[str, _Asked] = {}
        self._delay_us = 0
        self._start_delay_us = self._configured_us
        self._pending: int | None = None
        self._last_us: int | None = None
        self._was_armed = False
        self.selected = Action.NONE
        """The action that is flown now."""
        self.taken_over = False
        """The pilot has taken over from an action that still has its reason."""
        self.user_mode = NavState.AUTO_LOITER
        """What the pilot wants, as a failsafe leaves it."""

    @property
    def holds(self) -> bool:
        """A delay runs, or has yet to grow again."""
        return self._delay_us > 0 or self._start_delay_us < self._configured_us

    @property
    def _configured_us(self) -> int:
        return int(self._parameters["COM_FAIL_ACT_T"] * 1e6)

    def refresh(self) -> None:
        """Parameters have changed."""
        self._start_delay_us = self._configured_us

    def select(self, now_us: int, rules: Iterable[Rule], situation: Situation) -> NavState:
        """The mode to fly."""
        armed, user_mode = situation.armed, situation.user_mode
        elapsed_us = 0 if self._last_us is None else now_us - self._last_us
        self._last_us = now_us
        if armed is not self._was_armed:
            self._was_armed = armed
            self._forget(Clear.ON_DISARM)
            self._forget(Clear.ON_MODE_CHANGE_OR_DISARM)
            self.taken_over = False
        changed = situation.user_mode_changed or user_mode is not self.user_mode
        situation = situation._replace(user_mode_changed=changed)
        if changed or self.taken_over:
            self._forget(Clear.ON_MODE_CHANGE_OR_DISARM)
        self._delay_us = max(0, self._delay_us - elapsed_us)
        for name, fails, option in rules:
            self._judge(name, fails, option)
        if self.selected > Action.HOLD or not _runs(situation.can_run, NavState.AUTO_LOITER) or self.taken_over:
            self._delay_us = 0
        chosen = self._choose(situation)
        self._wait(elapsed_us, delaying=chosen.delayed is not Action.NONE)
        if chosen.action > self.selected:
            self._tell(chosen.action, chosen.delayed, chosen.cause, user_mode)
        elif self._pending is not None:
            self._tell(Action.WARN, Action.NONE, self._pending, user_mode)
        self._pending = None
        self.user_mode = chosen.user_mode
        begins = self.selected <= Action.WARN < chosen.action
        if begins and chosen.user_mode is NavState.ORBIT:
            self.user_mode = NavState.AUTO_LOITER  # where it stays when the failsafe is over
        self.selected, self.taken_over = chosen.action, chosen.taken_over
        return MODE_OF_ACTION.get(self.selected, self.user_mode)

    # --- what is asked for ------------------------------------------------------------------------------------

    def _forget(self, clear: Clear) -> None:
        """Actions that end so, and fail no more."""
        for name in [name for name, one in self._active.items() if one.option.clear is clear and not one.failing]:
            del self._active[name]

    def _judge(self, name: str, fails: bool, option: Option) -> None:
        known = self._active.get(name)
        if fails and known is None:
            self._begin(name, option)
        elif fails and known is not None:
            known.failing, known.option = True, known.option._replace(action=option.action)
        elif known is not None:
            known.failing = False
            if known.option.clear is Clear.WHEN_CONDITION_CLEARS:
                del self._active[name]

    def _begin(self, name: str, option: Option) -> None:
        if option.takeover is Takeover.AUTO:
            holds = self._parameters["COM_FAIL_ACT_T"] > LEAST_HOLD_S
            if holds and option.action is not Action.WARN and self._delay_us == 0:
                self._delay_us = self._start_delay_us
            option = option._replace(takeover=Takeover.ALWAYS if holds else Takeover.BY_MODE)
        self._active[name] = _Asked(option, max(ALL_SLOTS - {one.slot for one in self._active.values()}, default=0))
        if option.action is not Action.NONE:
            self._pending = option.cause
        if option.action >= Action.HOLD:
            self.taken_over = False

    def _wait(self, elapsed_us: int, *, delaying: bool) -> None:
        """A condition that comes and goes has its action at some time, too (updateStartDelay)."""
        if delaying:
            self._start_delay_us = max(0, self._start_delay_us - elapsed_us)
        else:
            self._start_delay_us = min(self._start_delay_us + elapsed_us // REFILL, self._configured_us)

    def _tell(self, action: Action, delayed: Action, cause: int, user_mode: NavState) -> None:
        holds = action is Action.HOLD and delayed is not Action.NONE
        hold_s = (self._delay_us + 500_000) // 1_000_000 if holds else 0
        self._notice(Notice(action, cause, user_mode, delayed if holds else Action.NONE, hold_s))

    # --- which is flown ---------------------------------------------------------------------------------------

    def _choose(self, situation: Situation) -> _Selected:
        armed, user_mode, user_mode_changed, sticks_take_over, can_run, fallback = situation
        if user_mode is NavState.TERMINATION or self.selected is Action.TERMINATE:
            return _Selected(Action.TERMINATE, user_mode=user_mode)
        if not armed:
            return _Selected(Action.NONE, user_mode=user_mode)
        action, cause, takeover = Action.NONE, CAUSE_GENERIC, Takeover.ALWAYS
        for one in sorted(self._active.values(), key=_slot_of):
            if one.option.action is not Action.NONE:
                takeover = max(takeover, one.option.takeover)
                if one.option.action > action:
                    action, cause = one.option.action, one.option.cause
        delayed = Action.NONE
        may_wait = self._delay_us > 0 and not self.taken_over and takeover <= Takeover.BY_MODE
        if may_wait and action not in NOT_DELAYED:
            delayed, action, takeover = action, Action.HOLD, Takeover.BY_MODE
        by_mode = user_mode_changed and self.selected > Action.WARN
        wants = by_mode or (sticks_take_over and takeover is Takeover.ALWAYS)
        allowed = takeover <= Takeover.BY_MODE and (self.taken_over or wants)
        taken_over = allowed and action in TAKEN_OVER_FROM
        if taken_over:
            if sticks_take_over and not self.taken_over:
                user_mode = NavState.POSCTL
            if not self.taken_over:
                self._told_takeover()
            delayed = Action.NONE
            action = max(Action.WARN, fallback(user_mode))
        possible = _possible(action, can_run)
        if possible is not action:
            cause = CAUSE_GENERIC
        avoided = ONLY_WARNED.get(user_mode, ())
        if (possible in avoided or delayed in avoided) and _runs(can_run, user_mode):
            possible, delayed = Action.WARN, Action.NONE
        return _Selected(possible, delayed, cause, user_mode, taken_over)


def _slot_of(asked: _Asked) -> int:
    return asked.slot


def _runs(can_run: int, mode: NavState) -> bool:
    return bool(can_run >> mode & 1)


def _possible(action: Action, can_run: int) -> Action:
    """The action, or the next worse one that can be flown."""
    if action < Action.FALLBACK_POSCTL or action > Action.DESCEND:
        return action
    for candidate, mode in _FALLBACK_MODES:
        if candidate >= action and _runs(can_run, mode):
            return candidate
    return Action.TERMINATE
