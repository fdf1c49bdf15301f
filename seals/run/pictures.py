"""Recorder of the camera images of a run: one file per image, and an index."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.logs.atomic import write_bytes, write_json, write_table
from seals.rendering.camera_view import CameraView
from seals.run.particle_snapshots import copy_own
from seals.run.recorder import Moment, Recorder, refill
from seals.world import Actor, World

FOLDER = "pictures"
"""Folder of a run that holds a folder for each camera."""
INDEX, SCENE = "index.parquet", "camera.json"
COLUMNS = (
    *("number", "t"),
    *(f"position_{axis}" for axis in "xyz"),
    *(f"axes_{i}{j}" for i in range(3) for j in range(3)),
)
"""Columns of the index: picture, time [s], place [m] and optical axes of the camera."""


class Pictures(Recorder):
    """Writer of camera images: ``pictures/NAME/000123.png`` and the depth and part files.

    Args:
        actor: that carries the cameras.

    Attributes:
        folder: of the run; None while nothing is written.
        rows: of the index, by camera: number, time and pose of every picture.
    """

    def __init__(self, actor: Actor) -> None:
        self.actor = actor
        self.folder: Path | None = None
        self.rows: dict[str, list[dict[str, float]]] = {name: [] for name in self._cameras()}

    def _cameras(self) -> dict[str, CameraView]:
        return dict(self.actor.sensor_suite.cameras)

    def record(self, moment: Moment) -> None:
        """Write all new images."""
        if self.folder is None or not self.rows:
            return
        for name, view in self._cameras().items():
            shot = view.shot
            if shot is not None and shot.number >= len(self.rows[name]):
                for ending, content in shot.files().items():
                    place = self.folder / FOLDER / name / f"{shot.number:06d}{ending}"
                    write_bytes(place, content)
                row = {"number": float(shot.number), "t": shot.time}
                row |= {
                    f"position_{a}": float(v) for a, v in zip("xyz", shot.position, strict=True)
                }
                flat = shot.axes.ravel().tolist()
                self.rows[name].append(
                    row | {f"axes_{i}{j}": flat[3 * i + j] for i in range(3) for j in range(3)}
                )

    def snapshot(self) -> dict[str, dict[str, Floats]]:
        """Return the index of every camera, column by column."""
        return {
            name: {key: np.array([row[key] for row in rows]) for key in rows[0]} if rows else {}
            for name, rows in self.rows.items()
        }

    def restore(self, kept: Mapping[str, Any], rows: int, folder: Path) -> None:
        """Continue after the images of a snapshot."""
        self.folder = folder
        for name in self.rows:
            columns = kept[name]
            if columns and set(columns) != set(COLUMNS):
                raise ValueError(f"the index of camera '{name}' has different columns")
            count = len(columns["number"]) if columns else 0
            table = np.zeros((len(columns), count))
            for row, column in zip(table, columns.values(), strict=True):
                refill(row, column, count)
            if columns and (columns["number"] != np.arange(count)).any():
                raise ValueError(f"the pictures of camera '{name}' are not numbered consecutively")
            self.rows[name] = [dict(zip(columns, row, strict=True)) for row in table.T.tolist()]

    def close(self) -> None:
        """Write the index and the description of every camera."""
        for name, rows in self.rows.items():
            if self.folder is None or not rows:
                continue
            where = self.folder / FOLDER / name
            write_table(where / INDEX, {key: [row[key] for row in rows] for key in rows[0]})
            write_json(where / SCENE, self._described(name))

    def _described(self, name: str) -> dict[str, Any]:
        """Metadata of a camera for readers of its images."""
        sensor: Any = self.actor.sensor_suite.sensors[name]
        scene = self._cameras()[name].view
        about = {
            "link": sensor.link,
            "position": list(sensor.position),
            "rpy": list(sensor.rpy),
            **sensor.described(),
        }
        return about if scene is None else {**about, "parts": list(scene.scene.names)}

    def start(self, world: World, folder: Path | None) -> None:
        """Write to a folder from now on, with the images taken so far.

        Raises:
            ConfigError: a picture that the index knows is missing.
        """
        before, self.folder = self.folder, folder
        if before is None or folder is None or before == folder:
            return
        for name, rows in self.rows.items():
            for row in rows:
                stem = f"{int(row['number']):06d}"
                found = sorted((before / FOLDER / name).glob(f"{stem}*.png"))
                if not found:
                    raise ConfigError(
                        f"picture {stem} of camera '{name}' is missing in {before / FOLDER}.\n"
                        "Run it again: repeat=FOLDER"
                    )
                (folder / FOLDER / name).mkdir(parents=True, exist_ok=True)
                for file in found:
                    copy_own(file, folder / FOLDER / name / file.name)
