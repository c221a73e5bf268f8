"""What is wanted of the disaster mission over several seeds, as rows of the table that `make evaluate` prints."""

import math
from collections.abc import Sequence

from sitl_emu.missions.mission import Figures, Row


def rows(summaries: Sequence[Figures]) -> list[Row]:
    """The rows that follow from the summaries of several seeds; what is wanted is issue 12's."""
    missions = len(summaries)
    with_targets = [one for one in summaries if one["targets_total"]]
    delivered = sum(one["delivered"] > 0 for one in with_targets)
    ended = sum(one["ending"] in ("delivered", "aborted", "nothing found") for one in summaries)
    found, total = (sum(one[key] for one in summaries) for key in ("targets_found", "targets_total"))
    false, diversions = (sum(one[key] for one in summaries) for key in ("diversions_false", "diversions"))
    errors = [each["error_m"] for one in summaries for each in one["diverted"] if not each["false"]]
    rmse_m = math.sqrt(sum(error * error for error in errors) / len(errors)) if errors else math.inf
    unsafe = sum(not each["safe"] for one in summaries for each in one["deliveries"])
    apart_m = min((one["separation_m"] for one in summaries if one["separation_m"] is not None), default=None)
    twice = sum(one["served_twice"] for one in summaries)
    together = [] if apart_m is None else [
        Row("parcels for a target that had one", f"{twice}", "0", twice == 0),
        Row("least distance between two vehicles", f"{apart_m:.1f} m", "≥ 5 m", apart_m >= 5.0),
    ]  # fmt: skip
    return [
        Row("parcel within 5 m of a target, safely", f"{delivered} of {len(with_targets)}", "≥ 95 %",
            delivered >= 0.95 * len(with_targets)),
        Row("delivered or safely aborted", f"{ended} of {missions}", "all", ended == missions),
        Row("parcels on what they must not lie on", f"{unsafe}", "0", unsafe == 0),
        Row("targets found", f"{found} of {total}", "≥ 95 %", found >= 0.95 * total),
        Row("false diversions", f"{false} of {diversions} in {missions} missions", "≤ 1 in 10",
            false <= max(1, missions // 10)),
        Row("location RMSE of the edge", f"{rmse_m:.2f} m", "≤ 1.0 m", rmse_m <= 1.0),
        *together,
    ]  # fmt: skip
