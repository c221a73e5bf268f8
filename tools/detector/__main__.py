"""The detector's data, training and scores, each by one command; `python -m tools.detector COMMAND --help`."""

import argparse
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.detector.plan import SPLITS, Plan

DEFAULT = Path("runs/detector")
"""Each subject has a folder in it: `data`, `training`, `detector.onnx`, `scores`."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.detector", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    _dataset(commands.add_parser("dataset", help="draw frames of many worlds, with boxes"))
    _train(commands.add_parser("train", help="train the network, or go on (needs the extra `train`)"))
    _export(commands.add_parser("export", help="write a trained network as ONNX (needs the extra `train`)"))
    _evaluate(commands.add_parser("evaluate", help="score an ONNX file on all sets, as tables and a picture"))
    _speed(
        commands.add_parser("speed", help="pictures a second by input size, cores and bits (needs the extra `train`)")
    )
    for command in commands.choices.values():
        command.add_argument("--subject", choices=("disaster", "field"), default="disaster", help="what is looked for")
    given = parser.parse_args(arguments)
    try:
        given.run(given)
    except (OSError, ValueError, ImportError) as error:
        print(f"{given.command}: {error}", file=sys.stderr)
        return 1
    return 0


def _dataset(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, help="default: runs/detector/SUBJECT/data")
    parser.add_argument("--images", type=int, default=4200)
    parser.add_argument("--held-out", type=int, default=360)
    parser.add_argument("--size", type=int, nargs=2, default=(640, 480), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--splits", nargs="+", choices=SPLITS, default=SPLITS, metavar="SPLIT",
                        help=f"whose worlds are drawn, of {', '.join(SPLITS)}; default: all")  # fmt: skip
    parser.set_defaults(run=_run_dataset)


def _run_dataset(given: argparse.Namespace) -> None:
    from tools.detector import dataset

    width, height = given.size
    plan = Plan(
        _path(given, given.out, "data"),
        given.images,
        given.held_out,
        width=width,
        height=height,
        seed=given.seed,
        subject=given.subject,
        splits=tuple(given.splits),
    )
    print(dataset.draw(plan, given.processes))


def _path(given: argparse.Namespace, path: Path | None, *inner: str) -> Path:
    return path or DEFAULT.joinpath(given.subject, *inner)


def _train(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--data", type=Path, help="default: runs/detector/SUBJECT/data")
    parser.add_argument("--out", type=Path, help="default: runs/detector/SUBJECT/training")
    parser.add_argument("--epochs", type=int, default=100)
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--width", type=float, default=1.0, help="of the network: 1 is 3 million parameters")
    parser.add_argument("--size", type=int, nargs=2, default=(416, 320), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument(
        "--rate", type=float, default=0.01, help="of learning, at its highest; less to go on with --start"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=0, help="processes that change pictures")
    parser.add_argument(
        "--start", type=Path, help="what to begin with: a checkpoint or ONNX file of a network as wide or half"
    )
    parser.add_argument("--areas-only", action="store_true", help="only what says how much of each part shows a class")
    parser.add_argument("--validate-every", type=int, default=1, metavar="EPOCHS", help="and after the last")
    parser.add_argument("--minutes", type=float, default=math.inf, help="of this sitting; the next goes on")
    parser.add_argument("--within", type=float, default=math.inf, metavar="MINUTES",
                        help="of a lent machine: all is over by then, however many epochs that are")  # fmt: skip
    parser.set_defaults(run=_run_train)


def _run_train(given: argparse.Namespace) -> None:
    from tools.detector import train

    width, height = given.size
    data, out = _path(given, given.data, "data"), _path(given, given.out, "training")
    train.train(train.Settings(
        data, out, given.epochs, given.batch, given.width, width, height, given.rate, seed=given.seed,
        workers=given.workers, start=given.start, areas_only=given.areas_only,
        validate_every=given.validate_every, minutes=given.minutes, within_minutes=given.within,
    ))  # fmt: skip


def _export(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--checkpoint", type=Path, help="default: runs/detector/SUBJECT/training/best.pt")
    parser.add_argument("--out", type=Path, help="default: runs/detector/SUBJECT/detector.onnx")
    parser.add_argument("--int8", action="store_true", help="write detector.int8.onnx beside it")
    parser.add_argument("--data", type=Path, help="what calibrates it; default: runs/detector/SUBJECT/data")
    parser.set_defaults(run=_run_export)


def _run_export(given: argparse.Namespace) -> None:
    from tools.detector import export

    out = _path(given, given.out, "detector.onnx")
    export.export(_path(given, given.checkpoint, "training", "best.pt"), out)
    if given.int8:
        export.quantise(out, out.with_suffix(".int8.onnx"), _path(given, given.data, "data"))


def _evaluate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--model", type=Path, help="default: runs/detector/SUBJECT/detector.onnx")
    parser.add_argument("--data", type=Path, help="default: runs/detector/SUBJECT/data")
    parser.add_argument("--out", type=Path, help="default: runs/detector/SUBJECT/scores")
    parser.add_argument("--baseline", action="store_true", help="say what colour alone comes to as well: minutes more")
    parser.set_defaults(run=_run_evaluate)


def _run_evaluate(given: argparse.Namespace) -> None:
    from tools.detector import evaluate

    model, data = _path(given, given.model, "detector.onnx"), _path(given, given.data, "data")
    evaluate.evaluate(model, data, _path(given, given.out, "scores"), given.baseline)


def _speed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--checkpoint", type=Path, help="default: runs/detector/SUBJECT/training/best.pt")
    parser.add_argument("--data", type=Path, help="what calibrates 8 bits; default: runs/detector/SUBJECT/data")
    parser.set_defaults(run=_run_speed)


def _run_speed(given: argparse.Namespace) -> None:
    from tools.detector import speed

    speed.measure(_path(given, given.checkpoint, "training", "best.pt"), _path(given, given.data, "data"))


if __name__ == "__main__":
    sys.exit(main())
