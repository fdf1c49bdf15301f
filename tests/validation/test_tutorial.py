"""The tutorial is run as it is printed: its commands, the lines it promises, its exit codes."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import yaml

from seals.logs.shipped import shipped_logs

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial_missing_effect.md"
TRUTH = Path(__file__).parent / "hidden_effect_truth.yaml"
SEALS = "from seals.cli.main import main; raise SystemExit(main())"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
# machines differ in the last digits of a fit; a change of the answer is larger than this
SHARE = 0.03


class Step(NamedTuple):
    """One printed command, what must be seen of its output, and its exit code."""

    command: str
    lines: list[str]
    code: int


def steps(text: str) -> list[Step]:
    """Read the commands of a page and the lines printed below each."""
    found = []
    for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL):
        command, *lines = block.strip("\n").split("\n")
        code = re.fullmatch(r"\[exit code (\d+)\]", lines[-1])
        seen = lines[:-1] if code else lines
        found.append(Step(command.removeprefix("$ "), seen, int(code[1]) if code else 0))
    return found


def told(line: str, output: str) -> bool:
    """Whether a line is in the output, its numbers within a few per cent."""
    words = r"\s+".join(re.escape(w) for w in NUMBER.sub("\0", line).split())
    pattern = words.replace("\0", f"({NUMBER.pattern})")
    wanted = [float(n) for n in NUMBER.findall(line)]
    return any(
        all(abs(float(a) - b) <= SHARE * max(abs(b), 0.1) for a, b in zip(m, wanted, strict=True))
        for m in (found.groups() for found in re.finditer(pattern, output))
    )


def test_a_changed_number_or_word_would_be_seen() -> None:
    """Comparing lines forgives the last digits and nothing else."""
    said = "x\n    velocity_x = 2.732 m/s  (90 %: 2.572 to 2.892)\n"
    assert told("velocity_x = 2.73 m/s (90 %: 2.57 to 2.89)", said)
    assert not told("velocity_x = 2.43 m/s (90 %: 2.57 to 2.89)", said)
    assert not told("velocity_y = 2.73 m/s (90 %: 2.57 to 2.89)", said)


def test_the_tutorial_runs_as_printed(tmp_path: Path) -> None:
    """In an empty folder every command ends as promised and prints the promised lines."""
    page = steps(PAGE.read_text(encoding="utf-8"))
    assert [s.command.split()[1] for s in page] == ["diagnose", "describe", "plan", "add", "verify"]
    for step in page:
        words = [sys.executable, "-c", SEALS, *step.command.split()[1:]]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == step.code, step.command + done.stderr
        assert [line for line in step.lines if not told(line, done.stdout)] == [], done.stdout
    for made in ("answer/report.html", "rival/plan.png", "rival/experiment.yaml"):
        assert (tmp_path / made).stat().st_size > 500
    assert (tmp_path / "proof" / "ladder.png").stat().st_size > 5000
    model = yaml.safe_load((tmp_path / "models" / "my_quad.yaml").read_text(encoding="utf-8"))
    truth = yaml.safe_load(TRUTH.read_text(encoding="utf-8"))
    (effect,) = truth["effects"]
    for name, p in effect["parameters"].items():
        low, high = model["intervals"][effect["name"]][name]
        assert low < p["value"] < high


def test_the_shipped_logs_keep_their_secret() -> None:
    """Both flights are small, and neither they nor their page say what is hidden."""
    truth = yaml.safe_load(TRUTH.read_text(encoding="utf-8"))
    names = [effect["name"] for effect in truth["effects"]]
    total = 0
    for folder in shipped_logs().values():
        files = [p for p in folder.iterdir() if p.is_file()]
        assert {p.name for p in files} == {"log.parquet", "meta.yaml", "__init__.py"}
        total += sum(p.stat().st_size for p in files)
        meta = (folder / "meta.yaml").read_text(encoding="utf-8")
        assert not [n for n in names if n in meta]
    page = (ROOT / "experiments" / "hidden_effect" / "README.md").read_text(encoding="utf-8")
    assert not [n for n in names if n in page]
    assert total < 1_200_000
