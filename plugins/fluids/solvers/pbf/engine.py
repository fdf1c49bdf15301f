"""Initialisation of Taichi: device, threads, precision; once per process."""

from __future__ import annotations

import contextlib
import os
import time
import weakref
from dataclasses import dataclass
from typing import Any, ClassVar

from seals.caches import cache_folder
from seals.errors import ConfigError, PhysicsError, refuse_unlisted
from seals.plugins.fluids.solvers.pbf.language import ti

DEVICES = ("cpu", "cuda")
LOCKED = 60.0
"""Age at which the lock of Taichi's cache is that of a killed process: it is held for less [s]."""


@dataclass(kw_only=True)
class Engine:
    """Initialisation of Taichi for the process, with its settings.

    A second start with the same choice joins the first; with another choice it is refused,
    because Taichi would destroy every field in use. With the last water Taichi ends: it keeps what
    it compiled for every water, some twenty megabytes each, for as long as it runs.

    Args:
        device: ``cpu`` or ``cuda``.
        threads: threads on the CPU; 0 takes all that this process may use.
        cache: whether compiled kernels are kept between processes.

    Raises:
        ConfigError: unknown device, or a start that differs from the first one.
        PhysicsError: CUDA asked for but absent.
    """

    device: str = "cpu"
    threads: int = 0
    cache: bool = True

    _started: ClassVar[tuple[str, int] | None] = None
    _waters: ClassVar[weakref.WeakSet[Any]] = weakref.WeakSet()

    def __post_init__(self) -> None:
        """Check the choice; Taichi starts with the first water."""
        refuse_unlisted(self.device, DEVICES, f"device {self.device!r} is unknown")
        allowed = len(os.sched_getaffinity(0))
        if self.threads < 0:
            raise ConfigError(f"threads={self.threads} must be 0 (all) or more.")
        self.threads = self.threads or allowed

    @property
    def accelerated(self) -> bool:
        """True if kernels run on a CUDA device."""
        return self.device == "cuda"

    def start(self, water: object) -> Any:
        """Initialise Taichi for a water unless that was done already; return its module."""
        wanted = (self.device, 0 if self.accelerated else self.threads)
        if Engine._started is None:
            self._init()
            Engine._started = wanted
        elif Engine._started != wanted:
            have, asked = (f"{d}, {t} threads" if t else d for d, t in (Engine._started, wanted))
            raise ConfigError(
                f"The particle engine already runs on {have}; {asked} is requested.\n"
                "One process has one engine: use the same device and threads, or a new process."
            )
        Engine._waters.add(water)
        return ti

    @staticmethod
    def leave(water: object) -> None:
        """End Taichi where a water was the last one, and free what it has compiled."""
        Engine._waters.discard(water)
        if not Engine._waters and Engine._started is not None:
            ti.reset()
            Engine._started = None

    def _init(self) -> None:
        if self.accelerated and not bool(ti._lib.core.with_cuda()):
            raise PhysicsError(
                "device=cuda is requested, but no CUDA device can be used here.\n"
                "Use device=cpu, or check the driver with: nvidia-smi"
            )
        choice: dict[str, Any] = (
            {"arch": ti.cuda}
            if self.accelerated
            else {"arch": ti.cpu, "cpu_max_num_threads": self.threads}
        )
        if self.cache:
            folder = cache_folder("taichi")
            # remove a lock left by a killed process: with it, Taichi compiles everything anew for
            # good
            lock = folder / "ticache.lock"
            with contextlib.suppress(OSError):  # absent, or another process was faster
                if time.time() - lock.stat().st_mtime > LOCKED:
                    lock.unlink()
            choice["offline_cache_file_path"] = str(folder)
        ti.init(
            **choice,
            default_fp=ti.f32,
            default_ip=ti.i32,
            fast_math=True,
            offline_cache=self.cache,
            log_level=ti.ERROR,
            random_seed=0,
        )
