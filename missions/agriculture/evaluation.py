"""What is wanted of the agriculture mission over several seeds, as rows of the table that `make evaluate` prints."""

import math
from collections.abc import Sequence

from sitl_emu.missions.mission import Figures, Row


def rows(summaries: Sequence[Figures]) -> list[Row]:
    """The rows that follow from the summaries of several seeds."""
    targets = [target for summary in summaries for target in summary["targets"]]
    confirmed = [target for target in targets if target["confirmed"]]
    inspected, wrong, false, twice = (
        sum(summary[key] for summary in summaries)
        for key in ("targets_inspected", "wrong_labels", "false_confirmations", "duplicates")
    )
    errors = [target["geolocation_error_m"] for target in confirmed]
    rmse = math.sqrt(sum(error * error for error in errors) / len(errors)) if errors else math.inf
    worst = max((summary["geolocation_rmse_m"] or math.inf) for summary in summaries)
    missions = len(summaries)
    allowed = missions // 10 if missions >= 10 else 1
    count = len(confirmed)

    def within(key: str, limit: float) -> Row:
        near = sum(target[key] is not None and target[key] <= limit for target in confirmed)
        what = "its waypoint" if key == "ugv_stop_error_m" else "the target"
        return Row(
            f"UGV stops within {limit} m of {what}", f"{near} of {count}", "≥ 9 of 10", _share(near, count) >= 0.9
        )

    return [
        Row(
            "targets confirmed, label right", f"{count} of {len(targets)}", "≥ 90 %", _share(count, len(targets)) >= 0.9
        ),
        Row(
            "of these seen by the UGV, label right",
            f"{inspected} of {count}",
            "≥ 9 of 10",
            _share(inspected, count) >= 0.9,
        ),
        Row(
            "false confirmations, wrong labels",
            f"{false}, {wrong} in {missions} missions",
            "≤ 1 in 10",
            false + wrong <= allowed,
        ),
        Row("targets reported twice", f"{twice} in {missions} missions", "≤ 1 in 10", twice <= allowed),
        Row("geolocation RMSE, all targets", f"{rmse:.2f} m", "≤ 1.5 m", rmse <= 1.5),
        Row("geolocation RMSE, worst mission", f"{worst:.2f} m", "≤ 1.5 m", worst <= 1.5),
        within("ugv_stop_error_m", 1.0),
        within("ugv_target_error_m", 2.5),
    ]


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 0.0
