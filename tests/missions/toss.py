"""A mission for tests of campaigns: nobody flies; a number follows from the seed, and decides how it ends."""

import random
from collections.abc import Sequence
from typing import Any

from sitl_emu.companion import Companion, Onboard, Script, Scripted, steps
from sitl_emu.mission import Figures, Mission, MissionScore, Options, Program, Row, RunRecord, Setting


def toss(onboard: Onboard, bias: float, wait_s: float, seed: int) -> Script:
    """Waits, says its number."""
    yield from steps.heard(onboard)
    yield from steps.pause(onboard, wait_s)
    number = round(random.Random(seed).random() + bias, 6)
    onboard.note("tossed", str(number), number=number)


def program(options: Options) -> Companion:
    """The companion."""
    bias = options.number("bias", 0.0, low=-1.0, high=1.0)
    wait_s = options.number("wait_s", 0.5, low=0.0, high=1000.0)
    seed = options.whole("seed", 0, low=0, high=10**9)
    return Scripted(lambda onboard: toss(onboard, bias, wait_s, seed))


def prepare(options: dict[str, Any], setting: Setting) -> dict[str, Any]:
    """The run's seed."""
    return options | {"seed": setting.seed}


def score(record: RunRecord) -> MissionScore:
    """Above a half it is won."""
    numbers = [event["number"] for event in record.events if event["event"] == "tossed"]
    won = bool(numbers) and numbers[0] > 0.5
    figures = {"number": numbers[0] if numbers else None, "tosses": [{"number": number} for number in numbers]}
    return MissionScore(figures, [], [] if won else ["lost the toss"])


def evaluation(summaries: Sequence[Figures]) -> list[Row]:
    """The greatest number of all."""
    greatest = max(summary["number"] for summary in summaries)
    return [Row("greatest number", f"{greatest:.2f}", "> 2", greatest > 2.0)]


MISSION = Mission(programs={"toss": Program(program, prepare)}, score=score, evaluation=evaluation)
