"""The largest force of a thruster follows from its law, as makers publish it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from seals.errors import RobotError
from seals.scaffold.robot import scaffold_robot

CLAMPED = Path(__file__).parent / "urdfs/entries/clamped.urdf"
BASIC = "<conversion><type>Basic</type><rotorConstant>0.001</rotorConstant></conversion>"
TABLE = (
    "<conversion><type>LinearInterp</type><inputValues>-1 -0.5 0 0.5 1</inputValues>"
    "<outputValues>-40 -12 0 15 51.5</outputValues></conversion>"
)
BESSA = (
    "<conversion><type>Bessa</type><rotorConstantL>0.002</rotorConstantL><rotorConstantR>0.003"
    "</rotorConstantR><deltaL>-1000</deltaL><deltaR>2000</deltaR></conversion>"
)


def reached(folder: Path, clamp: str, law: str) -> Any:
    """Largest force of the thruster that an import writes [N]."""
    text = CLAMPED.read_text().replace("<clampMax>200</clampMax>", clamp).replace(BASIC, law)
    file = folder / "given.urdf"
    file.write_text(text)
    made = scaffold_robot("thruster", file, parent=folder, medium="water")
    lines = (made.folder / "robot.yaml").read_text().splitlines()
    (line,) = [line for line in lines if line.strip().startswith("max_force:")]
    return float(line.partition("[")[2].rstrip("]"))


@pytest.mark.parametrize(
    ("clamp", "law", "force"),
    [
        ("<clampMax>200</clampMax>", BASIC, 0.001 * 200**2),
        ("", TABLE, 51.5),
        # straight between the rows, at a command that the file allows
        ("<clampMin>-0.75</clampMin><clampMax>0.75</clampMax>", TABLE, 0.5 * (15.0 + 51.5)),
        ("<clampMin>-100</clampMin><clampMax>100</clampMax>", BESSA, 0.003 * (100**2 - 2000.0)),
    ],
    ids=["square", "table", "table, clamped", "dead band"],
)
def test_force_by_law(tmp_path: Path, clamp: str, law: str, force: float) -> None:
    """Squared speed, a table over commands, a square with a dead band."""
    assert reached(tmp_path, clamp, law) == pytest.approx(force, rel=1e-6)


def test_table_of_two_lengths_is_refused(tmp_path: Path) -> None:
    """Two lines say how many numbers either list has."""
    law = TABLE.replace(" 51.5", "")
    with pytest.raises(RobotError, match="inputValues has 5 numbers, outputValues 4"):
        reached(tmp_path, "", law)
