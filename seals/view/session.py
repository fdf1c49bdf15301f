"""Session of a viewer: the displayed run, and new runs with changed parameters."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError, SealsError, refuse_unlisted
from seals.logs.table import read_parquet
from seals.rendering.scene import Poses
from seals.run.build import build_run
from seals.run.folder import write_config
from seals.run.pictures import FOLDER, INDEX
from seals.run.replay_config import recalled
from seals.view.forces import Forces
from seals.view.instants import ParticleSnapshots
from seals.view.live import Frame, Live
from seals.view.replay import Replay, open_replay
from seals.view.sliders import Slider
from seals.view.stage import Stage, build_stage
from seals.view.water import Water


class _Show(Protocol):
    """Interface of an interactive viewer plug-in."""

    def show(self, session: Session, *, host: str, port: int) -> None:
        """Show a session until it is interrupted.

        Args:
            session: what there is to see.
            host: address to listen on.
            port: to listen on, 0 for any that is free.

        Raises:
            MissingExtra: a package is missing.
            ConfigError: the address cannot be listened on.
        """


class Session:
    """Session of a viewer: one run, replayed or live.

    Args:
        config: composed configuration of the run; restarts change values in a copy of it.
        sliders: values that a person may change.
        folder: where the first run that the session starts is written; later ones beside it.

    Attributes:
        stage: of the run on show.
        replay: of the run on show once it has ended, or None.
        live: the run that goes on, or None.
        shown: counts the runs; it changes when another one is on show.
        made: folders that the session wrote, in order.
        note: what to say of the run.
    """

    stage: Stage
    water: Water
    forces: Forces
    shots: Shots
    drops: ParticleSnapshots

    def __init__(self, config: Any, sliders: Sequence[Slider], folder: Path) -> None:
        self.config, self.sliders, self._first = config, tuple(sliders), folder
        self.values = {s.key: s.value for s in sliders}
        self.replay: Replay | None = None
        self.live: Live | None = None
        self.shown, self.note, self.made = 0, "", list[Path]()
        self._frames: list[Frame] = []
        self._wet: list[tuple[float, NDArray[np.float32]]] = []

    def open(self, replay: Replay) -> None:
        """Display a finished run."""
        self.replay, self._frames = replay, []
        self.stage, folder = replay.stage, replay.folder
        self.water = Water(self.stage.settings, folder)
        self.forces, self.shots = Forces(self.stage, folder), Shots(folder)
        self.drops = ParticleSnapshots(folder)
        self.shown += 1

    def start(self) -> None:
        """Start a run with the slider values, ending the present one.

        Raises:
            SealsError: the configuration is refused.
        """
        number = len(self.made) + 1
        folder = self._first.with_name(f"{self._first.name}_{number}") if self.made else self._first
        write_config(folder, self._config())
        try:
            stage = build_stage(build_run(recalled(folder, key="view")))
        except SealsError:
            if self.made:
                shutil.rmtree(folder)
            raise
        self.close()
        self.made.append(folder)
        self.stage, self.replay, self._frames, self._wet = stage, None, [], []
        self.water = Water(stage.settings)
        self.forces, self.shots = Forces(stage, None), Shots(None)
        self.drops = ParticleSnapshots(None)
        self.live = Live(folder)
        self.shown += 1
        self.note = f"run {len(self.made)} is running"

    def _config(self) -> Any:
        """Return the configuration with the changed slider values."""
        from omegaconf import OmegaConf

        config = OmegaConf.create(OmegaConf.to_container(self.config, enum_to_str=True))
        for slider in self.sliders:
            value = self.values[slider.key]
            if value != slider.value:
                whole = isinstance(OmegaConf.select(config, slider.key), int)
                OmegaConf.update(config, slider.key, round(value) if whole else value)
        return config

    def turn(self, changes: Mapping[str, float]) -> None:
        """Set slider values and start a run with them.

        Raises:
            ConfigError: there is no such slider, or a value is outside its range.
            SealsError: the configuration is refused.
        """
        known = {s.key: s for s in self.sliders}
        for key, value in changes.items():
            refuse_unlisted(key, known, f"there is no slider '{key}'")
            low, high = known[key].low, known[key].high
            if not (math.isfinite(value) and low <= value <= high):
                raise ConfigError(f"{key}={value} is not allowed.\nAllowed: {low:g} to {high:g}")
        self.values.update(changes)
        self.start()

    def follow(self) -> bool:
        """Process messages of the live run; return whether there is new data."""
        if self.live is None:
            return False
        new = self.live.heard()
        self._frames += new
        self._wet += [(f.time, f.particles) for f in new if f.particles is not None]
        if not self.live.over:
            return bool(new)
        failure, self.live = self.live.failure, None
        said = ", ".join(f"{key} = {value:.4g}" for key, value in self.values.items())
        words = f"run {len(self.made)}: {said or 'done'}"
        self.note = f"{words}. {failure}" if failure else words
        try:
            self.open(open_replay(self.made[-1], key="view"))
        except SealsError as refusal:
            self.note = f"{self.note}. {refusal}"
        return True

    @property
    def end(self) -> float:
        """Time up to which data is available [s]."""
        if self.replay is not None:
            return self.replay.end
        return self._frames[-1].time if self._frames else 0.0

    @property
    def length(self) -> float:
        """Duration of the run, if known [s]."""
        if self.live is None:
            return self.end
        return max(self.end, float(self.stage.settings.time.duration))

    def poses(self, time: float) -> Poses | None:
        """Return the poses of all frames at a time [s]; None before the first data."""
        if self.replay is not None:
            return self.replay.poses([time])
        if not self._frames:
            return None
        times = [frame.time for frame in self._frames]
        return self._frames[min(int(np.searchsorted(times, time)), len(times) - 1)].poses

    def particles(self, time: float) -> Floats | None:
        """Return the particle positions last stored before a time [m], or None."""
        kept = self.drops.last(time)
        if kept is not None or not self._wet:
            return kept
        k = int(np.searchsorted([t for t, _ in self._wet], time + 1e-9, side="right")) - 1
        return np.asarray(self._wet[max(k, 0)][1], dtype=float)

    def close(self) -> None:
        """End the live run, if any."""
        if self.live is not None:
            self.live.stop()
            self.live = None


class Shots:
    """Colour images in a run folder.

    Args:
        folder: of the run; it may hold none.

    Attributes:
        cameras: names of the cameras that left colour pictures, sorted.
    """

    def __init__(self, folder: Path | None) -> None:
        self._taken: dict[str, list[tuple[float, Path]]] = {}
        root = None if folder is None else folder / FOLDER
        for index in sorted(root.glob(f"*/{INDEX}")) if root is not None else ():
            table = read_parquet(index)
            files = (index.parent / f"{int(n):06d}.png" for n in table["number"])
            taken = [(float(t), f) for t, f in zip(table["t"], files, strict=True) if f.is_file()]
            if taken:
                self._taken[index.parent.name] = taken
        self.cameras = tuple(self._taken)

    def last(self, camera: str, time: float) -> Path | None:
        """Return the last image of a camera up to a time [s]; None before the first.

        Raises:
            KeyError: there is no such camera.
        """
        taken = self._taken[camera]
        k = int(np.searchsorted([t for t, _ in taken], time + 1e-9, side="right")) - 1
        return taken[k][1] if k >= 0 else None
