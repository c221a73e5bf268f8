"""An area divided among scanners: whose each of its scan lines is.

The lines are numbered as `coverage.lawnmower` lays them, from the same area, footprint and start on all aircraft, so
that all have the same lines by the same numbers without a word. Whose a line is follows from who is there: a lost
member's lines go to the others, the rest stays as it was, so that nobody's way changes without need.
"""

from collections.abc import Collection, Sequence

from sitl_emu.missions.companion.coverage import Line


def shares(lines: Sequence[Line], members: Collection[int], there: Collection[int]) -> dict[int, list[int]]:
    """The numbers of each member's lines: following ones, about equally long in all, for those who are there.

    `there`: the members that are not lost; what the lost would have scanned is divided among these in the same way.
    """
    divided = _divided(lines, range(len(lines)), sorted(members))
    left = {member: divided[member] for member in sorted(there)}
    for lost in sorted(set(members) - set(there)):
        for member, more in _divided(lines, divided[lost], sorted(there)).items():
            left[member] = sorted([*left[member], *more])
    return left


def _divided(lines: Sequence[Line], numbers: Collection[int], members: Sequence[int]) -> dict[int, list[int]]:
    """Cut where equal lengths end, each line to whom its middle falls."""
    parts: dict[int, list[int]] = {member: [] for member in members}
    if not members:
        return parts
    lengths = [lines[number].length_m for number in numbers]
    whole, before = sum(lengths) or 1.0, 0.0
    for number, length in zip(numbers, lengths, strict=True):
        place = int((before + length / 2.0) / whole * len(members))
        parts[members[min(place, len(members) - 1)]].append(number)
        before += length
    return parts
