"""Where the files lie that an SDF file names: model://, file:// and plain paths; nothing is fetched."""

import os
from pathlib import Path
from xml.etree.ElementTree import Element

from sitl_emu.world.description.common import WorldError
from sitl_emu.world.sdf import safe_xml
from sitl_emu.world.sdf.poses import NotRead

PATHS = ("SDF_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH")
"""Variables of the environment that name folders of models, as Gazebo has them."""


def find(uri: str, folder: Path) -> Path:
    """The file or folder of a URI in an SDF file that lies in `folder`. Raises NotRead."""
    uri = uri.strip()
    scheme, colon, rest = uri.partition("://")
    if not colon:
        rest, scheme = uri, "file"
    if scheme not in ("model", "file"):
        raise NotRead(f"{uri}: nothing is fetched; copy it to a folder that {PATHS[1]} names, and write model://")
    places = [folder / rest] if scheme == "file" else [place / rest for place in _model_folders(folder)]
    for place in places:
        if place.exists():
            return place
    raise NotRead(f"{uri}: not found in {', '.join(dict.fromkeys(str(place.parent) for place in places))}")


def _model_folders(folder: Path) -> list[Path]:
    named = [Path(each) for name in PATHS for each in os.environ.get(name, "").split(os.pathsep) if each]
    near = [folder, folder / "models", folder.parent, folder.parent / "models"]
    return [*named, *near]


def model_file(folder: Path) -> Path:
    """The SDF file of a model's folder: the last that model.config names, else model.sdf. Raises NotRead."""
    if folder.is_file():
        return folder
    config = folder / "model.config"
    if config.is_file():
        try:
            named = [(each.get("version", ""), (each.text or "").strip()) for each in safe_xml.read(config).iter("sdf")]
        except WorldError as error:
            raise NotRead(str(error)) from None
        for _, name in sorted(named, reverse=True):
            if (folder / name).is_file():
                return folder / name
    if (folder / "model.sdf").is_file():
        return folder / "model.sdf"
    raise NotRead(f"{folder}: there is no model.sdf in it")


def uri_of(element: Element) -> str:
    """The `uri` in an element. Raises NotRead."""
    uri = (element.findtext("uri") or "").strip()
    if not uri:
        raise NotRead(f"{element.tag}: has no uri")
    return uri


def told_from(folder: Path, path: Path) -> str:
    """A file as a world file in a folder names it: by what lies below, else in full."""
    whole, base = path.resolve(), folder.resolve()
    return whole.relative_to(base).as_posix() if whole.is_relative_to(base) else str(whole)
