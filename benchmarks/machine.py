"""Helpers of benchmarks: description of the machine, one thread, medians."""

from __future__ import annotations

import os
import platform
import statistics
import sys
from collections.abc import Callable
from pathlib import Path

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread() -> None:
    """Restart this program with one thread; libraries read the variables on import."""
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.execve(
            sys.executable, [sys.executable, *sys.argv], os.environ | dict.fromkeys(THREADS, "1")
        )


def describe() -> str:
    """Return processor, cores, Python and NumPy in one line.

    Example:
        >>> "Python" in describe()
        True
    """
    import numpy as np

    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    name = names[0] if names else platform.processor() or platform.machine()
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}"
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}, {os.cpu_count()} cores{load}, {versions}, one thread"


def median(measure: Callable[[], float], repeats: int) -> tuple[float, float, float]:
    """Return median, lowest and highest of repeated measurements."""
    found = sorted(measure() for _ in range(repeats))
    return statistics.median(found), found[0], found[-1]
