"""Fuzzing of every reader and loader: each damaged file must be refused with a message.

Each target runs in a process of its own, whose memory is bounded by the system. Hypothesis takes
a sound file and damages it: bytes changed, cut out, repeated, numbers made huge; or draws a hostile
one that is well-formed. Whatever ends in another error than a refusal, takes longer than 5 s or
more than 1 GB is kept in a folder.

    python benchmarks/fuzz.py                       3 minutes for each target, one after the other
    python benchmarks/fuzz.py --jobs 8              as many at a time
    python benchmarks/fuzz.py --seconds 20 ulog urdf

Results so far are in `TARGET.json`, those of all targets in `summary.json`, beside the findings.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import queue
import resource
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path
from random import Random
from typing import Any

# at the end: the installed package comes before the checkout
sys.path.append(str(Path(__file__).parents[1]))

from benchmarks.fuzz_described import DESCRIBED
from benchmarks.fuzz_hostile import HOSTILE
from benchmarks.fuzz_peers import PEERS
from benchmarks.fuzz_published import PUBLISHED
from benchmarks.fuzz_stored import STORED
from benchmarks.fuzz_targets import TARGETS as PLAIN
from benchmarks.fuzz_targets import Target
from benchmarks.fuzz_tensors import TENSORS
from benchmarks.fuzz_vehicles import VEHICLES

TARGETS = {**PLAIN, **PUBLISHED, **STORED, **HOSTILE, **DESCRIBED, **PEERS, **TENSORS, **VEHICLES}
"""Every reader and loader by name."""

LONGEST = 5.0
"""Seconds of the processor that one file may take."""
STUCK = 60.0
"""Seconds of the clock after which a file that takes no processor hangs: others work here, too."""
MOST_MEMORY = 1 << 30
"""Bytes that one file may cost."""
MOST_PEAK = 2048.0
"""Memory of a target at its peak, libraries and all [MB]."""
_CODE = (0, 1, 0x7F, 0x80, 0xFE, 0xFF)


def damaged(data: Any, whole: bytes) -> bytes:
    """Draw a damaged copy of a file.

    Args:
        data: Hypothesis' source of choices.
        whole: a sound file.
    """
    from hypothesis import strategies as st

    raw = bytearray(whole)
    for _ in range(data.draw(st.integers(0, 6))):
        place = data.draw(st.integers(0, max(len(raw) - 1, 0)))
        size = data.draw(st.sampled_from((1, 1, 2, 4, 8, 64, 512)))
        kind = data.draw(st.integers(0, 6))
        if kind == 0:
            raw[place : place + size] = data.draw(st.binary(min_size=1, max_size=8))
        elif kind == 1:
            raw[place : place + size] = bytes([data.draw(st.sampled_from(_CODE))]) * size
        elif kind == 2:
            del raw[place : place + size]
        elif kind == 3:
            raw[place:place] = raw[place : place + size] * data.draw(st.sampled_from((1, 2, 300)))
        elif kind == 4:
            del raw[place:]
        elif kind == 5:
            other = data.draw(st.integers(0, max(len(raw) - 1, 0)))
            raw[place : place + size] = raw[other : other + size]
        else:
            words = (
                b"nan",
                b"1e400",
                b"-1",
                b"99999999999",
                b"0x7f",
                b"\xff\xfe",
                b"{",
                b"[[",
                b"&a",
            )
            raw[place : place + size] = data.draw(st.sampled_from(words))
    return bytes(raw)


def drawn(data: Any, target: Target) -> bytes:
    """Draw a file for a target: hostile and well-formed where it has a grammar, else damaged.

    Args:
        data: Hypothesis' source of choices.
        target: what is fuzzed.
    """
    from hypothesis import strategies as st

    if target.draw is None:
        return damaged(data, target.whole)
    # a grammar makes thousands of choices, which Hypothesis would note one by one
    return target.draw(Random(data.draw(st.integers(0, 2**63))))


def one(target: Target, content: bytes, folder: Path) -> str | None:
    """Load one file; return the defect in how that ended, or None."""
    from seals.errors import SealsError

    before, clock = time.process_time(), time.monotonic()
    try:
        target.load(target.place(folder, content))
    except SealsError:
        pass  # a refusal is what a damaged file deserves
    except MemoryError:
        return "more than 1 GB"
    except Exception:
        return traceback.format_exc(limit=-2)
    took, waited = time.process_time() - before, time.monotonic() - clock
    if waited > STUCK:
        return f"{waited:.0f} s of the clock"
    return f"{took:.1f} s" if took > LONGEST else None


def sound(target: Target, folder: Path) -> str | None:
    """Load the valid file; return the error, or None."""
    from seals.errors import SealsError

    try:
        target.load(target.place(folder, target.whole))
    except SealsError as refusal:
        return f"refused: {refusal}"
    return one(target, target.whole, folder)


def work(name: str, seconds: float, finds: Path, report: Any) -> None:
    """Fuzz one target for a while and report how it went."""
    # otherwise Hypothesis makes a folder where the command is given
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(finds / "hypothesis")
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import strategies as st

    warnings.simplefilter("ignore")
    target = TARGETS[name]()
    folder = Path(tempfile.mkdtemp(prefix=f"fuzz_{name}_"))
    # warm: what the libraries themselves need is not the file's doing
    told = sound(target, folder)
    used = _address_space()
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST_MEMORY, used + MOST_MEMORY))
    result: dict[str, Any] = {"files": 0, "findings": [], "slowest": 0.0, "peak": 0.0}
    end, count, slowest, seen = time.monotonic() + seconds, 0, 0.0, set[str]()
    current = finds / f"{name}.running"

    @settings(
        max_examples=50,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def batch(data: Any) -> None:
        nonlocal count, slowest
        # drawn first: Hypothesis wants the same draws each time
        content = drawn(data, target)
        if time.monotonic() > end:
            return
        current.write_bytes(content)
        before = time.process_time()
        wrong = one(target, content, folder)
        slowest = max(slowest, time.process_time() - before)
        count += 1
        place = (wrong or "").strip().rpartition("\n")[2][:60]
        if wrong and place not in seen:
            seen.add(place)
            (finds / f"{name}_{len(seen)}.bin").write_bytes(content)
            print(f"{name}: {wrong}", flush=True)

    if told:
        print(f"{name}: the sound file: {told}", flush=True)
    while time.monotonic() < end:
        batch()
        findings = [*sorted(seen), *([f"the sound file: {told}"] if told else [])]
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        if peak > MOST_PEAK:
            findings.append(f"{peak:.0f} MB at the peak")
        result = {"files": count, "findings": findings, "slowest": slowest, "peak": peak}
        # also for whoever cuts it off
        (finds / f"{name}.json").write_text(json.dumps(result))
    current.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    report.put(result)


def _address_space() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


class Running:
    """A target in its process."""

    def __init__(self, context: Any, name: str, seconds: float, finds: Path) -> None:
        self.name, self.finds, self.report = name, finds, context.Queue()
        self.process = context.Process(target=work, args=(name, seconds, finds, self.report))
        self.process.start()
        self.end = time.monotonic() + 1.5 * seconds + 2.0 * STUCK

    def result(self) -> dict[str, Any] | None:
        """Return what it came to; None while it goes on."""
        try:
            told: dict[str, Any] = self.report.get(timeout=0.05)
        except queue.Empty:
            if self.process.is_alive() and time.monotonic() < self.end:
                return None
            alive = self.process.is_alive()
            why = "hangs" if alive else f"ended with code {self.process.exitcode}"
            self.process.kill()
            file = f"{why}; the file is {self.finds / self.name}.running"
            return {"files": 0, "findings": [file], "slowest": 0.0, "peak": 0.0}
        self.process.join(STUCK)
        return told


def fuzzed(names: list[str], given: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Fuzz targets, some at a time; return the results by name."""
    context = multiprocessing.get_context("spawn")
    waiting, running = list(names), list[Running]()
    results: dict[str, dict[str, Any]] = {}
    while waiting or running:
        while waiting and len(running) < given.jobs:
            running.append(Running(context, waiting.pop(0), given.seconds, given.finds))
        for one in list(running):
            told = one.result()
            if told is None:
                continue
            running.remove(one)
            results[one.name] = told
            (given.finds / "summary.json").write_text(json.dumps(results, indent=1))
            print(
                f"{one.name:16} {told['files']:7} files, {len(told['findings'])} findings, "
                f"slowest {told['slowest']:.2f} s, peak {told['peak']:.0f} MB",
                *told["findings"],
                sep="\n  ",
                flush=True,
            )
    return results


def main() -> int:
    """Fuzz the targets named, or all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    parser.add_argument("--seconds", type=float, default=180.0, help="for each target")
    parser.add_argument("--jobs", type=int, default=1, help="targets at a time")
    parser.add_argument("--finds", type=Path, default=Path("runs/fuzz"), help="folder of findings")
    given = parser.parse_args()
    unknown = [name for name in given.targets if name not in TARGETS]
    if unknown:
        parser.error(f"no target {unknown[0]}; there are {', '.join(TARGETS)}")
    given.finds.mkdir(parents=True, exist_ok=True)
    results = fuzzed(given.targets or list(TARGETS), given)
    files = sum(told["files"] for told in results.values())
    bad = sum(len(told["findings"]) for told in results.values())
    print(f"{len(results)} targets, {files} files, {bad} findings")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
