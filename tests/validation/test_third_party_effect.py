"""Effects of a stranger's package, hidden by the independent generator, are named and measured."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.logs.native import read_native
from seals.sysid.diagnosis import diagnose

ROOT = Path(__file__).parents[2]
from tests.validation.hidden import equivalents, generate, references, writing  # noqa: E402
from tests.validation.hidden.batch import Flight  # noqa: E402
from tests.validation.hidden.cases import SECONDS, Spec, build  # noqa: E402

SEED = 41


def hidden(folder: Path, kind: str, name: str, pattern: str = "sines") -> dict[str, np.ndarray]:
    """Write two flights of one vehicle with the effect, ``first`` and ``second``; return its plant.

    Raises:
        AssertionError: the effect does not show in the logs.
    """
    case = build(Spec(kind, "out_of_library", pattern, [name], (SEED,)))
    fresh = np.random.default_rng(SEED + 1)
    other = replace(
        case, wanted=references.draw(kind, pattern, fresh, SECONDS[kind]), rng=fresh, found={}
    )
    flight = Flight([case, other], SEED)
    equivalents.settle(flight)
    flight.excess()
    readings = flight.readings()
    for i, part in enumerate(("first", "second")):
        shows, _ = generate.judge(flight.cases[i])
        assert shows
        writing.write(folder / part, flight, i, readings)
    return case.with_it


CASES = [
    ("auv", "sines", "sway_by_yaw", "sway_by_yaw", "derivative"),
    pytest.param(*("aam", "wading", "paddling_arm", "paddle", "stroke"), marks=pytest.mark.slow),
]
"""Vehicle, pattern, effect, its number in the generator and in the package."""


@pytest.mark.thorough
@pytest.mark.usefixtures("coral")
@pytest.mark.parametrize(("kind", "pattern", "name", "number", "parameter"), CASES)
def test_a_strangers_force_is_named_added_and_verified(
    tmp_path: Path, kind: str, pattern: str, name: str, number: str, parameter: str
) -> None:
    """A force whose law this package does not have goes the whole way from a log to a model.

    One follows the turning of a hull, the other the joint velocities of an arm and the immersion.
    """
    truth = float(hidden(tmp_path, kind, name, pattern)[number])
    answer, model = tmp_path / "answer", tmp_path / "models"
    assert main(["diagnose", f"log={tmp_path / 'first'}", f"out={answer}"]) == 10
    found = json.loads((answer / "diagnosis.json").read_text(encoding="utf-8"))
    assert [e["name"] for e in found["effects"]] == [name]
    fitted = found["effects"][0]["parameters"][parameter]
    assert fitted["value"] == pytest.approx(truth, rel=0.1)
    assert fitted["unit"] == "N s/rad"
    assert main(["add", f"diagnosis={answer}", "name=stranger", f"folder={model}"]) == 0
    words = [f"log={tmp_path / 'second'}", f"model={model / 'stranger.yaml'}"]
    proof = tmp_path / "proof"
    assert main(["verify", *words, f"out={proof}"]) == 0
    assert (proof / "verify.json").is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("coral")
def test_a_strangers_sensor_fault_is_named(tmp_path: Path) -> None:
    """A fault of the gyroscope that this package does not have is told from its own faults."""
    truth = hidden(tmp_path, "quad", "gyroscope_scale")["gyro_scale"]
    found = diagnose(read_native(tmp_path / "first")).to_dict()
    assert [e["name"] for e in found["effects"]] == ["gyroscope_scale"]
    fitted = found["effects"][0]["parameters"]
    for axis, value in zip("xyz", truth, strict=True):
        assert fitted[f"scale_{axis}"]["value"] == pytest.approx(value, rel=0.1)


@pytest.mark.parametrize("name", ["sway_by_yaw", "paddling_arm", "gyroscope_scale"])
def test_nobody_else_knows_the_strangers_names(name: str) -> None:
    """No source of this repository but the stranger's holds the names of its effects."""
    folders = ("seals", "plugins", "robots", "animals", "experiments", "conf")
    sources = [p for f in folders for p in (ROOT / f).rglob("*") if p.suffix in (".py", ".yaml")]
    assert len(sources) > 500
    assert [p for p in sources if name in p.read_text(encoding="utf-8")] == []
