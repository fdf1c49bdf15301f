"""Picture of a verification, the robot that is given to it, and steps that lead astray."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.logs import Log
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.problem import _astray
from seals.sysid.report.given_logs import given_logs
from seals.sysid.validation.application import acceleration_of, draw_acceleration


@pytest.mark.parametrize("root", ["add", "verify"])
def test_a_robot_may_be_given_where_the_log_describes_none(root: str, tmp_path: Path) -> None:
    """Both verbs take the model from a robot's folder, as a diagnosis does."""
    words = [f"log={tmp_path}"]
    given = given_logs(compose(["robot=auv", *words], root=root)).robot
    assert given is not None
    assert given.robot.name == "auv"
    assert given_logs(compose(words, root=root)).robot is None


def replayed(rows: Any, force: Any) -> Any:
    """A variant whose simulator felt some force."""
    reading = np.concatenate([np.zeros((*rows.shape, 3)), force[rows]], axis=2)
    return SimpleNamespace(track=SimpleNamespace(rows=rows, reading=reading))


def test_without_a_model_the_command_that_writes_one_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a folder where nothing was added yet."""
    monkeypatch.chdir(tmp_path)
    assert main(["verify", "log=hidden_effect/flight_b"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "ConfigError: model is not given.",
        "Write one from a diagnosis: seals add diagnosis=FOLDER name=NAME",
    ]


def test_the_axis_with_the_largest_residual_is_drawn_before_and_after(tmp_path: Path) -> None:
    """An impact along z that one model lacks: its residual, its level, and the file."""
    time = np.arange(200) * 0.01
    truth = np.zeros((200, 3))
    truth[:, 2] = 9.81
    stated = truth.copy()
    truth[100:110, 2] += 30.0
    columns = {f"specific_force_{a}": truth[:, k] for k, a in enumerate("xyz")}
    log = Log(name="dive", columns={"t": time, **columns})
    rows = np.arange(50, 190).reshape(2, 70)
    ends = replayed(rows, stated), replayed(rows, truth)
    ablation = SimpleNamespace(name="dive", first=ends[0], last=ends[1])
    found: Any = SimpleNamespace(
        ablation=ablation, overlay=SimpleNamespace(name="mine", parts=["slamming"])
    )
    felt = acceleration_of(found, log)
    assert felt is not None
    assert felt.axis == "z"
    assert felt.levels == pytest.approx((30.0 * np.sqrt(10 / 140), 0.0))
    draw_acceleration(tmp_path / "felt.png", felt, found)
    assert (tmp_path / "felt.png").stat().st_size > 5000


def test_a_window_that_a_step_leads_away_from_the_measured_pose_stays() -> None:
    """Ten standard deviations off is astray, the noise of the pose is not, nor is a way back."""
    rows, rng = np.arange(40).reshape(2, 20), np.random.default_rng(0)
    noise = rng.normal(size=(40, 3)) * 1e-3
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (40, 1))
    plant: Any = SimpleNamespace(
        samples=SimpleNamespace(channels={"position": noise, "orientation": turn}, step=0.01),
        candidate_set=SimpleNamespace(policy=DecisionPolicy()),
        vehicle=SimpleNamespace(sigma={"position": 1e-3, "orientation": 1e-3}),
        pose_turn=lambda values, rows: None,
    )

    def at(shift: float, count: int = 20) -> Trajectory:
        position = np.zeros((40, 3))
        position[20 : 20 + count] += shift
        still, none = np.zeros((40, 3)), np.zeros((40, 0))
        return Trajectory(
            position=position,
            quaternion=turn,
            velocity=still,
            angular_velocity=still,
            joints=none,
            joint_velocity=none,
        )

    assert _astray(plant, {}, at(0.0), at(0.01), rows).tolist() == [False, True]
    # a short stretch counts as a long one does
    assert _astray(plant, {}, at(0.0), at(0.01, 4), rows).tolist() == [False, True]
    assert _astray(plant, {}, at(0.0), at(1e-3), rows).tolist() == [False, False]
    assert _astray(plant, {}, at(0.02), at(0.01), rows).tolist() == [False, False]
