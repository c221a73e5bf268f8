"""The networks that come with the package, each with its model card (NAME.md): what it learnt, and where it fails.

They are made by `tools/detector` of the checkout, by one command each, from pictures of our own renderer alone.
"""

from pathlib import Path

FOLDER = Path(__file__).parent
SUFFIX = ".onnx"


def names() -> list[str]:
    """Of all of them."""
    return sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}"))


def path_of(model: str | Path) -> Path:
    """The file of a network by its name; whatever else is given is a file itself."""
    return FOLDER / f"{model}{SUFFIX}" if str(model) in names() else Path(model)
