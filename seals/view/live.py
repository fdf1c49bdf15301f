"""Live run in a child process."""

from __future__ import annotations

import contextlib
import io
import subprocess
import weakref
from collections.abc import Callable
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.child_process import command, environment
from seals.errors import SealsError
from seals.rendering.scene import Poses
from seals.run.particle_snapshots import subsampled
from seals.run.recorder import Moment, Recorder

RATE = 30.0
"""Frames sent in one second of simulated time [Hz]."""
EVERY = 6
"""Frames from one picture of the particles to the next."""


class Frame(NamedTuple):
    """State of a live run at one time.

    Args:
        time: [s].
        position: of the scene's frames, world [m], shape (F, 3).
        rotation: R_WF, shape (F, 3, 3).
        particles: places of the water [m], shape (n, 3), None when it has none or they were not
            sent.
    """

    time: float
    position: NDArray[np.float32]
    rotation: NDArray[np.float32]
    particles: NDArray[np.float32] | None

    @property
    def poses(self) -> Poses:
        """The poses as a batch of one."""
        return Poses(self.position[None].astype(float), self.rotation[None].astype(float))


class Live:
    """Live run in a child process, from the configuration in a folder.

    The engines behind a run may be started once in a process only, so each run has its own.

    Args:
        folder: of the run; it holds ``.hydra/config.yaml``.

    Attributes:
        failure: what stopped the run, as its refusal says it; empty while nothing did.
    """

    def __init__(self, folder: Path) -> None:
        self._ears, mouth = Pipe(duplex=False)
        with mouth:
            self._process = subprocess.Popen(
                command(
                    Path(__file__).with_name("live_child.py"), str(folder), str(mouth.fileno())
                ),
                env=environment(),
                pass_fds=[mouth.fileno()],
                stdin=subprocess.DEVNULL,
            )
        # a page that ends takes its run with it
        self._end = weakref.finalize(self, _end, self._process)
        self.over, self.failure = False, ""

    def heard(self) -> list[Frame]:
        """Return the new frames; ``over`` is set after the end of the run."""
        found: list[Frame] = []
        try:
            while not self.over and self._ears.poll():
                said = self._ears.recv_bytes()
                if said[:1] == _FRAME:
                    found.append(_unpacked(said[1:]))
                else:
                    self.over, self.failure = True, said[1:].decode("utf-8", "replace")
        except (EOFError, OSError):
            code = self._process.wait()
            self.over = True
            self.failure = f"The run was terminated externally (exit code {code})."
        return found

    def stop(self) -> None:
        """Stop the run; its results so far are written to its folder."""
        self._end()
        self._ears.close()


_FRAME, _WORDS = b"f", b"w"
_PATIENCE = 5.0
"""How long a run may take to write what it has [s]."""


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _packed(frame: Frame) -> bytes:
    """Serialise the arrays of a frame to bytes.

    Example:
        >>> frame = Frame(0.5, np.zeros((1, 3), np.float32), np.zeros((1, 3, 3), np.float32), None)
        >>> _unpacked(_packed(frame)).time
        0.5
    """
    arrays = {"time": np.array(frame.time), **frame._asdict(), "particles": frame.particles}
    file = io.BytesIO()
    np.savez(file, **{name: x for name, x in arrays.items() if x is not None})
    return file.getvalue()


def _unpacked(content: bytes) -> Frame:
    """Rebuild a frame from the bytes of `_packed`."""
    with np.load(io.BytesIO(content), allow_pickle=False) as found:
        particles = found.get("particles")
        return Frame(float(found["time"]), found["position"], found["rotation"], particles)


class _Broadcast(Recorder):
    """Sender of frames at a rate in simulated time.

    Args:
        say: takes a frame.
    """

    def __init__(self, say: Callable[[Frame], None]) -> None:
        self._say, self._next, self._count = say, 0.0, 0

    def record(self, moment: Moment) -> None:
        """Send a frame when one is due."""
        world = moment.world
        if world.time < self._next:
            return
        from seals.run.sight import poses_of

        self._next = world.time + 1.0 / RATE
        poses, fluid, due = poses_of(world.actors), world.fluid, self._count % EVERY == 0
        self._say(
            Frame(
                float(world.time),
                np.asarray(poses.position[0], dtype=np.float32),
                np.asarray(poses.rotation[0], dtype=np.float32),
                subsampled(fluid.particles()[0]) if fluid is not None and due else None,
            )
        )
        self._count += 1


def simulate_into(folder: str, mouth: Connection) -> None:
    """Simulate a run and send frames, then its error text, empty without an error.

    Args:
        folder: of the run; it holds ``.hydra/config.yaml``.
        mouth: end of the pipe to speak into.
    """
    from seals.run.application import run_into
    from seals.run.build import build_run
    from seals.run.replay_config import recalled

    try:
        settings = build_run(recalled(Path(folder), key="view"))
        broadcast = _Broadcast(lambda frame: mouth.send_bytes(_FRAME + _packed(frame)))
        record = run_into(Path(folder), settings, recorders=[broadcast])
        error = record.error
        words = "" if error is None else f"{type(error).__name__}: {error}"
    except SealsError as refusal:
        words = f"{type(refusal).__name__}: {refusal}"
    # a page that has gone hears no more
    with contextlib.suppress(BrokenPipeError):
        mouth.send_bytes(_WORDS + words.encode())
    mouth.close()
