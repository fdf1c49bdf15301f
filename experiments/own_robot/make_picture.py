"""Picture of the tutorial on an own robot: the hexacopter in flight, and its height over time.

In the folder of the tutorial, after its last command::

    python -m seals.experiments.own_robot.make_picture flight own_robot.webp
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from seals import load_log
from seals.cli.main import main as seals
from seals.report.pictures import figure_class

FRAME = 1.5
"""Time of the frame that is shown [s]; it hovers then."""


def _draw(run: Path, picture: Path) -> None:
    """Render one frame of a run, and draw height and way beside it.

    Args:
        run: folder that ``seals teleop`` wrote.
        picture: the file to write, ``.webp`` or ``.png``.

    Raises:
        SealsError: it is not the folder of a run.
        MissingExtra: matplotlib is not installed.
    """
    import matplotlib.image

    log = load_log(run)
    position = log.channel("position")
    figure = figure_class()(figsize=(8.0, 2.9), dpi=100, layout="constrained")
    scene, plot = figure.subplots(1, 2)
    with tempfile.TemporaryDirectory() as folder:
        view = [f"run={run}", f"out={folder}/frames", f"start={FRAME}", f"end={FRAME}"]
        seals(["render", *view, "width=640", "height=400", "film=false", "fov=0.32"])
        scene.imshow(matplotlib.image.imread(next(Path(folder, "frames").glob("*.png"))))
    scene.set_axis_off()
    scene.text(
        0.03, 0.06, "my_hexa, hovering", transform=scene.transAxes, color="white", fontsize=9
    )
    plot.plot(log.time, position[:, 2], color="#d55e00", label="height z")
    plot.plot(log.time, position[:, 0], color="#7f8c8d", label="forward x")
    low, high = plot.get_ylim()
    plot.axhspan(low, 0.0, color="#cfe4ef", lw=0)
    plot.set_ylim(low, high)
    plot.text(0.2, low / 2, "water", fontsize=8, va="center", color="#55606a")
    plot.set_xlabel("time [s]")
    plot.set_ylabel("position [m]")
    plot.legend(frameon=False, fontsize=8)
    figure.savefig(picture)


if __name__ == "__main__":
    _draw(Path(sys.argv[1]), Path(sys.argv[2]))
