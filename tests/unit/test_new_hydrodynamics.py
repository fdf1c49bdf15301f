"""``seals new hydrodynamics``: what it writes, replaces and refuses."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.cli.main import main
from seals.scaffold.robot import scaffold_robot

BUOY = """<robot name="buoy"><link name="body"><inertial><mass value="3.0"/>
<origin xyz="0 0 -0.02"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>
</inertial><collision><geometry><cylinder radius="0.15" length="0.1"/></geometry></collision>
</link></robot>"""


@pytest.fixture
def buoy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a robot that floats, made from a URDF."""
    monkeypatch.chdir(tmp_path)
    Path("buoy.urdf").write_text(BUOY, encoding="utf-8")
    return scaffold_robot("buoy", Path("buoy.urdf"), parent=tmp_path).folder


def effects_of(folder: Path) -> dict[str, Any]:
    """Return the effects of a robot folder."""
    return yaml.safe_load((folder / "robot.yaml").read_text("utf-8"))["effects"]


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """Return the message of a refusal, of two lines."""
    assert main(["new", "hydrodynamics", *words]) == 2
    message = capsys.readouterr().err.strip()
    assert len(message.splitlines()) == 2
    return message


def test_ellipsoid(buoy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ellipsoid's matrix takes the place of the estimate; comments and the rest stay."""
    before = (buoy / "robot.yaml").read_text("utf-8")
    assert main(["new", "hydrodynamics", "robot=buoy", "method=ellipsoid", "replace=true"]) == 0
    assert "ellipsoid of semi-axes" in capsys.readouterr().out
    text = (buoy / "robot.yaml").read_text("utf-8")
    assert "# ellipsoid of semi-axes" in text
    kept = [line for line in before.splitlines() if "added_mass:" not in line]
    assert [line for line in text.splitlines() if "added_mass:" not in line] == kept
    mass = effects_of(buoy)["hull_added_mass"]
    # a flat body carries more when it moves across its plane
    assert mass["mass_z"] > 3.0 * mass["mass_x"] > 0.0


@pytest.mark.parametrize(
    "effects",
    [
        "",
        "effects:\n",
        "effects: {}\n",
        "effects:\n  old: {effect: added_mass, mass_x: 1.0}\n",
        "effects:\n  old:\n    effect: added_mass\n    mass_x: 1.0\n\n  # next\n"
        "  down: {effect: gravity}\n",
    ],
)
def test_any_layout(buoy: Path, effects: str) -> None:
    """Effects that are absent, empty, of one entry or of blocks: the file stays readable."""
    path = buoy / "robot.yaml"
    path.write_text(f"urdf: buoy.urdf\n{effects}# the end\n", encoding="utf-8")
    hull = "hulls: {body: {shapes: [{type: cylinder, size: [0.15, 0.1]}]}}\n"
    path.write_text(hull + path.read_text("utf-8"), encoding="utf-8")
    assert main(["new", "hydrodynamics", "robot=buoy", "method=ellipsoid", "replace=true"]) == 0
    found = effects_of(buoy)
    name = "old" if "old" in effects else "body_added_mass"
    assert found.pop(name)["mass_z"] > 1.0
    assert set(found) == ({"down"} if "down" in effects else set())
    assert ("# next" in effects) == ("# next" in path.read_text("utf-8"))


@pytest.mark.thorough
def test_boundary_elements(buoy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A floating base gets its limit matrix and a memory, and the robot runs with both."""
    pytest.importorskip("capytaine", reason="boundary elements need the extra hydro")
    words = ["robot=buoy", "method=bem", "panels=100", "replace=true"]
    assert main(["new", "hydrodynamics", *words]) == 0
    assert "resonators, misfit" in capsys.readouterr().out
    effects = effects_of(buoy)
    memory, mass = effects["body_radiation_memory"], effects["hull_added_mass"]
    assert (
        memory["floating_fraction"] == mass["floating_fraction"] == pytest.approx(0.425, abs=1e-3)
    )
    assert np.linalg.eigvalsh(np.array(memory["damping"]))[0] > 0.0
    assert main(["check", "robot=buoy"]) == 0
    # by an ellipsoid: no memory is left without its limit matrix
    words = ["robot=buoy", "method=ellipsoid", "replace=true"]
    assert main(["new", "hydrodynamics", *words]) == 0
    assert set(effects_of(buoy)) == set(effects) - {"body_radiation_memory"}
    assert "floating" not in effects_of(buoy)["hull_added_mass"]


def test_refusals(buoy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Wrong words are refused in two lines before anything is computed."""
    assert "states added_mass" in refused(capsys, "robot=buoy")
    assert "'ellipsoid'" in refused(capsys, "robot=buoy", "method=elipsoid")
    assert "Did you mean 'body'" in refused(capsys, "robot=buoy", "link=bod", "method=ellipsoid")
    assert "60 to 4000" in refused(capsys, "robot=buoy", "panels=3")
    assert "not one of your robot folders" in refused(capsys, "robot=nowhere")
    assert "Did you mean 'buoy'" in refused(capsys, "robot=buoi")
    assert "Did you mean 'method'" in refused(capsys, "robot=buoy", "methd=bem")
    assert "needs a robot folder" in refused(capsys, "method=bem")


def test_a_needle_has_no_panels(buoy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A hull so long and thin that the corners of its faces fall together is refused."""
    pytest.importorskip("capytaine", reason="needs aam-seals[hydro]")
    file = buoy / "robot.yaml"
    data = yaml.safe_load(file.read_text("utf-8"))
    data["hulls"]["body"]["shapes"] = [{"type": "box", "size": [1e4, 1e-6, 1e-6]}]
    file.write_text(yaml.safe_dump(data), encoding="utf-8")
    assert "too thin for panels" in refused(capsys, "robot=buoy", "replace=true")


def test_without_the_extra(
    buoy: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Boundary elements without capytaine are refused with the extra's name."""
    monkeypatch.setitem(sys.modules, "capytaine", None)
    message = refused(capsys, "robot=buoy", "method=bem", "replace=true")
    assert "aam-seals[hydro]" in message


def test_constant_damping_is_not_doubled(buoy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A constant radiation damping of the link must go first."""
    path = buoy / "robot.yaml"
    text = path.read_text("utf-8").replace(
        "effects:\n", "effects:\n  waves: {effect: radiation_damping, coefficient_z: 3.0}\n"
    )
    path.write_text(text, encoding="utf-8")
    assert "constant radiation damping" in refused(capsys, "robot=buoy", "replace=true")
