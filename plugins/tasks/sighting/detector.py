"""Detectors of an animal in RGB-D pictures: a small convolutional network, and the drawn truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.learn.learner import need_torch
from seals.learn.metadata import CARD, read_metadata, refuse_other
from seals.learn.shipped import detector_folder
from seals.learn.task import Instant
from seals.learn.tensor_file import read_tensors, write_tensors
from seals.logs.atomic import atomic_folder, write_json
from seals.rendering.camera_view import CameraView, Shot
from seals.rendering.optics import to_bytes
from seals.schema import Within, read

FORM = "seals-detector"
WEIGHTS = "detector.safetensors"
PARTS = "parts"
"""Name of the detector that is told by the renderer where it drew the animal."""
LEAST = 12
"""Fewest pixels of an animal that count as seeing it."""
STRIDE = 4
"""Pixels along the edge of a cell of the network's map."""
MOST = 4.0
"""Depth beyond which all is as far [m]."""
RELIEF = (4, 20.0)
"""Half of the width of the mean that is taken off the depth [pixel], and the gain of what is left
[1/m]: an animal is some centimetres above the ground."""
ABOUT = 20
"""Half of the width of the window in which the ground is looked for [pixel]."""
LOW = 0.25
"""Share of its pixels that are taken to be ground or noise below it [1]."""
UNEVEN = 0.004
"""Standard deviation of the height of an animal above the ground that is found [m]."""
STEEP = 0.2
"""Least fall of a line of sight that tells a place on the ground [1]."""
ODD = 0.15
"""Largest distance between the network's depth and that on the ground [m]."""
WIDTHS = (16, 32, 48)
"""Channels of the network."""
_MOST_BYTES = 2**24


class Sighting(NamedTuple):
    """A place at which an animal is seen.

    Args:
        place: of its origin, world [m], shape (3,).
        noise: covariance [m^2], shape (3, 3).
    """

    place: Floats
    noise: Floats


class Detector(Protocol):
    """What finds an animal in the pictures of one instant."""

    def find(self, cameras: Sequence[CameraView], now: Instant) -> list[Sighting]:
        """Return where it is seen, at most once by each camera.

        Args:
            cameras: with a picture each.
            now: state of robot and target; only a control reads the target.
        """


class _DetectorParts:
    """Detector that receives the true position wherever enough pixels of the animal are drawn.

    It makes the labels of what is learned, and is the control that says what pictures cost.

    Args:
        name: of the animal among the objects.
        noise: standard deviation of a place across and along the view [m].
    """

    def __init__(self, name: str, noise: float = 1e-3) -> None:
        self.name, self.noise = name, noise

    def find(self, cameras: Sequence[CameraView], now: Instant) -> list[Sighting]:
        """Return the true place for each camera that sees the animal."""
        noise = self.noise**2 * np.eye(3)
        there = [camera for camera in cameras if pixels_of(self.name, camera) >= LEAST]
        return [Sighting(np.asarray(now.target[0]), noise) for _ in there]


class _Limits(NamedTuple):
    """Numbers of a detector's metadata."""

    pixel: Annotated[float, Within(1e-3, 100.0)]
    threshold: Annotated[float, Within(0.0, 1.0)]


class DetectorNetwork:
    """Detector that reads colour and depth, and nothing else.

    The peak of the first map says where, and how surely; the other maps add the place within the
    cell and what the animal's origin lies deeper than the mean depth in the cell. A hand above the
    animal hides how deep it is, but not the ground about it: the place is where the line of sight
    is as high above that as the animal stands. What the network puts far from there is not taken.

    Args:
        network: from pictures to maps, see `network_of`.
        metadata: what the folder says of it: ``pixel`` [pixel] is the standard
            deviation of its columns and rows, ``threshold`` the least probability of a peak.
        stance: height of the animal's origin above the ground on which it stands [m].
    """

    def __init__(self, network: Any, metadata: Mapping[str, Any], stance: float) -> None:
        self.network, self.metadata, self.stance = network.eval(), metadata, stance
        self.pixel, self.threshold = read(_Limits, metadata, where="detector:", extra=True)

    def find(self, cameras: Sequence[CameraView], now: Instant) -> list[Sighting]:
        """Return the places of the surest peaks."""
        import torch

        shots = [shot_of(camera) for camera in cameras]
        colour = np.stack([to_bytes(np.asarray(shot.picture.colour)) for shot in shots])
        depth = np.stack([np.asarray(shot.picture.depth) for shot in shots])
        with torch.no_grad():
            seen = inputs_of(torch.as_tensor(colour), torch.as_tensor(depth))
            peaks = peaks_of(self.network(seen), seen).numpy()
        sure = [(s, p) for s, p in zip(shots, peaks, strict=True) if p[0] > self.threshold]
        found = [self._sighting(shot, peak) for shot, peak in sure]
        return [each for each in found if each is not None]

    def _sighting(self, shot: Shot, peak: Floats) -> Sighting | None:
        lens, axes = shot.lens, shot.axes
        _, column, row, guess = (float(x) for x in peak)
        ray = axes @ [(column - lens.cx) / lens.fx, (row - lens.cy) / lens.fy, 1.0]
        if ray[2] > -STEEP:
            return None
        ground = _ground_height(shot, column, row)
        depth = (ground + self.stance - float(shot.position[2])) / ray[2]
        if not abs(depth - guess) < ODD:
            return None
        across = axes @ np.diag([self.pixel * depth / lens.fx, self.pixel * depth / lens.fy, 0.0])
        along = UNEVEN / ray[2] * ray
        return Sighting(shot.position + depth * ray, across @ across.T + np.outer(along, along))


def _ground_height(shot: Shot, column: float, row: float) -> float:
    """Return the height of the ground about a pixel, world [m]: infinite where nothing is met.

    Args:
        shot: with depths.
        column: of the pixel.
        row: of the pixel.
    """
    depth, lens = np.asarray(shot.picture.depth), shot.lens
    rows, columns = (
        np.arange(max(0, int(at) - ABOUT), min(size, int(at) + ABOUT + 1))
        for at, size in zip((row, column), depth.shape, strict=True)
    )
    near = depth[np.ix_(rows, columns)]
    x, y = (columns + 0.5 - lens.cx) / lens.fx, (rows[:, None] + 0.5 - lens.cy) / lens.fy
    down = shot.axes[2, 0] * x + shot.axes[2, 1] * y + shot.axes[2, 2]
    met = np.isfinite(near) & (near > lens.near)
    if not met.any():
        return np.inf
    return float(shot.position[2] + np.quantile((near * down)[met], LOW))


def pixels_of(name: str, camera: CameraView) -> int:
    """Return how many pixels of a camera's picture show an object."""
    assert camera.view is not None
    names = camera.view.scene.names
    numbers = [k for k, part in enumerate(names) if part.startswith(f"{name}/")]
    return int(np.isin(shot_of(camera).picture.parts, numbers).sum())


def shot_of(camera: CameraView) -> Shot:
    """Return the last picture of a camera that has one."""
    assert isinstance(camera.shot, Shot)
    return camera.shot


def network_of(widths: Sequence[int] = WIDTHS) -> Any:
    """Return a fresh network from pictures (N, 5, H, W) to maps (N, 4, H / 4, W / 4).

    The maps are the log odds of the animal's origin, its column and row in the cell [cell], and its
    depth below the mean of the cell [m].
    """
    need_torch()
    from torch import nn

    first, second, last = widths

    def layer(before: int, after: int, *, stride: int = 1, apart: int = 1) -> list[Any]:
        convolution = nn.Conv2d(before, after, 3, stride, apart, dilation=apart, bias=False)
        return [convolution, nn.BatchNorm2d(after), nn.ReLU(inplace=True)]

    return nn.Sequential(
        *layer(5, first, stride=2),
        *layer(first, second, stride=2),
        *layer(second, last),
        *layer(last, last, apart=2),
        *layer(last, last, apart=4),
        *layer(last, last),
        nn.Conv2d(last, 4, 1),
    )


def inputs_of(colour: Any, depth: Any) -> Any:
    """Return what the network reads: displayed colours, depth and its relief, shape (N, 5, H, W).

    Args:
        colour: sRGB, tensor of uint8, shape (N, H, W, 3).
        depth: along the optical axis [m], infinite where nothing is met, shape (N, H, W).
    """
    import torch
    from torch.nn.functional import avg_pool2d, pad

    shown = colour.permute(0, 3, 1, 2).float() / 255.0 - 0.5
    near = depth.float().clamp(0.0, MOST)[:, None]
    half, gain = RELIEF
    around = avg_pool2d(pad(near, (half,) * 4, mode="replicate"), 2 * half + 1, 1)
    relief = (gain * (near - around)).clamp(-1.0, 1.0)
    return torch.cat((shown, near / MOST, relief), dim=1)


def cell_depths(seen: Any) -> Any:
    """Return the mean depth in each cell [m], shape (N, H / 4, W / 4)."""
    from torch.nn.functional import avg_pool2d

    return MOST * avg_pool2d(seen[:, 3:4], STRIDE)[:, 0]


def peaks_of(maps: Any, seen: Any) -> Any:
    """Return probability, column, row [pixel] and depth [m] of the surest cells, shape (N, 4).

    Args:
        maps: of the network.
        seen: what it read.
    """
    import torch

    width = maps.shape[3]
    best = maps[:, 0].flatten(1).argmax(1, keepdim=True)
    value = maps.flatten(2).gather(2, best[:, None].expand(-1, 4, -1))[..., 0]
    depth = cell_depths(seen).flatten(1).gather(1, best)[:, 0] + value[:, 3]
    column = STRIDE * ((best[:, 0] % width) + 0.5 + value[:, 1])
    row = STRIDE * ((best[:, 0] // width) + 0.5 + value[:, 2])
    return torch.stack((value[:, 0].sigmoid(), column, row, depth), dim=1)


def save_detector(folder: Path, network: Any, metadata: Mapping[str, Any]) -> Path:
    """Write a detector as a folder of metadata and weights, atomically.

    Args:
        folder: to be made; an empty one, or that of a detector, is replaced.
        network: of `network_of`.
        metadata: see `DetectorNetwork`, and who made it of what.

    Raises:
        ConfigError: something else is there.
    """
    refuse_other(folder, form=FORM, key="task.detector")
    whole = {k: v.detach().cpu().contiguous().clone() for k, v in network.state_dict().items()}
    with atomic_folder(folder, replace=True) as beside:
        write_tensors(beside / WEIGHTS, whole, framework="torch")
        write_json(beside / CARD, {"format": FORM, "version": 1, **metadata})
    return folder


def load_detector(name: str, *, animal: str, stance: float) -> Detector:
    """Return a detector: from its folder, ``ROBOT/NAME`` of one that is shipped, or ``parts``.

    Args:
        name: of the detector.
        animal: name of the animal among the objects.
        stance: height of its origin above the ground on which it stands [m].

    Raises:
        ConfigError: there is none, or its weights are not those of such a network.
    """
    if name == PARTS:
        return _DetectorParts(animal)
    folder = detector_folder(name, besides=(PARTS,))
    metadata = read_metadata(folder, form=FORM, key="task.detector")
    network = network_of()
    tensors = read_tensors(folder / WEIGHTS, most=_MOST_BYTES, framework="torch")
    if not all(bool(x.isfinite().all()) for x in tensors.values()):
        raise ConfigError(
            f"task.detector={name}: weights are not finite.\n"
            "Use the folder as written by the training."
        )
    try:
        network.load_state_dict(tensors)
    except RuntimeError as cause:
        words = " ".join(str(cause).split())
        raise ConfigError(
            f"task.detector={name}: weights of another network: {words[:300]}\n"
            "Use the folder as written by the training."
        ) from cause
    return DetectorNetwork(network, metadata, stance)
