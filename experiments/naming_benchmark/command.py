"""``seals benchmark``: public logs with a hidden effect, answered by SEALS and by others."""

from __future__ import annotations

import contextlib
import io
import json
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError, refuse_unlisted, suggestion
from seals.experiments.naming_benchmark import rivals
from seals.experiments.naming_benchmark.answers import Question
from seals.experiments.naming_benchmark.regions import found_regions
from seals.experiments.naming_benchmark.score import score, table
from seals.experiments.naming_benchmark.told import read_answer, read_truth
from seals.logs.native import read_native
from seals.sysid.diagnosis import diagnose
from seals.sysid.predictors.problem import prepare
from seals.untrusted_io import read_text

LOGS = Path(__file__).with_name("logs")
KEYS = ("out", "logs", "methods", "mujoco", "page")


def benchmark(arguments: list[str]) -> int:
    """Answer the public logs, score all answers in ``out``, and return the exit code.

    Args:
        arguments: of the command line, ``KEY=VALUE``.

    Raises:
        ConfigError: a key, a log or a method is not known, or an answer cannot be read.
    """
    given = _given(arguments)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    out = Path(given.get("out", "benchmark"))
    folders = {path.parent.name: path.parent for path in sorted(LOGS.glob("*/truth.yaml"))}
    logs = _list(given, "logs", list(folders))
    rival = [*rivals.installed(), *([rivals.MUJOCO] if "mujoco" in given else [])]
    known = [rivals.OURS, *rivals.NEEDS, rivals.MUJOCO]
    methods = _list(given, "methods", known, default=[rivals.OURS, *rival])
    names = [m for m in methods if m not in (rivals.OURS, *rival)]
    for absent in names:
        if absent == rivals.MUJOCO:
            raise ConfigError(f"{absent} needs mujoco=PYTHON.\n{rivals.ADVICE}")
        package = rivals.NEEDS[absent]
        raise ConfigError(
            f"{absent} needs {package}, which is not installed.\npip install 'aam-seals[benchmark]'"
        )
    for name in logs:
        missing = [m for m in methods if not (out / m / f"{name}.json").exists()]
        strange = [m for m in _all_methods(out) if _unplaced(out / m / f"{name}.json")]
        if missing or strange:
            _answer(folders[name], out, missing, strange, given.get("mujoco", ""))
    scores = []
    for method in _all_methods(out):
        paths = [(folders[n], out / method / f"{n}.json") for n in logs]
        pairs = [(read_truth(f), read_answer(p)) for f, p in paths if p.exists()]
        scores += [score(method, pairs)] if pairs else []
    text = table(scores)
    (out / "table.md").write_text(f"{text}\n", encoding="utf-8")
    print(text)
    if "page" in given:
        into_page(Path(given["page"]), text)
    return 0


def _given(arguments: Sequence[str]) -> dict[str, str]:
    given = {}
    for word in arguments:
        key, equals, value = word.partition("=")
        if not equals or key not in KEYS:
            raise ConfigError(
                f"'{word}' is not a word of seals benchmark.\n"
                f"{suggestion(key, KEYS, label='Keys')}, each as KEY=VALUE"
            )
        given[key] = value
    return given


def _list(
    given: dict[str, str], key: str, known: Sequence[str], *, default: Sequence[str] | None = None
) -> list[str]:
    """Return the chosen names of a list such as ``logs=[quad_calm,quad_drag]``."""
    if key not in given:
        return list(known if default is None else default)
    words = [w.strip() for w in given[key].strip("[]").split(",") if w.strip()]
    for word in words:
        refuse_unlisted(word, known, f"{key}: there is no '{word}'")
    return words


def _all_methods(out: Path) -> list[str]:
    """Return the methods with answers, ours first."""
    found = sorted(path.name for path in out.glob("*") if any(path.glob("*.json")))
    return sorted(found, key=lambda name: name != rivals.OURS)


def _unplaced(path: Path) -> bool:
    """Return true for an answer, of a stranger, whose regions are not known yet."""
    return path.exists() and "regions" not in read_answer(path)


def _answer(
    folder: Path, out: Path, missing: Sequence[str], strange: Sequence[str], python: str
) -> None:
    """Answer one log by some methods, and find the regions of what others answered."""
    log = read_native(folder)
    with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        problem = prepare(log)
        for method in (*missing, *strange):
            path = out / method / f"{folder.name}.json"
            begin = _processor()
            if method in strange:
                told: dict[str, Any] | None = read_answer(path)
            elif method == rivals.OURS:
                told = diagnose(log).to_dict()
                told = {key: told[key] for key in ("verdict", "effects", "reasons")}
            elif method == rivals.MUJOCO:
                told = rivals.by_mujoco(log, python)
            else:
                names = rivals.REGRESSIONS[method](Question.of(problem).table)
                told = {"verdict": "named" if names else "nothing_missing"}
                told["effects"] = [{"name": name} for name in names]
            if told is None:
                continue
            told.setdefault("seconds", _processor() - begin)
            told["regions"] = found_regions(
                problem,
                folder,
                [effect["name"] for effect in told["effects"]]
                if told["verdict"] == "named"
                else [],
            )
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(told, indent=1), encoding="utf-8")
    print(f"{folder.name}: {', '.join((*missing, *strange))}", flush=True)


def _processor() -> float:
    """Return the processor time of this process and its children [s]."""
    return sum(os.times()[:4])


BEGIN, END = "<!-- benchmark: begin -->", "<!-- benchmark: end -->"


def into_page(page: Path, text: str) -> None:
    """Put the table between the marks of a page.

    Raises:
        ConfigError: the page has no such marks.
    """
    old = read_text(page)
    before, begin, rest = old.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ConfigError(f"page={page} has no {BEGIN} and {END}.\nPut both on lines of their own.")
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")
