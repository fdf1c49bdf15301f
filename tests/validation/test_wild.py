"""Own robots, several logs, effects that begin and end: cases of an independent simulator."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from seals import load_log
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.diagnosis import diagnose

CASES = Path(__file__).resolve().parents[3] / "shared" / "hidden_effects" / "wild" / "dev"
ALL = [f"v{k:03d}" for k in (1, 2, 4, 5, 7, 9, 11, 12, 13, 14, 15, 16, 17, 18)]

pytestmark = pytest.mark.validation


@pytest.mark.parametrize("name", ["v010", *(pytest.param(n, marks=pytest.mark.slow) for n in ALL)])
def test_an_own_robot_gets_the_right_answer(name: str) -> None:
    """Exactly what is hidden is named, with its times; else nothing, in the words of its case."""
    case = CASES / name
    if not case.is_dir():
        pytest.skip(f"the cases are not there: {CASES}")
    truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
    logs = [load_log(folder) for folder in sorted((case / "logs").iterdir())]
    found = diagnose(logs, robot=describe_robot(str(case / "robot")), processes=2).to_dict()
    assert found["verdict"] in truth["expected"]
    if found["verdict"] != "named":
        return
    assert {e["name"] for e in found["effects"]} == {e["name"] for e in truth["effects"]}
    for effect in truth["effects"]:
        (answer,) = (e for e in found["effects"] if e["name"] == effect["name"])
        spans = {span["log"]: span for span in answer.get("active", ())}
        for log, times in effect["active"].items():
            for which, moment in zip(("start", "end"), times, strict=True):
                if moment is not None and log != "h":
                    assert spans[log][which]["value"] == pytest.approx(moment, abs=0.3)
