"""The check of a robot looks at the poses of its arms and grippers."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import seals.robots.aam
from seals.cli.main import main

AAM = Path(seals.robots.aam.__file__).parent


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("stowed: [1.55, 0.0, 0.0]", "stowed: [9.55, 0.0, 0.0]", "arm.stowed: shoulder 9.55"),
        ("closed: [0.26,", "closed: [4.26,", "gripper.closed: finger_1 4.26"),
        ("[shoulder, elbow, wrist]", "[wrist, elbow, shoulder]", "not in order from the base: arm"),
        ("summary: ", "summary: Much like ", "3 within the joint limits"),
    ],
)
def test_wrong_poses_are_remarked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], right: str, wrong: str, said: str
) -> None:
    """Poses beyond a limit and arms named from the tool on are said; the shipped robot passes."""
    folder = tmp_path / "aam"
    shutil.copytree(AAM, folder)
    text = (folder / "robot.yaml").read_text(encoding="utf-8")
    assert right in text
    (folder / "robot.yaml").write_text(text.replace(right, wrong, 1), encoding="utf-8")
    assert main(["check", f"robot={folder}"]) == 0
    assert said in " ".join(capsys.readouterr().out.split())
