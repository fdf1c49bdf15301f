"""Commands for `benchmarks.faults`, with the files allowed after an interruption."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from seals.cli.main import main
from seals.errors import ConfigError, SealsError
from seals.logs.log import Log
from seals.logs.native import read_native, write_native
from seals.logs.run_folder import LOCK, held
from seals.logs.shipped import shipped_logs
from seals.logs.table import read_parquet
from seals.sweep.rows import find_rows

Judge = Callable[[Path, Path, int], str]


@dataclass(frozen=True, kw_only=True)
class Case:
    """One command.

    Args:
        words: of the command, started in its folder.
        prepare: makes what the folder holds before.
        judge: of the folder before, that after, and the exit code; returns ``before``,
            ``complete``, ``cut``, or what is wrong.
        again: words that take up what was cut off in a folder; empty where nothing can be.
        code: exit code without a fault.
    """

    words: tuple[str, ...]
    judge: Judge
    prepare: Callable[[Path], None] = lambda folder: None
    again: Callable[[Path], tuple[str, ...]] = lambda folder: ()
    code: int = 0

    def start(self) -> int:
        """Run the command here and return its exit code."""
        return main(list(self.words))


SHORT = ("time.step=0.01", "time.duration=0.04", "initial.position=[0,0,1]")
RUN = ("run", "robot=ball", *SHORT, "hydra.run.dir=a")


def visible(folder: Path) -> dict[str, bytes]:
    """Return the files below a folder that are not hidden."""
    found = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    return {name: data for name, data in found.items() if not _hidden(name)}


def _hidden(name: str) -> bool:
    # what a kill left beside a file under a hidden name is taken for nothing by nobody
    parts = Path(name).parts
    # nor is the configuration of a command that writes elsewhere
    return parts[0] == "runs" or any(p.startswith(".") and p != ".hydra" for p in parts)


def _run(before: Path, after: Path, code: int, folder: str = "a") -> str:
    """Judge the folder of a single run."""
    place = after / folder
    if not place.exists():
        return "before"
    with contextlib.suppress(SealsError), held(place):
        pass  # whoever comes next mends what was moved half-way
    if visible(place) == (visible(before / folder) if (before / folder).exists() else {}):
        return "before"
    if set(visible(place)) <= {".hydra/config.yaml", ".hydra/hydra.yaml"}:
        return "cut"  # nobody takes it for a run, and the same words begin one
    rows = {str(row.values["run"]): row for row in find_rows(place)}
    earlier, row = before / folder, rows.get(folder)
    if earlier.exists() and visible(place / "earlier_1") != visible(earlier):
        return "what was there before is gone, or has changed"
    if row is None or row.damage:
        return f"damaged: {row.damage}" if row else "cut"
    return _own_files(place, str(row.values["state"]), code)


def _own_files(place: Path, state: str, code: int) -> str:
    """Judge what a run itself wrote."""
    if (place / "log.parquet").exists():
        read_native(place)
    for table in place.glob("[!.]*.parquet"):
        read_parquet(table)
    if state == "done":
        names = {"log.parquet", "ledger.parquet", "meta.yaml", "report.html", ".hydra/config.yaml"}
        missing = [name for name in names if not (place / name).exists()]
        return f"done without {missing}" if missing else "complete"
    cut = state in ("interrupted", "failed", "begun") and code
    return "cut" if cut else f"{state}, code {code}"


def _earlier(folder: Path) -> None:
    _seals(*RUN, "seed=7", "name=older")


def _sweep(before: Path, after: Path, code: int) -> str:
    """Judge a sweep: a job that is done is whole, and no other says so."""
    place = after / "s"
    if not (place / "sweep.json").exists():
        left = [name for name in visible(after) if name.endswith((".parquet", "run.json"))]
        return f"jobs without a sweep: {left}" if left else "before"
    if not any((place / name).exists() for name in ("0", "1")):
        return "cut"
    rows: dict[str, Any] = {}
    with contextlib.suppress(ConfigError):  # a job whose folder is empty yet is no run
        rows = {str(row.values["run"]): row for row in find_rows(place)}
    done = 0
    for name in ("0", "1"):
        row = rows.get(name)
        if row is None:
            continue
        if row.damage:
            return f"job {name} is damaged: {row.damage}"
        if row.values["state"] == "done":
            done += 1
            read_native(place / name)
            facts = json.loads((place / name / "run.json").read_text())
            if facts["state"] != "done" or facts["seed"] != int(name) + 1:
                return f"job {name} is of another run"
    return "complete" if done == 2 else "cut"


def _file(name: str) -> Judge:
    """Return a judge of one file: absent as before, or whole."""

    def judge(before: Path, after: Path, code: int) -> str:
        old, new = visible(before), visible(after)
        changed = {key for key in {*old, *new} if old.get(key) != new.get(key)}
        if not changed:
            return "before"
        if changed != {name}:
            return f"changed: {sorted(changed)}"
        return "complete" if new[name].endswith(b"\n") else "half a file"

    return judge


def _answer(folder: Path) -> None:
    parameters = {"velocity_x": {"value": 1.5, "low90": 1.4, "high90": 1.6}}
    answer = {
        "verdict": "named",
        "effects": [{"name": "wind", "confidence": 0.98, "parameters": parameters}],
        "log": {"path": str(shipped_logs()["hidden_effect/flight_a"])},
    }
    (folder / "diagnosis.json").write_text(json.dumps(answer))


def _table(folder: Path) -> None:
    lines = "\n".join(f"{k / 100},{k % 7}" for k in range(300))
    (folder / "long.csv").write_text(f"t,depth\n{lines}\n")


def _converted(before: Path, after: Path, code: int) -> str:
    if visible(before) == visible(after):
        return "before"
    read_native(after / "out")
    names = {name for name in visible(after) if name.startswith("out/")}
    return "complete" if {"out/log.parquet", "out/meta.yaml"} <= names else f"has {sorted(names)}"


def _flown(folder: Path) -> None:
    _seals("run", "robot=ball", *SHORT, "hydra.run.dir=flown")


def _rendered(before: Path, after: Path, code: int) -> str:
    """Judge frames: each is whole, and the run that is drawn is as it was."""
    old = visible(before)
    new = {name: data for name, data in visible(after).items() if not name.startswith("out/")}
    if old != new:
        return f"changed: {sorted(set(old) ^ set(new))}"
    frames = sorted((after / "out").glob("frame_*.png"))
    if any(not frame.read_bytes().endswith(b"IEND\xaeB`\x82") for frame in frames):
        return "half a frame"
    if code == 0:
        return "complete" if len(frames) == 2 else f"{len(frames)} frames"
    return "cut" if (after / "out").exists() else "before"


def _trained(before: Path, after: Path, code: int) -> str:
    """Judge a training: its state is told, its tables are whole lines."""
    place = after / "a"
    if not (place / "run.json").exists():
        return "before" if not (place / "policy").exists() else "a policy of nobody"
    (row,) = (r for r in find_rows(place) if r.folder == place)
    for table in place.glob("*.csv"):
        if not table.read_text().startswith("step"):
            return f"{table.name} has no head"
    if row.values["state"] == "done":
        whole = (place / "policy" / "policy.safetensors").exists()
        return "complete" if whole else "done without a policy"
    return "cut" if row.values["state"] in ("interrupted", "failed") else str(row.values["state"])


def _short(folder: Path, rows: int) -> None:
    """Make a log of the start of a shipped flight."""
    log = read_native(shipped_logs()["hidden_effect/flight_b"])
    columns = {name: values[:rows] for name, values in log.columns.items()}
    write_native(Log(name="short", columns=columns, meta=log.meta), folder / "short")


def _resumed(folder: Path) -> tuple[str, ...]:
    """Return the words that take up a training, from its checkpoint where there is one."""
    taken_up = ("train", "resume=a")
    return taken_up if (folder / "a" / "checkpoint.bin").exists() else TRAIN


def _verified(before: Path, after: Path, code: int) -> str:
    """Judge a verification: the model is marked, or not, and is whole."""
    import yaml

    model = after / "models" / "found.yaml"
    if not isinstance(yaml.safe_load(model.read_text()), dict):
        return "half a model"
    answer = after / "out" / "verify.json"
    if answer.exists():
        json.loads(answer.read_text())
        return "complete" if code in (0, 14) else "cut"
    return "cut" if code else "no answer"


def _swum(folder: Path) -> None:
    _seals(
        *("run", "robot=auv", "water=fossen", "environment.tank_bottom=-8", "guide=waypoints"),
        *("guide.places=[[0.8,0.3,-2.5]]", "guide.speed=0.8", "initial.position=[0,0,-3]"),
        *("time.duration=2", "effects.water_drag.coefficient_x=27", "hydra.run.dir=swum"),
    )


def _calibrated(before: Path, after: Path, code: int) -> str:
    """Judge a calibration: the log is as it was, the new robot is whole or not there."""
    import yaml

    old, new = visible(before), visible(after)
    if any(new.get(name) != data for name, data in old.items()):
        return "the log has changed"
    answer, robot = after / "out" / "calibration.json", after / "out" / "robot"
    if answer.exists():
        json.loads(answer.read_text())
    if robot.exists():
        wanted = {name for name in visible(_AUV) if "__pycache__" not in name}
        missing = sorted(wanted - set(visible(robot)))
        if missing or not isinstance(yaml.safe_load((robot / "robot.yaml").read_text()), dict):
            return f"half a robot, without {missing}"
    if answer.exists() and robot.exists():
        return "complete"
    return ("cut" if (after / "out").exists() else "before") if code else "no answer"


def _model(folder: Path) -> None:
    _answer(folder)
    _short(folder, 200)
    _seals("add", "diagnosis=diagnosis.json", "name=found")


def _diagnosed(before: Path, after: Path, code: int) -> str:
    """Judge a diagnosis: the log is as it was, the answer is whole or not there."""
    old, new = visible(before), visible(after)
    if any(new.get(name) != data for name, data in old.items()):
        return "the log has changed"
    answer = after / "out" / "diagnosis.json"
    if answer.exists():
        json.loads(answer.read_text())["verdict"]
    if code in _VERDICTS:
        whole = answer.exists() and (after / "out" / "report.html").exists()
        return "complete" if whole else "no answer"
    return "cut" if set(new) != set(old) else "before"


def _seals(*words: str) -> None:
    """Run a command without a word.

    Raises:
        RuntimeError: it did not end with 0.
    """
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main(list(words))
    if code:
        raise RuntimeError(said.getvalue())


TRAIN = (
    *("train", "env=reach", "learner=sac", "task.duration=0.2", "count=2", "learner.hidden=[8]"),
    *("learner.batch=4", "learner.random_steps=4", "course.steps=24", "course.look_every=12"),
    *("course.log_every=12", "course.episodes=1", "course.checkpoint=0.01", "seed=5"),
    "hydra.run.dir=a",
)
VERIFY = ("verify", "log=short", "model=models/found.yaml", "out=out")
DIAGNOSE = ("diagnose", "log=short", "plan=false", "processes=1", "out=out")
_VERDICTS = (0, 10, 11, 12, 13)
"""Exit codes of a diagnosis that came to its end."""
_AUV = Path(str(resources.files("seals.robots"))) / "auv"
CALIBRATE = (
    *("calibrate", "log=swum", "robot=auv", "parameters=[effects.water_drag.coefficient_x]"),
    *("plan=false", "report=false", "apply=true", "out=out"),
)
RENDER = (
    *("render", "run=flown", "viewer@renderer=raycast", "width=16", "height=12"),
    *("film=false", "out=out", "fps=25"),
)
CASES: dict[str, Case] = {
    "calibrate": Case(
        words=CALIBRATE, judge=_calibrated, prepare=_swum, again=lambda folder: CALIBRATE
    ),
    "convert": Case(
        words=("convert", "log=long.csv", "reader=csv", "out=out"), judge=_converted, prepare=_table
    ),
    "diagnose": Case(
        words=DIAGNOSE,
        judge=_diagnosed,
        prepare=lambda folder: _short(folder, 300),
        again=lambda folder: DIAGNOSE,
        code=10,
    ),
    "add": Case(
        words=("add", "diagnosis=diagnosis.json", "name=found"),
        judge=_file("models/found.yaml"),
        prepare=_answer,
    ),
    "run": Case(words=RUN, judge=_run, again=lambda folder: RUN),
    "run in a used folder": Case(words=RUN, judge=_run, prepare=_earlier),
    "sweep": Case(
        words=("run", "--multirun", "robot=ball", *SHORT, "seed=1,2", "hydra.sweep.dir=s"),
        judge=_sweep,
        again=lambda folder: ("run", "resume=s"),
    ),
    "render": Case(words=RENDER, judge=_rendered, prepare=_flown, again=lambda folder: RENDER),
    "train": Case(words=TRAIN, judge=_trained, again=_resumed),
    "verify": Case(words=VERIFY, judge=_verified, prepare=_model, again=lambda folder: VERIFY),
}
"""Every one by name."""
__all__ = ["CASES", "LOCK", "Case"]
