"""A campaign's results as tables: a row for each run, and a table for each list of records that its summaries hold.

`runs` has the arm, what varies, the seed, the outcome, and every figure of summary.json that is one value. A list of
records in it, such as agriculture's `targets`, is a table of its own with a row for each record of each run. All are
CSV and Parquet, the latter by arro3 (MIT or Apache-2): 33 MB and no dependencies; pyarrow's wheel alone is 55.
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sitl_emu.run.campaign.arms import Arm
from sitl_emu.run.campaign.flight import Result
from sitl_emu.run.campaign.store import write_whole
from sitl_emu.run.score import SUCCESS

Row = dict[str, Any]
RUNS = "runs"
NOT_OF_A_ROW = ("scenario", "seed", "outcome", "lines", "wall_clock")
"""Of a summary: what stands in each row in another form, or is no figure."""
HEAD = ("arm", "seed", "outcome", "success")
"""Columns that every row has, beside what varies."""
MACHINE = ("wall_s", "speed_factor", "tries", "host")
"""Columns that depend on the machine."""


def rows_of(results: Sequence[Result], arms: Mapping[str, Arm]) -> list[Row]:
    """A row for each run."""
    rows, columns = list[Row](), varied_columns(results, arms)
    for result in results:
        varied = {columns[name]: value for name, value in arms[result.arm].values.items()}
        head = {"arm": result.arm, **varied, "seed": result.seed}
        outcome = (result.summary or {})["outcome"]
        flown = {"outcome": outcome, "success": outcome == SUCCESS}
        machine = {"wall_s": result.wall_s, "tries": result.tries, "host": result.host}
        rows.append({**head, **flown, **_figures(result), **machine})
    return rows


def varied_columns(results: Sequence[Result], arms: Mapping[str, Arm]) -> dict[str, str]:
    """The column of each key that varies, by its short name: that name, or the whole key where a figure has it."""
    taken = {*HEAD, *MACHINE, *(figure for result in results for figure in _figures(result))}
    keys = {name: key for arm in arms.values() for name, key in arm.keys.items()}
    return {
        name: next((column for column in (name, key) if column not in taken), f"varied.{key}")
        for name, key in keys.items()
    }


def _figures(result: Result) -> Row:
    return _scalars({name: value for name, value in (result.summary or {}).items() if name not in NOT_OF_A_ROW})


def records_of(results: Sequence[Result]) -> dict[str, list[Row]]:
    """Tables of the lists of records in summaries, by their names."""
    tables = dict[str, list[Row]]()
    for result in results:
        for name, value in (result.summary or {}).items():
            if isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
                tables.setdefault(name, []).extend(
                    {"arm": result.arm, "seed": result.seed, **_scalars(one)} for one in value
                )
    return tables


def write(folder: Path, results: Sequence[Result], arms: Mapping[str, Arm]) -> list[Path]:
    """Write all tables; their files. Raises Trouble."""
    named = {RUNS: rows_of(results, arms)}
    named |= {name: rows for name, rows in records_of(results).items() if name != RUNS}
    return [path for name, rows in named.items() for path in (_csv(folder, name, rows), _parquet(folder, name, rows))]


def columns_of(rows: Sequence[Row]) -> dict[str, list[Any]]:
    """All columns, in the order of their first row; what a row lacks is None."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}


def _scalars(data: Mapping[str, Any], prefix: str = "") -> Row:
    """The single values of nested mappings, by dotted names; other lists than of records as JSON."""
    flat = Row()
    for name, value in data.items():
        if isinstance(value, Mapping):
            flat |= _scalars(value, f"{prefix}{name}.")
        elif not isinstance(value, list):
            flat[prefix + name] = value
        elif not any(isinstance(one, Mapping | list) for one in value):
            flat[prefix + name] = json.dumps(value)
    return flat


def _csv(folder: Path, name: str, rows: Sequence[Row]) -> Path:
    columns, text = columns_of(rows), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    path = folder / f"{name}.csv"
    write_whole(path, text.getvalue())
    return path


def _parquet(folder: Path, name: str, rows: Sequence[Row]) -> Path:
    from arro3.core import Array, Table
    from arro3.io import write_parquet

    arrays = {key: Array(*_typed(values)) for key, values in columns_of(rows).items()}
    path, content = folder / f"{name}.parquet", io.BytesIO()
    write_parquet(Table.from_pydict(arrays), content)
    write_whole(path, content.getvalue())
    return path


def _typed(values: Sequence[Any]) -> tuple[list[Any], Any]:
    """A column with the narrowest type that all its values have."""
    from arro3.core import DataType

    there = {type(value) for value in values if value is not None}
    if there == {bool}:
        return list(values), DataType.bool()
    if there == {int}:
        return list(values), DataType.int64()
    if there and there <= {int, float}:
        return [None if value is None else float(value) for value in values], DataType.float64()
    return [None if value is None else str(value) for value in values], DataType.string()
