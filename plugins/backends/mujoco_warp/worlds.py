"""Many worlds of the same robots on one device: the engine's step, and SEALS's laws in it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.batch.loads import BatchLoads
from seals.environment.ground import ground_height
from seals.environment.settings import EnvironmentSettings
from seals.frames import matrix_of, multiply
from seals.plugins.backends.mujoco_warp.engine import Engine
from seals.plugins.backends.mujoco_warp.robots import WarpRobot

if TYPE_CHECKING:
    from torch import Tensor

    from seals.plugins.backends.mujoco_warp.laws import LawKernel


KEPT = ("position", "velocity", "guess")
"""Tensors of the engine that make its state."""


class WarpWorlds:
    """B worlds with the same robots, stepped together.

    Args:
        backend: settings of the engine.
        parts: of every robot its effects, and what evaluates them.
        environment: what stands still.
        step: h [s].

    Attributes:
        robots: in the order of the parts.
        first: the first of them.
        time: since the start of each world [s], shape (B, 1).
        advance: advances all worlds by one step under the present commands, as one graph on a GPU.
    """

    def __init__(
        self,
        backend: Any,
        parts: Sequence[tuple[BatchLoads, BatchLoads | LawKernel]],
        environment: EnvironmentSettings,
        *,
        step: float,
    ) -> None:
        import torch

        like = parts[0][0].like
        self.count, self.device, self.step = parts[0][0].batch, like.device.type, step
        self.engine = e = Engine(
            [loads.robot for loads, _ in parts],
            environment,
            step=step,
            count=self.count,
            touching=backend.touching * len(parts),
            iterations=backend.solver_iterations,
            repeatable=backend.repeatable,
            device=self.device,
        )
        self.robots = [WarpRobot(e, k, *part, step) for k, part in enumerate(parts)]
        self.first = self.robots[0]
        self.time = torch.zeros(self.count, 1, device=self.device)
        self._tilt(backend.slope, environment)
        self._parts = {
            "look": self._begin,
            "laws": self._loaded,
            "solve": self._end,
            "note": self._noted,
        }
        self.advance = self.record(self.step_once)

    def _tilt(self, slope: float, environment: EnvironmentSettings) -> None:
        """Draw the slopes of all worlds, and turn their grounds."""
        rng = np.random.default_rng(0)
        angle, way = rng.uniform(0.0, slope, self.count), rng.uniform(-np.pi, np.pi, self.count)
        half = 0.5 * angle
        axis = np.stack((-np.sin(way), np.cos(way), 0.0 * way), axis=1)
        turns = np.concatenate((np.sin(half)[:, None] * axis, np.cos(half)[:, None]), axis=1)
        self._slopes = self.engine.numbers(turns)
        self._middle = self.engine.numbers([0.0, 0.0, ground_height(environment, 0.0, 0.0) or 0.0])
        if slope > 0.0:
            self.engine.tilt(matrix_of(self._slopes))

    def step_once(self) -> None:
        """Advance all worlds by one step under the present commands, launch by launch."""
        for part in self._parts.values():
            part()

    def parts(self) -> dict[str, Work]:
        """Return the parts of a step by name, in order, each recorded, for those who time them."""
        return {name: self.record(part) for name, part in self._parts.items()}

    def record(self, work: Work) -> Work:
        """Return work on tensors, in place, recorded where there is a GPU; it is called before."""
        return recorded(work, self.device)

    def pose(self) -> None:
        """Find the poses of all links at the present positions."""
        import mujoco_warp as mjw

        mjw.kinematics(self.engine.model, self.engine.data)

    def _begin(self) -> None:
        """Find poses, inertia, contacts and bias forces."""
        import mujoco_warp as mjw

        m, d = self.engine.model, self.engine.data
        mjw.fwd_position(m, d, factorize=False)
        mjw.fwd_velocity(m, d)

    def _end(self) -> None:
        """Factor the inertia, solve for accelerations and contact forces, and move on."""
        import mujoco_warp as mjw

        m, d = self.engine.model, self.engine.data
        mjw.fwd_acceleration(m, d, factorize=True)
        mjw.solve(m, d)
        mjw.euler(m, d)

    def _loaded(self) -> None:
        """Evaluate the effects on all robots."""
        import torch

        with torch.no_grad():
            for robot in self.robots:
                robot.load(self.time)

    def _noted(self) -> None:
        """Count what the robots did, and the time."""
        import torch

        with torch.no_grad():
            for robot in self.robots:
                robot.note()
            self.time += self.step

    def place(
        self, rows: Tensor, position: Tensor, quaternion: Tensor, velocity: Tensor, joints: Tensor
    ) -> None:
        """Begin some worlds with the first robot at a start, turned with their slope.

        Args: see `WarpRobot.place`.
        """
        turn = matrix_of(self._slopes)
        position = self._middle + (turn @ (position - self._middle)[:, :, None])[:, :, 0]
        self.first.place(rows, position, multiply(self._slopes, quaternion), velocity, joints)
        self.begin(rows)

    def begin(self, rows: Tensor) -> None:
        """Set the time of some worlds to zero, bool (B,); no earlier episode affects them."""
        for kept in (self.engine.guess, self.time):
            kept.masked_fill_(rows[:, None], 0.0)

    def overflowing(self) -> bool:
        """Return whether contacts or constraints were left out for want of room in any world."""
        return bool((self.engine.left_out & self.engine.room).any())

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state, as tensors."""
        engine = {name: getattr(self.engine, name).clone() for name in KEPT}
        robots = {str(k): robot.snapshot() for k, robot in enumerate(self.robots)}
        return {**engine, "time": self.time.clone(), "robots": robots}

    def restore(self, kept: dict[str, Any]) -> None:
        """Restore a snapshot."""
        for name in KEPT:
            getattr(self.engine, name).copy_(kept[name])
        self.time.copy_(kept["time"])
        for k, robot in enumerate(self.robots):
            robot.restore(kept["robots"][str(k)])


Work = Callable[[], None]
ROUNDS = 3
"""Calls before a recording: libraries choose and load their kernels in the first ones."""


def recorded(work: Work, device: str) -> Work:
    """Return work as one graph that is replayed on PyTorch's present stream.

    Warp records, for only it can insert the loops of its solver; PyTorch launches into the same
    stream, and takes what it needs from a pool that lives as long as the graph.

    Args:
        work: reads and writes the same memory at every call; called some times before.
        device: ``cpu`` records nothing.
    """
    if device == "cpu":
        return work
    import torch
    import warp

    wp: Any = warp
    pool = torch.cuda.MemPool()
    aside = torch.cuda.Stream()  # type: ignore[no-untyped-call, unused-ignore]
    stream = wp.stream_from_torch(aside)
    torch.cuda.synchronize()
    with torch.cuda.use_mem_pool(pool), torch.cuda.stream(aside), wp.ScopedStream(stream):
        for _ in range(ROUNDS):
            work()
        torch.cuda.synchronize()
        try:
            with wp.ScopedCapture(stream=stream) as capture:
                work()
        except (
            RuntimeError
        ) as cause:  # both libraries tell so of a driver without what a graph needs
            return _unrecorded(work, cause)
    torch.cuda.synchronize()

    def replay(pool: Any = pool) -> None:
        wp.capture_launch(capture.graph, stream=wp.stream_from_torch(torch.cuda.current_stream()))

    return replay


def _unrecorded(work: Work, cause: Any) -> Work:
    """Say that work is launched call by call, and return it, on PyTorch's present stream."""
    import torch
    import warp

    wp: Any = warp
    torch.cuda.synchronize()
    text = " ".join(str(cause).split())[:300]
    print(f"note: a step of the worlds cannot be recorded and is slower. {text}", file=sys.stderr)

    def call() -> None:
        with wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream())):
            work()

    return call
