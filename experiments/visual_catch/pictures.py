"""Labelled pictures of both cameras, taken along flights of the scripted diver in full worlds."""

from __future__ import annotations

import time
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError, SealsError
from seals.learn.starts import TRAINING_END, held_out_seeds
from seals.learn.task import Instant
from seals.logs.atomic import atomic_path
from seals.plugins.tasks.sighting.detector import LEAST, STRIDE, pixels_of, shot_of
from seals.rendering.camera_view import CameraView
from seals.rendering.optics import to_bytes
from seals.rendering.optics.waters import WATERS
from seals.sysid.parallel import spread
from seals.untrusted_io import regular_file

EVERY = 3
"""Control steps from one pair of pictures to the next."""
UNSURE, ABSENT, PRESENT = -1, 0, 1
"""Labels: some pixels, none, enough of them with the origin within the picture."""
SWAY = 0.12
"""Standard deviation of what is added to the actions of every other flight [1]: the detector is
to know the states, too, into which its own errors lead."""
HELD = 0.9
"""Share of it that stays from step to step [1]."""
ARMS = (("task.arm=[0,0,0]",), ("task.arm=[-0.35,0,0.25]", "task.squeeze=0.26"))
"""Postures that the environments have: straight down, and ahead."""

_MOST_BYTES = 2**28
"""Of the pictures of one flight; those of 30 s are 17 MB."""
_DAMAGED = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError)
_KINDS = {
    "colour": "uint8",
    "depth": "uint16",
    "label": "int8",
    "place": "float64",
    "water": "int8",
    "focus": "float64",
}


class Pictures(NamedTuple):
    """Pictures of N cameras with labels.

    Args:
        colour: sRGB, uint8, shape (N, H, W, 3).
        depth: along the optical axis [mm], 0 for nothing met, uint16, shape (N, H, W).
        label: `UNSURE`, `ABSENT` or `PRESENT`, shape (N,).
        place: column and row [pixel] and depth [m] of the animal's origin, shape (N, 3).
        water: index of the water type in `WATERS`, shape (N,).
        focus: focal length [pixel], shape (N,).
    """

    colour: NDArray[np.uint8]
    depth: NDArray[np.uint16]
    label: NDArray[np.int8]
    place: Floats
    water: NDArray[np.int8]
    focus: Floats

    def check(self) -> None:
        """Refuse arrays whose kinds, shapes or values are not those of pictures.

        Raises:
            ValueError: one of them is not.
        """
        count, *size = self.depth.shape
        shapes = {"colour": (count, *size, 3), "depth": (count, *size), "place": (count, 3)}
        for name, values in self._asdict().items():
            kind = np.dtype(_KINDS[name])
            if values.dtype.kind != kind.kind or values.dtype.itemsize > kind.itemsize:
                raise ValueError(f"{name} is of type {values.dtype}, not {kind}")
            if values.shape != shapes.get(name, (count,)):
                raise ValueError(f"{name} is of shape {values.shape}")
            if not np.isfinite(values).all():
                raise ValueError(f"{name} is not finite")
        if len(size) != 2 or min(size) < STRIDE or size[0] % STRIDE or size[1] % STRIDE:
            raise ValueError(
                f"pictures of {size} pixels; width and height must be multiples of {STRIDE}"
            )
        bounds = {"label": (UNSURE, PRESENT), "water": (0, len(WATERS) - 1)}
        for name, (low, high) in bounds.items():
            values = getattr(self, name)
            if len(values) and not low <= values.min() <= values.max() <= high:
                raise ValueError(f"{name} is not from {low} to {high}")
        if not (self.focus > 0.0).all():
            raise ValueError("focus is not above 0")


def record(folder: Path, *, flights: int, processes: int, held_out: bool, limit: float) -> int:
    """Fly, and write one file a flight; return the number of pictures.

    Flights that the folder holds are not flown again.

    Args:
        folder: to be written.
        flights: how many.
        processes: that share them.
        held_out: whether the starts are those that judge.
        limit: after which no flight begins [s].

    Raises:
        ConfigError: the folder holds flights of the other kind, or a damaged one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    strange = [p for p in _paths(folder) if (int(p.stem) >= TRAINING_END) is not held_out]
    if strange:
        what, flag = ("to learn from", "without") if held_out else ("that judge", "with")
        raise ConfigError(
            f"--out {folder} holds flights {what}: {strange[0].name}\n"
            f"Give another folder, or go on with it {flag} --held-out."
        )
    seeds = held_out_seeds(flights) if held_out else list(range(flights))
    until = time.time() + limit
    return sum(spread(_flown, [(folder, seed, until) for seed in seeds], processes))


def _flown(job: tuple[Path, int, float]) -> int:
    """Record one flight unless time is over."""
    import torch

    folder, seed, until = job
    path = folder / f"{seed}.npz"
    if path.exists():
        return len(_read(path).label)
    if time.time() > until:
        return 0
    torch.set_num_threads(1)
    rng = np.random.default_rng((seed, 28))
    # the words of a random world: prey, posture, water, sun, ripples, floor
    env = ("catch_seen", "catch_seen_fleeing")[int(rng.integers(2))]
    found = _flight(
        seed,
        [
            f"env={env}",
            "backend=mujoco",
            "task.duration=30",
            "task.detector=parts",
            *ARMS[int(rng.integers(2))],
            f"water_type={list(WATERS)[int(rng.integers(len(WATERS)))]}",
            f"optics.sun_zenith={rng.uniform(0.0, 1.2):.3f}",
            f"optics.sun_azimuth={rng.uniform(-3.0, 3.0):.3f}",
            f"sight.ripples={rng.choice([0.0, 1.0, 2.0, 3.0])}",
            f"sight.tile={rng.uniform(0.08, 0.5):.3f}",
        ],
        sway=SWAY * (seed % 2),
        rng=rng,
    )
    with atomic_path(path) as beside:
        np.savez(beside, **found._asdict())
    return len(found.label)


def _flight(seed: int, words: Sequence[str], *, sway: float, rng: np.random.Generator) -> Pictures:
    """Return the pictures of one flight.

    Args:
        seed: of the start.
        words: of the world.
        sway: standard deviation of what is added to the actions [1].
        rng: of what is added.
    """
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of

    config = compose([*words, "task.ends=true"], root="evaluate")
    environment: Any = batched_of(config, count=1)
    water = list(WATERS).index(str(config.water_type))
    world, rows = environment.simulator.worlds[0], []
    try:
        environment.reset([seed])
        pushed, over, count = np.zeros(environment.action_size), False, 0
        while not over:
            pushed = HELD * pushed + np.sqrt(1.0 - HELD**2) * sway * rng.standard_normal(4)
            told = environment.scripted_policy().numpy()[0]
            turn = environment.step(torch.as_tensor(told + np.append(pushed[:3], 0.0))[None])
            over = bool(turn.terminated[0] | turn.truncated[0])
            count += 1
            if (count + seed) % EVERY == 0 and not over:
                cameras = world.actor.sensor_suite.cameras.values()
                rows += [
                    _row(camera, environment.now, environment.task.object) for camera in cameras
                ]
    finally:
        environment.close()
    columns = [np.stack(column) for column in zip(*rows, strict=True)]
    colour, depth, label, place, focus = columns
    return Pictures(colour, depth, label, place, np.full(len(label), water, np.int8), focus)


def _row(camera: CameraView, now: Instant, animal: str) -> tuple[Any, ...]:
    """Return picture, label, place and focal length of one camera."""
    shot = shot_of(camera)
    depth = np.asarray(shot.picture.depth)
    near = np.where(np.isfinite(depth), np.clip(1e3 * depth, 0.0, 65535.0), 0.0)
    origin = shot.axes.T @ (np.asarray(now.target[0]) - shot.position)
    pixels, label = pixels_of(animal, camera), UNSURE
    spot = np.zeros(2)
    if origin[2] > shot.lens.near:
        spot = np.asarray(shot.lens.project(origin))
    inside = origin[2] > shot.lens.near and np.all((spot >= 0.0) & (spot < depth.shape[::-1]))
    if pixels >= LEAST and inside:
        label = PRESENT
    elif pixels == 0:
        label = ABSENT
    colour = to_bytes(np.asarray(shot.picture.colour))
    place = np.array([*spot, origin[2]], dtype=np.float32)
    return colour, np.rint(near).astype(np.uint16), np.int8(label), place, np.float32(shot.lens.fx)


def load_pictures(folder: Path) -> Pictures:
    """Return the pictures of all flights of a folder.

    Raises:
        ConfigError: there are none, or a file is not one that `record` wrote.
    """
    rows = [_read(path) for path in _paths(folder)]
    if not rows:
        raise ConfigError(f"{folder} holds no pictures.\nMake them: visual_catch record --out ...")
    sizes = {row.depth.shape[1:] for row in rows}
    if len(sizes) > 1:
        raise ConfigError(
            f"{folder} holds pictures of several sizes: {', '.join(map(str, sorted(sizes)))}\n"
            "Record them anew, all with the same cameras."
        )
    return Pictures(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _paths(folder: Path) -> list[Path]:
    """Files of flights, named by the seeds of their starts."""
    return sorted(path for path in folder.glob("*.npz") if path.stem.isdecimal())


def _read(path: Path) -> Pictures:
    """Return the pictures of one flight; nothing in the file is executed.

    Raises:
        ConfigError: it is not one that `record` wrote.
    """
    try:
        with zipfile.ZipFile(regular_file(path, most=_MOST_BYTES)) as packed:
            unpacked = sum(part.file_size for part in packed.infolist())
        if unpacked > _MOST_BYTES:
            raise ValueError(f"{unpacked} bytes are unpacked; the limit is {_MOST_BYTES}")
        with np.load(path, allow_pickle=False) as kept:
            found = Pictures(*(kept[name] for name in Pictures._fields))
        found.check()
    except (OSError, ValueError, KeyError, EOFError, MemoryError, SealsError, *_DAMAGED) as error:
        words = str(error).partition("\n")[0].rstrip(".")
        raise ConfigError(
            f"{path} holds no pictures of a flight: {words}.\n"
            "Remove it, or record its folder again."
        ) from None
    return found


def metres(depth: Any) -> Any:
    """Return depths of files as a tensor in metres, infinite where nothing was met.

    Args:
        depth: tensor [mm], 0 for nothing met.
    """
    import torch

    far = depth.float() / 1e3
    return torch.where(depth == 0, torch.inf, far)
