"""An arm that is bolted to the world: its joints show what its model is missing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from seals.batch import BatchDynamics
from seals.batch.response import Response
from seals.cli.main import main
from seals.motion import Inputs
from seals.run.assembly import build_model
from seals.run.build import run_settings

LINK = (
    '<link name="{0}"><inertial><origin xyz="0 0 {1}"/><mass value="{2}"/><inertia ixx="{3}" '
    'iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin '
    'xyz="0 0 {3}"/><axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="60" velocity="6"/>'
    "</joint>"
)
ARM = (
    LINK.format("base", 0, 4, 0.02)
    + LINK.format("upper", 0.2, 1.5, 0.02)
    + LINK.format("fore", 0.15, 0.8, 0.006)
    + JOINT.format("shoulder", "base", "upper", 0.05)
    + JOINT.format("elbow", "upper", "fore", 0.4)
)
YAML = """urdf: arm.urdf
fixed_base: true
arms:
  arm: {joints: [shoulder, elbow], tool: fore, stowed: [0.0, 0.0]}
actuators:
  servos:
    actuator: servos
    kp_each: [466.0, 34.0]
    kd_each: [24.7, 1.8]
    torque_limit_each: [60.0, 30.0]
"""
WAVING = (
    "controller=direct",
    "guide=hover",
    "guide.arm=random",
    "guide.delay=0.1",
    "guide.frequency=1",
)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """Folder of an arm of two joints in one plane, bolted to the world."""
    folder = tmp_path / "arm"
    folder.mkdir()
    (folder / "arm.urdf").write_text(f'<robot name="arm">{ARM}</robot>')
    (folder / "robot.yaml").write_text(YAML)
    return folder


def test_base_stands_still_under_a_push(arm: Path) -> None:
    """A push on the base changes nothing, a torque on a joint as much as the rates differ by."""
    settings = run_settings([f"robot={arm}"])
    robot, effects = build_model(settings)
    twin = BatchDynamics(robot, effects, settings.environment, settings.wave, batch=1)
    state = twin.start()._replace(
        joints=np.array([[0.3, -0.8]]), joint_velocity=np.array([[0.5, 1.0]])
    )
    none, torque = np.zeros((1, 2)), np.array([[0.7, -0.2]])
    time = np.zeros((1, 1))
    inputs = Inputs(0.0, none, None, None, state.joints)
    response = Response(twin, state, time, inputs, twin.posture(state, time))
    assert all(not change.any() for change in response.pushed())
    force = response.force(effects)._replace(links=np.zeros((1, 3, 6)), joints=torque)
    (change,) = response.changes([force])
    pushed = twin.rates(state, time, inputs._replace(joint_torque=torque))
    free = twin.rates(state, time, inputs)
    np.testing.assert_allclose(change[:, 9:], pushed.joint_velocity - free.joint_velocity)
    assert not change[:, :9].any()


@pytest.mark.thorough
def test_payload_at_the_hand_is_named(arm: Path, tmp_path: Path) -> None:
    """0.2 kg on the forearm of a waving arm, not stated, are found from the joints alone."""
    hidden = (
        "+effect@effects.load=payload",
        "effects.load.mass=0.2",
        "effects.load.position_z=0.3",
        "effects.load.links=[fore]",
        "hide=[payload]",
    )
    log, answer = tmp_path / "log", tmp_path / "answer"
    words = (*WAVING, "time.step=0.004", "time.duration=3", f"out={log}", *hidden)
    assert main(["run", f"robot={arm}", *words]) == 0
    assert main(["diagnose", f"log={log}", f"out={answer}"]) == 10
    found = json.loads((answer / "diagnosis.json").read_text())
    assert [effect["name"] for effect in found["effects"]] == ["payload"]


def test_arm_at_rest_is_refused_in_words(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing of a bolted robot moves but its joints: a log of one at rest shows nothing."""
    log = tmp_path / "log"
    words = ("time.step=0.004", "time.duration=0.2", f"out={log}")
    assert main(["run", f"robot={arm}", *words]) == 0
    assert main(["diagnose", f"log={log}", f"out={tmp_path / 'answer'}"]) == 20
    said = "".join(capsys.readouterr())
    assert "bolted to the world, and none of its joints moves" in said
    assert "controller=direct" in said


def test_import_of_an_arm_prints_a_run_that_moves_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without a controller the servos of an arm have no command, and it hangs limp."""
    file = tmp_path / "given.urdf"
    bolt = (
        '<link name="world"/><joint name="bolt" type="fixed"><parent link="world"/>'
        '<child link="base"/></joint>'
    )
    file.write_text(f'<robot name="arm">{bolt}{ARM}</robot>')
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "made", f"--urdf={file}"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    words = "controller=direct guide=hover guide.arm=sweep"
    assert last.strip() == f"seals run robot=made {words}"
    assert main(["run", "robot=made", *words.split(), "time.duration=0.1", "out=moved"]) == 0


def test_guide_moves_an_arm_without_drives(arm: Path, tmp_path: Path) -> None:
    """``direct`` passes the guide's joint targets on where no command was set."""
    from seals.run.simulation import simulate

    words = (f"robot={arm}", *WAVING, "time.step=0.004", "time.duration=2")
    log = simulate(run_settings(words)).log
    wanted, angles = (log.channel(f"joint_position{tail}") for tail in ("_cmd", ""))
    assert np.ptp(wanted, axis=0).min() > 0.2
    np.testing.assert_allclose(angles, wanted, atol=0.2)
