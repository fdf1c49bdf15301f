"""The tutorial is run as it is printed: its commands, the lines it promises, its exit codes."""

from __future__ import annotations

from pathlib import Path

import yaml

from seals.logs.shipped import shipped_logs

ROOT = Path(__file__).parents[2]
from tests.docs.follow import follow  # noqa: E402
from tests.docs.pages import steps, told  # noqa: E402

PAGE = ROOT / "docs" / "tutorial_missing_effect.md"
TRUTH = Path(__file__).parent / "hidden_effect_truth.yaml"


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
    follow(PAGE, tmp_path)
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
    for folder in (place for place in shipped_logs().values() if place.is_dir()):
        files = [p for p in folder.iterdir() if p.is_file()]
        assert {p.name for p in files} == {"log.parquet", "meta.yaml", "__init__.py"}
        total += sum(p.stat().st_size for p in files)
        meta = (folder / "meta.yaml").read_text(encoding="utf-8")
        assert not [n for n in names if n in meta]
    page = (ROOT / "experiments" / "hidden_effect" / "README.md").read_text(encoding="utf-8")
    assert not [n for n in names if n in page]
    assert total < 1_200_000
