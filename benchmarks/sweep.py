"""Sweep on one core, on several, and interrupted: ``python benchmarks/sweep.py``.

Three sweeps of the same jobs: one after the other in one process; by joblib in several; by joblib,
killed with SIGKILL when half of the jobs are done and taken up by the same command. Their tables
must be the same and no job may run twice. On a machine that others use as well, wall times say
little. So the processor time of the sweep and that of everything else stand beside them, and the
speed-up that the processor times alone allow: what the first process did counts in full, what the
others did is shared among them.
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import machine

CLI = "from seals.cli.main import main; raise SystemExit(main())"
RECIPE = ("experiment=drop_test", "+effect@effects.breeze=wind")
METRICS = (
    "metric=position_z.min,specific_force_z.max,velocity_x.last,ledger.gravity.base.force_z.rms"
)
TICK = os.sysconf("SC_CLK_TCK")


class Cost(NamedTuple):
    """Cost of a sweep: wall time, and CPU time of it, its first process and all others [s]."""

    wall: float
    own: float
    first: float
    others: float


def words(jobs: int, folder: Path, *more: str) -> list[str]:
    """Return the command of a sweep of so many jobs: winds and seeds."""
    grid = f"effects.breeze.velocity_x=0,2,4,6 seed=range({jobs // 4})".split()
    return ["run", "--multirun", *RECIPE, *grid, f"hydra.sweep.dir={folder}", *more]


def begun(arguments: list[str], *, group: bool = False) -> subprocess.Popen[bytes]:
    """Start ``seals`` in a fresh process; its progress goes to the terminal."""
    command = [sys.executable, "-c", CLI, *arguments]
    return subprocess.Popen(command, stdout=sys.stderr, start_new_session=group)


def timed(arguments: list[str]) -> Cost:
    """Run ``seals`` to its end."""
    start, busy, before = time.perf_counter(), machine_busy(), os.times()
    process = begun(arguments)
    first = 0.0
    while process.poll() is None:
        first = max(first, spent(process.pid))
        time.sleep(0.1)
    if process.returncode != 0:
        raise SystemExit(f"seals {' '.join(arguments)} failed")
    after = os.times()
    own = after.children_user + after.children_system
    own -= before.children_user + before.children_system
    return Cost(time.perf_counter() - start, own, first, machine_busy() - busy - own)


def spent(pid: int) -> float:
    """Return the processor time of one living process, its children left out [s]."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except FileNotFoundError:
        # it ended since it was asked for
        return 0.0
    return (int(fields[11]) + int(fields[12])) / TICK


def machine_busy() -> float:
    """Return the time that all processors have worked since the machine started [s]."""
    fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
    user, nice, system, _, _, irq, soft = (int(x) for x in fields[1:8])
    return (user + nice + system + irq + soft) / TICK


def killed(jobs: int, folder: Path, *more: str) -> int:
    """Start a sweep, kill it and all its processes in the middle; return the jobs done by then."""
    process = begun(words(jobs, folder, *more), group=True)
    while done(folder) < jobs // 2:
        if process.poll() is not None:
            raise SystemExit("the sweep ended before it could be killed")
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return done(folder)


def done(folder: Path) -> int:
    """Return the entries of a sweep's job log."""
    book = folder / "jobs.csv"
    return max(0, book.read_bytes().count(b"\n") - 1) if book.is_file() else 0


def table(folder: Path) -> list[dict[str, str]]:
    """Return the table of a sweep, durations left out."""
    out = folder / "table.csv"
    arguments = ["runs", str(folder), METRICS, f"table={out}", "replace=true"]
    subprocess.run([sys.executable, "-c", CLI, *arguments], check=True, stdout=subprocess.DEVNULL)
    with out.open(newline="", encoding="utf-8") as file:
        return [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)]


def twice(folder: Path) -> int:
    """Return the number of jobs with more than one entry in the job log."""
    with (folder / "jobs.csv").open(newline="", encoding="utf-8") as file:
        counts = Counter(row["number"] for row in csv.DictReader(file))
    return sum(1 for count in counts.values() if count > 1)


def report(name: str, cost: Cost) -> None:
    """Print one line of the costs."""
    used = cost.others / cost.wall
    print(
        f"{name:28} wall {cost.wall:7.1f} s, own processor time {cost.own:7.1f} s, "
        f"{used:.2f} of {os.cpu_count()} cores used by others",
        flush=True,
    )


def main() -> None:
    """Print costs, speed-up and what the kill changed; exit code 1 when tables differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=200, help="of each sweep, a multiple of 4")
    parser.add_argument("--processes", type=int, default=2, help="at once")
    parser.add_argument("--out", type=Path, help="folder to keep; a temporary one when left out")
    given = parser.parse_args()
    print(machine.describe())
    root = given.out or Path(tempfile.mkdtemp())
    launcher = ("hydra/launcher=joblib", f"hydra.launcher.n_jobs={given.processes}")
    serial = timed(words(given.jobs, root / "serial"))
    report("one after the other", serial)
    several = timed(words(given.jobs, root / "several", *launcher))
    report(f"{given.processes} processes", several)
    shared = several.first + (several.own - several.first) / given.processes
    print(
        f"speed-up by wall time {serial.wall / several.wall:.2f}, "
        f"by processor time {serial.own / shared:.2f} ({several.first:.1f} s in the first process)"
    )
    at = killed(given.jobs, root / "killed", *launcher)
    resumed = timed([*words(given.jobs, root / "killed", *launcher), "--resume"])
    report(f"resumed, killed after {at} jobs", resumed)
    tables = [table(root / name) for name in ("serial", "several", "killed")]
    again = [twice(root / name) for name in ("serial", "several", "killed")]
    same = tables[0] == tables[1] == tables[2] and len(tables[0]) == given.jobs
    print(f"tables of {len(tables[0])} rows the same: {same}; jobs that ran twice: {sum(again)}")
    if given.out is None:
        shutil.rmtree(root)
    raise SystemExit(0 if same and not sum(again) else 1)


if __name__ == "__main__":
    machine.one_thread()
    main()
