"""Echoes of a sonar by PyTorch, one ping at a time: all rays against all solids at once.

It runs on a processor or a CUDA card.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, optional_import
from seals.sensors.casting import Hits
from seals.sensors.echoes import scattered
from seals.sensors.rays import Shape, entered, half_sizes, nearest_face, outward

KINDS = ("plane", "box", "cylinder", "capsule", "sphere", "mesh")


class Scene(NamedTuple):
    """Solids sorted by kind.

    Args:
        table: position, axes row by row, half sizes (radius, radius, half length of round ones),
            kind; shape (k, 16).
        counts: how many there are of each of the `KINDS`.
        corners: of the triangles of each mesh [m], shape (f, 3, 3).
        order: number of each row's shape as given.
    """

    table: Floats
    counts: tuple[int, ...]
    corners: tuple[Floats, ...]
    order: list[int]


def scene_of(shapes: Sequence[Shape]) -> Scene:
    """Return solids in the world as a scene."""
    order = sorted(range(len(shapes)), key=lambda k: KINDS.index(shapes[k].kind))
    rows = np.zeros((len(shapes), 16))
    for row, k in zip(rows, order, strict=True):
        shape = shapes[k]
        row[:3], row[3:12] = shape.position, shape.turn.ravel()
        row[12:15], row[15] = half_sizes(shape), KINDS.index(shape.kind)
    kinds = [shape.kind for shape in shapes]
    return Scene(
        rows,
        tuple(kinds.count(kind) for kind in KINDS),
        tuple(shapes[k].corners for k in order if shapes[k].kind == "mesh"),
        order,
    )


def tensor_cast(
    table: Any,
    counts: Sequence[int],
    corners: Sequence[Any],
    origin: Any,
    directions: Any,
    *,
    farthest: float,
) -> tuple[Any, Any, Any]:
    """Return the first hit of every ray, as `seals.sensors.casting.cast` does, as tensors.

    Args:
        table: of a `Scene`, as a tensor.
        counts: of the scene.
        corners: of the scene, as tensors.
        origin: of all rays [m], tensor of shape (3,).
        directions: unit vectors, tensor of shape (n, 3).
        farthest: length of the rays [m].

    Returns:
        distance [m], infinite for a miss, (n,); normal, world axes, any for a miss, (n, 3); row of
        the scene's table that was hit, any for a miss, (n,).
    """
    import torch

    place, turn, half = table[:, :3], table[:, 3:12].reshape(-1, 3, 3), table[:, 12:15]
    start = torch.einsum("ki,kij->kj", origin - place, turn)
    ways = directions[None] @ turn
    found, row = [], 0
    for kind, count in zip(KINDS[:-1], counts, strict=False):
        if count:
            rows = slice(row, row + count)
            found.append(entered(kind, start[rows], ways[rows], half[rows]))
        row += count
    sides = {}
    for k, faces in enumerate(corners, start=row):
        distance, sides[k] = nearest_face(faces, start[k], ways[k])
        found.append(distance[None])
    distances = torch.cat(found)
    way, first = torch.where(distances <= farthest, distances, math.inf).min(dim=0)
    points = origin + torch.where(torch.isfinite(way), way, 0.0)[:, None] * directions
    own = torch.einsum("ni,nij->nj", points - place[first], turn[first])
    normal, met = torch.zeros_like(own), table[first, 15]
    for k, (kind, count) in enumerate(zip(KINDS[:-1], counts, strict=False)):
        if count:
            normal = torch.where((met == k)[:, None], outward(kind, half[first], own), normal)
    for k, side in sides.items():
        normal = torch.where((first == k)[:, None], side, normal)
    return way, torch.einsum("nij,nj->ni", turn[first], normal), first


_FAR = Shape("sphere", (1.0,), np.full(3, 1e6), np.eye(3), np.zeros((0, 3, 3)))
"""Solid in place of none: no ray reaches it."""


class PingLayout(NamedTuple):
    """Numbers of a sonar that no ping changes.

    Args:
        rays: unit vectors in sensor axes, row by row, shape (rows * columns, 3).
        across: their derivatives with respect to elevation, shape (rows * columns, 3).
        weight: solid angle by the patterns of transmitter and receiver [sr], shape (rows *
            columns,).
        beams: pattern of each beam over the columns [1], shape (beams, columns).
        bins: of range.
        nearest: range where the first begins [m].
        size: of a bin [m].
        pulse: length of the pulse in range [m].
        step: height of a ray's cell [rad].
        reach: length of the rays [m].
    """

    rays: Floats
    across: Floats
    weight: Floats
    beams: Any
    bins: int
    nearest: float
    size: float
    pulse: float
    step: float
    reach: float


class TensorEchoes:
    """Sonar whose rays, patterns and bins stay on a device.

    Args:
        layout: of the sonar.
        device: ``cpu`` or ``cuda``.

    Raises:
        ConfigError: torch finds no such device.
        MissingExtra: torch is not installed.
    """

    def __init__(self, layout: PingLayout, device: str) -> None:
        with optional_import(f"sonar.device={device} needs torch", "Write device=numpy"):
            import torch
        if device == "cuda" and not torch.cuda.is_available():
            raise ConfigError(
                "sonar.device=cuda: torch finds no CUDA device on this machine.\nWrite device=numpy"
            )
        self.layout, self.device = layout, device
        there = (layout.rays, layout.across, layout.weight, np.ascontiguousarray(layout.beams))
        self._rays, self._across, self._weight, self._beams = (
            torch.from_numpy(x).to(self.device) for x in there
        )
        columns = layout.beams.shape[1]
        column = torch.arange(len(layout.rays), device=self.device) % columns
        self._rows = (column * (layout.bins + 1)).repeat(2)
        self._edges = torch.arange(layout.bins + 1, device=self.device, dtype=torch.float64)
        self._down = torch.tensor([[0.0, 0.0, -1.0]], dtype=torch.float64, device=self.device)
        self._random = torch.Generator(device=self.device)
        self._key: Any = None
        self._scene: Scene | None = None
        self._corners: list[Any] = []
        self._graph: Any = None
        self._input: Any = None
        self._output: Any = None

    def intensities(
        self,
        shapes: Sequence[Shape],
        strengths: Floats,
        pose: tuple[Floats, Floats],
        *,
        surface: float,
        loss: float,
    ) -> Any:
        """Return mean intensities over that of the source at 1 m, tensor (beams, bins).

        On a CUDA card the kernels are recorded at the first ping in a scene and replayed while its
        shapes are of the same kinds: the next ping overwrites the tensor.

        Args:
            shapes: in the world.
            strengths: of the shapes, then of the water surface [1].
            pose: position [m] and axes of the sensor as columns, world axes.
            surface: height of the level surface [m]; minus infinity for none.
            loss: absorption [dB/m].
        """
        import torch

        if not shapes:
            shapes, strengths = [_FAR], np.append(0.0, strengths)
        scene = scene_of(shapes)
        sorted_strengths = strengths[[*scene.order, len(shapes)]]
        numbers: list[Any] = [*pose, surface, loss, sorted_strengths, scene.table]
        packed = torch.from_numpy(np.concatenate([np.ravel(x) for x in numbers]))
        key = (scene.counts, tuple(id(x) for x in scene.corners))
        if key != self._key:
            self._key, self._scene, self._graph = key, scene, None
            self._corners = [torch.from_numpy(x.copy()).to(self.device) for x in scene.corners]
        if self.device == "cpu":
            return self._computed(packed, scene.counts)
        if self._graph is None:
            self._record(packed.to(self.device), scene.counts)
        else:
            self._input.copy_(packed)
        self._graph.replay()
        return self._output

    def _record(self, packed: Any, counts: tuple[int, ...]) -> None:
        """Record the kernels of a ping after a first run, which sets the libraries up."""
        import torch

        cuda: Any = torch.cuda
        self._input, beside = packed, cuda.Stream()
        beside.wait_stream(cuda.current_stream())
        with cuda.stream(beside):
            self._computed(packed, counts)
        cuda.current_stream().wait_stream(beside)
        self._graph = cuda.CUDAGraph()
        with cuda.graph(self._graph):
            self._output = self._computed(packed, counts)

    def _computed(self, packed: Any, counts: tuple[int, ...]) -> Any:
        """Intensities of one ping from its numbers in one tensor."""
        import torch

        many = sum(counts)
        origin, axes = packed[:3], packed[3:12].reshape(3, 3)
        surface, loss, strength = packed[12], packed[13], packed[14 : 15 + many]
        ways, across = self._rays @ axes.T, self._across @ axes.T
        table = packed[15 + many :].reshape(many, -1)
        way, normal, met = tensor_cast(
            table, counts, self._corners, origin, ways, farthest=self.layout.reach
        )
        rising = ways[:, 2] > 0.0
        crossing = (surface - origin[2]) / torch.where(rising, ways[:, 2], 1.0)
        out = rising & (crossing >= 0.0) & (crossing < way) & (crossing <= self.layout.reach)
        way, met = torch.where(out, crossing, way), torch.where(out, many, met)
        normal = torch.where(out[:, None], self._down, normal)
        found = scattered(
            Hits(way, normal, met), ways, across, strength[met], loss=loss, step=self.layout.step
        )
        way = torch.where(torch.isfinite(way), way, 1.0)
        return self._over_range(way, found.extent, self._weight * found.power)

    def _over_range(self, way: Any, extent: Any, power: Any) -> Any:
        """Intensities of the beams over range; see `seals.sensors.echoes.Echoes.over_range`."""
        import torch

        made = self.layout
        width = extent + made.pulse
        low = (way - 0.5 * width - made.nearest) / made.size
        slope = power * made.pulse / width
        edges = torch.cat([low, low + width / made.size]).clamp(0.0, float(made.bins))
        slope = torch.cat([slope, -slope])
        place = edges.ceil().long() + self._rows
        sums = torch.zeros(
            (2, self._beams.shape[1] * (made.bins + 1)), dtype=torch.float64, device=self.device
        )
        sums.index_add_(1, place, torch.stack([slope, slope * edges]))
        rise, less = sums.reshape(2, -1, made.bins + 1).cumsum(dim=2)
        columns = (rise * self._edges - less).diff(dim=1).clamp(min=0.0)
        return self._beams @ columns.float()

    def levels(self, intensities: Any, *, source: float, noise: float, seed: int | None) -> Floats:
        """Return levels [dB re 1 uPa], shape (beams, bins).

        Args:
            intensities: from `intensities`.
            source: intensity of the source at 1 m [1].
            noise: intensity of the noise [1].
            seed: of speckle; None without.
        """
        mean = intensities * source + noise
        if seed is not None:
            self._random.manual_seed(seed)
            mean = mean * mean.new_empty(mean.shape).exponential_(generator=self._random)
        levels: Floats = (10.0 * mean.clamp(min=1e-3).log10()).cpu().numpy().astype(np.float64)
        return levels
