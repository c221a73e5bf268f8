"""Write docs/agriculture.jpg, the README's picture, from the folder of an agriculture run.

    python tools/agriculture/make_readme_picture.py runs/agriculture-…

Left the map of the report; right a frame of the UAS that confirmed a target, and what the UGV saw when it got there.
"""

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import yaml
from matplotlib.backends.backend_agg import FigureCanvasAgg

from sitl_emu.missions.agriculture.page import page
from sitl_emu.run import score, worlds
from sitl_emu.run.report import draw_map

TARGET = Path(__file__).parents[2] / "docs" / "agriculture.jpg"
HEIGHT_PX = 800
COLUMN_PX = 530


def main() -> None:
    """Compose and write."""
    folder = Path(sys.argv[1])
    scenario = yaml.safe_load((folder / "scenario.yaml").read_text())
    world = worlds.kept(str(folder / worlds.KEPT_AS))
    summary = json.loads((folder / "summary.json").read_text())
    tracks = {vehicle["name"]: score.read_track(folder, vehicle["name"]) for vehicle in scenario["vehicles"]}
    figure = draw_map(world.truth(0.0), tracks, [page(summary)], world.photo())
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = cv2.cvtColor(np.asarray(canvas.buffer_rgba()), cv2.COLOR_RGBA2BGR)
    picture = cv2.resize(picture, (round(picture.shape[1] * HEIGHT_PX / picture.shape[0]), HEIGHT_PX))
    frames = [sorted((folder / "frames").glob(f"{name}-*.jpg"))[0] for name in ("uas", "ugv")]
    column = [cv2.resize(cv2.imread(str(frame)), (COLUMN_PX, HEIGHT_PX // 2)) for frame in frames]
    TARGET.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(TARGET), np.hstack([picture, np.vstack(column)]))
    print(TARGET)


if __name__ == "__main__":
    main()
