"""A campaign's folder: what it is, which of its runs are there, and who works in it.

campaign.json               the arms and the first seed: what makes a campaign the same; hashes of what its runs read
arms/ARM.yaml               an arm's scenario, which `sitl-emu run` flies too
results/ARM/seed-S.json     a run's summary, written at once or not at all
runs/ARM/seed-S/            a run's folder
runs.csv, runs.parquet, …   `tables.py`
report.html                 `report.py`
"""

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from sitl_emu import __version__
from sitl_emu.run.campaign.arms import Arm
from sitl_emu.run.campaign.flight import Result, part_prefix
from sitl_emu.run.trouble import Trouble, unwritable

IDENTITY, LOCK, RESULTS = "campaign.json", ".lock", "results"
CONTENTS = "contents"


class Identity(NamedTuple):
    """What makes a campaign the same: more runs go on in its folder, other ones need another."""

    name: str
    version: str
    """Of sitl-emu."""
    seed: int
    """Of each arm's first run."""
    arms: Mapping[str, Any]
    """Scenarios, as files have them, by the arm's name."""
    contents: Mapping[str, str]
    """Hashes of what its runs read beside these (`inputs.py`)."""

    @property
    def digest(self) -> str:
        """Short, for a folder's name: the same when files have changed, so that the folder is found, and says so."""
        named = {field: value for field, value in self._asdict().items() if field != CONTENTS}
        return hashlib.sha256(json.dumps(named, sort_keys=True).encode()).hexdigest()[:8]


def identity_of(name: str, seed: int, arms: Sequence[Arm], contents: Mapping[str, str]) -> Identity:
    """The identity of a campaign."""
    return Identity(name, __version__, seed, {arm.name: arm.data for arm in arms}, contents)


class Store:
    """The folder of one campaign."""

    def __init__(self, folder: Path, arms: Sequence[Arm]) -> None:
        self.folder = folder
        self.doubt = ""
        """What is to be said of the runs that are there."""
        self._slugs = {arm.name: arm.slug for arm in arms}

    def run_folder(self, arm: str, seed: int) -> Path:
        """Where a run's folder is, or will be."""
        return (self.folder / "runs" / self._slugs[arm] / f"seed-{seed}").resolve()

    def result_file(self, arm: str, seed: int) -> Path:
        """Where a run's result is, or will be."""
        return self.folder / RESULTS / self._slugs[arm] / f"seed-{seed}.json"

    def keep(self, result: Result) -> None:
        """Write a result. Raises Trouble."""
        write_whole(self.result_file(result.arm, result.seed), json.dumps(result._asdict(), indent=1) + "\n")

    def kept(self, arm: str, seed: int) -> Result | None:
        """A result, if it is there."""
        try:
            return Result(**json.loads(self.result_file(arm, seed).read_text()))
        except (OSError, ValueError, TypeError):
            return None

    def sweep(self) -> None:
        """Remove what was under way when somebody was killed."""
        for folder in (self.folder / "runs").glob(f"*/{part_prefix('seed-*')}*"):
            shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def opened(folder: Path, identity: Identity, arms: Sequence[Arm]) -> Iterator[Store]:
    """A campaign's folder, new or with what is there, for this process alone. Raises Trouble."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = {path.name for path in folder.iterdir()} - {LOCK}
        lock = (folder / LOCK).open("w")
    except OSError as error:
        raise unwritable(folder, error) from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise Trouble(f"{folder}: another campaign is at work there; wait for it, or name another --out") from None
        store = Store(folder, arms)
        if IDENTITY in there:
            store.doubt = _expect(folder, identity)
        elif there:
            raise Trouble(f"--out {folder}: this folder is not empty and holds no campaign; name a new one")
        write_whole(folder / IDENTITY, json.dumps(identity._asdict(), indent=1) + "\n")
        for arm in arms:
            write_whole(folder / "arms" / f"{arm.slug}.yaml", yaml.safe_dump(arm.data, sort_keys=False))
        store.sweep()
        yield store


def _expect(folder: Path, identity: Identity) -> str:
    """Raise Trouble where a folder holds another campaign, or runs that have read other files; what is in doubt."""
    try:
        there = json.loads((folder / IDENTITY).read_text())
    except (OSError, ValueError):
        raise Trouble(f"{folder / IDENTITY}: can't be read; name another folder with --out") from None
    # through JSON, as what lies there was
    wanted = json.loads(json.dumps(identity._asdict()))
    there = there if isinstance(there, dict) else {}
    differs = [field for field in wanted if field != CONTENTS and there.get(field) != wanted[field]]
    if differs:
        raise Trouble(f"{folder} holds another campaign ({' and '.join(differs)} differ); name a new one with --out")
    if not any((folder / RESULTS).rglob("*.json")):
        return ""
    if not isinstance(before := there.get(CONTENTS), dict):
        return f"{folder} was begun by a sitl-emu that kept no hashes: whether files have changed since can't be told"
    if what := changed(before, identity.contents):
        raise Trouble(
            f"{folder}: {what} changed since its runs were flown: put back what was, or name a new folder with --out"
        )
    return ""


def changed(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """What of that which runs read "has" or "have" changed, a file of one's own rather than code; empty for nothing."""
    names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    if len(names) > 1:
        return f"{names[-1]} and {len(names) - 1} more have"
    return f"{names[0]} has" if names else ""


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file at once or not at all. Raises Trouble."""
    part = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink()
        text = f"can't write {path}: {error.strerror}; the same command goes on once that is put right"
        raise Trouble(text) from None
