"""A camera's calibration file: its intrinsics in OpenCV's terms, and where it sits on the vehicle.

A file of OpenCV's FileStorage (YAML, XML or JSON), as its calibration programs write it: `image_width` and
`image_height` (or `cameraResolution`), `camera_matrix` (3 x 3), `distortion_coefficients` (or `dist_coeffs`: k1, k2,
p1, p2, k3; or the first four). Ours are two that may be left out: `mount` (forward_m, right_m, down_m, depression_deg,
and on_gimbal: 1 for a camera on a gimbal's head, which tells where it looks), and `readout_s` of a rolling shutter, its
rows times the line's time, by the sensor's data sheet or driver. A simulated run writes one for each camera
into its folder; on hardware it is what calibrating the real camera gave. It is that of a camera that has not zoomed:
for one that has, fx and fy are so many times as large (docs/cameras.md).
"""

from pathlib import Path
from typing import Any, NamedTuple

from sitl_emu.missions.companion.camera_model import CameraModel, Distortion, Mount
from sitl_emu.missions.companion.options import Options

MATRIX = """{name}: !!opencv-matrix
   rows: {rows}
   cols: {columns}
   dt: d
   data: [ {data} ]
"""
SKEW_LIMIT = 1e-6
READOUT_LIMIT_S = 1.0
"""As of image sensors in `vehicles/image_sensor.py`."""


class Calibration(NamedTuple):
    """A camera as its companion knows it; the mount is None where the file tells none."""

    camera: CameraModel
    mount: Mount | None = None


def write(path: Path, camera: CameraModel, mount: Mount) -> None:
    """Write a calibration file. Raises OSError."""
    figures = {name: value for name, value in mount._asdict().items() if name != "on_gimbal"}
    if mount.on_gimbal:
        figures["on_gimbal"] = 1
    matrix = (camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0)
    path.write_text(
        "%YAML:1.0\n---\n"
        f"image_width: {camera.width}\nimage_height: {camera.height}\n"
        + _matrix("camera_matrix", 3, 3, matrix)
        + _matrix("distortion_coefficients", 5, 1, camera.distortion)
        + (f"readout_s: {camera.readout_s!r}\n" if camera.readout_s else "")
        + "".join(["mount:\n", *(f"   {name}: {value!r}\n" for name, value in figures.items())])
    )


def _matrix(name: str, rows: int, columns: int, numbers: tuple[float, ...]) -> str:
    return MATRIX.format(name=name, rows=rows, columns=columns, data=", ".join(repr(float(each)) for each in numbers))


def read(path: Path) -> Calibration:
    """Read a calibration file. Raises ValueError, which names the file and what it lacks."""
    import cv2

    if not path.is_file():
        raise ValueError(f"{path}: there is no such calibration file")
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except (cv2.error, SystemError):
        raise ValueError(f"{path}: not a file of OpenCV's FileStorage (YAML, XML or JSON)") from None
    try:
        matrix = _numbers(path, storage, ("camera_matrix",), (9,))
        lens = _numbers(path, storage, ("distortion_coefficients", "dist_coeffs"), (4, 5))
        width, height = _size(path, storage)
        readout = storage.getNode("readout_s")
        readout_s = 0.0 if readout.empty() else readout.real()
        mount = storage.getNode("mount")
        place = None if mount.empty() else _mount(mount)
    finally:
        storage.release()
    fx, skew, cx, _, fy, cy, *_ = matrix
    if not (fx > 0.0 and fy > 0.0 and abs(skew) < SKEW_LIMIT):
        raise ValueError(
            f"{path}: camera_matrix: {matrix}; allowed: [fx, 0, cx, 0, fy, cy, 0, 0, 1], fx and fy above 0"
        )
    if not 0.0 <= readout_s <= READOUT_LIMIT_S:
        raise ValueError(f"{path}: readout_s: {readout_s!r}; allowed: 0 (a global shutter) to {READOUT_LIMIT_S:g}")
    return Calibration(CameraModel(width, height, fx, fy, cx, cy, Distortion(*lens), readout_s), place)


def of(given: Options, mount: Mount) -> tuple[CameraModel, Mount]:
    """The camera of a program's option `calibration`, at `mount` where its file does not say.

    Without the option: 640 x 480 pixels, 90 degrees across, no distortion. Raises ValueError.
    """
    path = given.file("calibration")
    camera, told = Calibration(CameraModel()) if path is None else read(path)
    return camera, told or mount


def _mount(node: Any) -> Mount:
    forward_m, right_m, down_m, depression_deg = (node.getNode(name).real() for name in Mount._fields[:4])
    on_gimbal = node.getNode("on_gimbal")
    return Mount(forward_m, right_m, down_m, depression_deg, not on_gimbal.empty() and bool(on_gimbal.real()))


def _size(path: Path, storage: Any) -> tuple[int, int]:
    resolution = storage.getNode("cameraResolution")
    nodes = [resolution.at(0), resolution.at(1)] if resolution.isSeq() and resolution.size() == 2 else []
    nodes = nodes or [storage.getNode("image_width"), storage.getNode("image_height")]
    if any(not node.isInt() or node.real() < 1 for node in nodes):
        raise ValueError(f"{path}: image_width and image_height are needed, whole numbers")
    width, height = (int(node.real()) for node in nodes)
    return width, height


def _numbers(path: Path, storage: Any, names: tuple[str, ...], counts: tuple[int, ...]) -> list[float]:
    """The numbers of the first matrix that is there under one of these names."""
    for name in names:
        node = storage.getNode(name)
        matrix = node.mat() if node.isMap() else None
        if matrix is not None:
            numbers = [float(number) for number in matrix.ravel()]
            if len(numbers) not in counts:
                allowed = " or ".join(map(str, counts))
                raise ValueError(f"{path}: {name}: {len(numbers)} numbers; allowed: {allowed}")
            return numbers
    raise ValueError(f"{path}: {names[0]}: missing; a matrix is needed there")
