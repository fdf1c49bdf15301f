"""The compiler of laws beside torch.compile: ``python benchmarks/compile_laws.py``.

The same laws with the same numbers, each compiler in a process of its own, so that one that hangs
is ended alone and several compile at once (``--jobs``); then all that were compiled are timed in
turn, one at a time. ``--device cuda`` also launches each as one CUDA graph, by tensordict's
``CudaGraphModule`` and by `seals.learn.recorded`. Rows are in the CSV (``--out``) as soon as they
are known, compile time first. Needs no network.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import multiprocessing
import os
import statistics
import time
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import laws
import machine

COLUMNS = (
    *("law", "compiler", "launch", "device", "batch", "median_ms", "lowest_ms", "highest_ms"),
    *("robots_per_s", "build_s", "graphs", "apart", "note"),
)
TIMING_TIMEOUT = 30.0
"""Longest wait for one timed block [s]."""


def work(link: Connection, law: str, name: str, chosen: argparse.Namespace) -> None:
    """Compile a function in this process, send its results, then time blocks on request."""
    import torch

    torch.set_num_threads(1)
    torch._dynamo.config.cache_size_limit = 64
    torch._inductor.config.force_disable_caches = True
    torch._inductor.config.compile_threads = 1
    with laws.compiler(name), torch.no_grad():
        try:
            calls = _build(link, law, name, chosen)
        except Exception as problem:  # a benchmark tells each compiler's failure and goes on
            said = (str(problem).splitlines() or [""])[0][:160]
            link.send({"note": f"{type(problem).__name__}: {said}"})
            return
        for launch in iter(link.recv, None):
            link.send(laws.pace(calls[launch], chosen.device))


def _build(link: Connection, law: str, name: str, chosen: argparse.Namespace) -> dict[str, Any]:
    """Compile a law, launch it in every way, and send its numbers and build time."""
    from torch._dynamo.utils import counters

    begin = time.perf_counter()
    made = laws.law_of(law, chosen.batch, chosen.device)
    calls, found, notes = {}, {}, {}
    for launch in laws.launches_of(chosen.device, name):
        try:
            call = laws.launched(made, launch, chosen.device)
            for _ in range(3):
                result = call()
            calls[launch], found[launch] = call, laws.numbers(result)
        except Exception as problem:
            if launch == laws.LAUNCHES[0]:
                raise
            said = (str(problem).splitlines() or [""])[0][:160]
            notes[launch] = f"{type(problem).__name__}: {said}"
        if launch == laws.LAUNCHES[0]:
            spent, graphs = time.perf_counter() - begin, counters["stats"]["unique_graphs"]
    link.send({"found": found, "notes": notes, "build_s": spent, "graphs": graphs or 1})
    return calls


class Worker:
    """Process that compiles one function with one compiler, with its table rows.

    Args:
        law: one of `laws.LAWS`.
        name: one of `laws.COMPILERS`.
        chosen: options of the command.
    """

    def __init__(self, law: str, name: str, chosen: argparse.Namespace) -> None:
        """Start the process."""
        context = multiprocessing.get_context("spawn")
        self.law, self.name, self.found = law, name, dict[str, Any]()
        self.link, far = context.Pipe()
        self.process = context.Process(target=work, args=(far, law, name, chosen), daemon=True)
        self.process.start()
        far.close()
        self.begin = time.monotonic()
        fixed = {"law": law, "compiler": name, "device": chosen.device, "batch": chosen.batch}
        ways = laws.launches_of(chosen.device, name)
        self.rows = {way: fixed | {"launch": way, "note": "compiling"} for way in ways}
        self.times: dict[str, list[float]] = {}

    def take(self) -> None:
        """Receive the message of the process after compilation or failure."""
        try:
            sent = self.link.recv()
        except EOFError:
            sent = {"note": "the process ended without a word"}
        self.found = sent.get("found", {})
        for way, row in self.rows.items():
            row["note"] = sent.get("note", sent.get("notes", {}).get(way, ""))
            if way in self.found:
                row |= {"build_s": round(sent["build_s"], 1), "graphs": sent["graphs"]}
                self.times[way] = []
        if not self.found:
            self.end()

    def measure(self, way: str, batch: int) -> None:
        """Time one block of calls and update the statistics of all blocks."""
        self.link.send(way)
        if not self.link.poll(TIMING_TIMEOUT):
            self.rows[way]["note"] = f"a block took longer than {TIMING_TIMEOUT:.0f} s"
            self.end()
            return
        times = self.times[way]
        times.append(1e3 * self.link.recv())
        middle = statistics.median(times)
        row = {"median_ms": middle, "lowest_ms": min(times), "highest_ms": max(times)}
        row["robots_per_s"] = 1e3 * batch / middle
        self.rows[way] |= {name: float(f"{value:.4g}") for name, value in row.items()}

    def end(self, note: str = "") -> None:
        """End the process, recording the reason of an unexpected end."""
        for row in self.rows.values():
            row["note"] = note or row["note"]
        self.times = {}
        if not note and self.process.is_alive():
            # a process that failed hangs up by itself, perhaps in this moment
            with contextlib.suppress(BrokenPipeError):
                self.link.send(None)
            self.process.join(5.0)
        self.process.kill()
        self.process.join()
        self.link.close()


def write(workers: list[Worker], path: Path) -> None:
    """Write all known rows; the file is complete at any time."""
    eager = {w.law: w.found.get("calls") for w in workers if w.name == "eager"}
    aside = path.with_suffix(".part")
    with aside.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for worker in workers:
            for way, row in worker.rows.items():
                if eager.get(worker.law) is not None and way in worker.found:
                    apart = abs(worker.found[way] - eager[worker.law]).max()
                    row["apart"] = f"{apart:.1e}"
                table.writerow(row)
    os.replace(aside, path)


def compile_all(pairs: list[tuple[str, str]], workers: list[Worker], chosen: Any) -> None:
    """Compile functions in parallel processes with a time limit."""
    waiting, busy = list(pairs), list[Worker]()
    while waiting or busy:
        while waiting and len(busy) < chosen.jobs:
            worker = Worker(*waiting.pop(0), chosen)
            workers.append(worker)
            busy.append(worker)
        ready = wait([w.link for w in busy], timeout=1.0)
        for worker in list(busy):
            if worker.link in ready:
                worker.take()
            elif time.monotonic() - worker.begin > chosen.limit:
                worker.end(f"not compiled within {chosen.limit} s")
            else:
                continue
            busy.remove(worker)
            print(*(f"{value}" for value in next(iter(worker.rows.values())).values()), flush=True)
            write(workers, chosen.out)


def main() -> None:
    """Print and write milliseconds a call, robots a second, compile times and differences."""
    parser = argparse.ArgumentParser(description=__doc__)
    names = list(laws.COMPILERS)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--laws", nargs="+", default=list(laws.LAWS), choices=laws.LAWS)
    parser.add_argument("--compilers", nargs="+", default=names, choices=names)
    parser.add_argument("--batch", type=int, default=1000, help="robots at once")
    parser.add_argument("--repeats", type=int, default=7, help="blocks of each case, in turn")
    parser.add_argument("--limit", type=int, default=900, help="for compiling one law [s]")
    parser.add_argument("--jobs", type=int, default=1, help="laws compiled at once")
    parser.add_argument("--out", type=Path, default=Path("compile_laws.csv"), help="table")
    chosen = parser.parse_args()
    import torch

    if chosen.device != "cpu" and not torch.cuda.is_available():
        parser.error(f"PyTorch {torch.__version__} finds no accelerator. Say --device cpu")
    processor = torch.cuda.get_device_name() if chosen.device != "cpu" else "processor"
    print(f"{machine.describe()}, PyTorch {torch.__version__}, {processor}", flush=True)
    workers: list[Worker] = []
    # with several jobs all laws are compiled first; with one, no more processes stay than one law's
    groups = [chosen.laws] if chosen.jobs > 1 else [[law] for law in chosen.laws]
    for group in groups:
        compile_all([(law, c) for c in chosen.compilers for law in group], workers, chosen)
        for _ in range(chosen.repeats):
            for worker in workers:
                for way in list(worker.times):
                    worker.measure(way, chosen.batch)
            write(workers, chosen.out)
        for worker in workers:
            worker.end()
    print(chosen.out.read_text(encoding="utf-8"))


if __name__ == "__main__":
    machine.one_thread()
    main()
