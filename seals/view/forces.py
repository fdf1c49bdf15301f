"""Forces of every effect over time, from the ledger of a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.logs.run_folder import log_folder
from seals.logs.table import read_parquet
from seals.rendering.scene import Poses
from seals.run.fleet import fleet_of
from seals.view.stage import Stage

LEDGER = "ledger.parquet"
COMPONENTS = ("force_x", "force_y", "force_z")


class Arrows(NamedTuple):
    """Forces of one effect at one time.

    Args:
        origins: of the links they act on, world [m], shape (n, 3).
        vectors: world axes [N], shape (n, 3).
    """

    origins: Floats
    vectors: Floats


class Forces:
    """Forces of a run by effect.

    Args:
        stage: of the run.
        folder: of the run; without a ledger there are no forces.

    Attributes:
        effects: that push anything, in the order of the ledger.
        usual: the largest force on one link exceeds it in a tenth of the time only [N], so that
            no impact sets it.
    """

    def __init__(self, stage: Stage, folder: Path | None) -> None:
        self._time: Floats = np.zeros(0)
        self._table: dict[str, dict[int, Floats]] = {}
        logs = (
            {} if folder is None else {n: log_folder(folder, n) for n in fleet_of(stage.settings)}
        )
        for robot, place in logs.items():
            path = place / LEDGER
            columns = read_parquet(path) if path.is_file() else {"t": self._time}
            self._time = columns.pop("t")
            for name, values in columns.items():
                self._sort(stage, robot, name, values)
        self.effects = tuple(self._table)
        sizes = [np.linalg.norm(f, axis=1) for by in self._table.values() for f in by.values()]
        self.usual = float(np.quantile(np.max(sizes, axis=0), 0.9)) if sizes else 0.0

    def _sort(self, stage: Stage, robot: str, name: str, values: Floats) -> None:
        """Store a column ``[object/]effect.link.component`` of a robot's ledger in the table."""
        actor, _, rest = name.rpartition("/")
        effect, _, rest = rest.partition(".")
        link, _, component = rest.rpartition(".")
        if component not in COMPONENTS:
            return
        by_frame = self._table.setdefault(effect, {})
        frame = stage.frame(actor or robot, link)
        force = by_frame.setdefault(frame, np.zeros((len(values), 3)))
        force[:, COMPONENTS.index(component)] = np.nan_to_num(values)

    def at(self, time: float, poses: Poses) -> dict[str, Arrows]:
        """Return the forces of the step in progress at a time, by effect.

        Args:
            time: [s].
            poses: of the links at that time, one environment.
        """
        if not len(self._time):
            return {}
        row = int(np.searchsorted(self._time, time + 1e-9, side="right")) - 1
        row = min(max(row, 0), len(self._time) - 1)
        places, turns = np.asarray(poses.position[0]), np.asarray(poses.rotation[0])
        found = {}
        for effect, by_frame in self._table.items():
            frames = list(by_frame)
            pushes = np.array([by_frame[f][row] for f in frames])
            vectors = np.einsum("fij,fj->fi", turns[frames], pushes)
            found[effect] = Arrows(places[frames], vectors)
        return found
