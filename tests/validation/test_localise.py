"""Where and how a missing force acts, on logs from the independent generator."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from seals.logs.native import read_native
from seals.plugins.effects.formula import EffectFormula
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.residual_force import Localisation, locate_residual_force
from seals.sysid.selection.log_search import search_log
from tests.validation.hidden import generate


def flown(folder: Path, level: str, vehicle: str, effect: str, seed: int) -> Problem:
    """Make one log and prepare it."""
    words = ["--level", level, "--vehicle", vehicle, "--seed", str(seed), "--no-gain"]
    words += ["--effect", effect] if effect else []
    assert generate.main([str(folder), "--count", "1", *words]) in (None, 0)
    case = next(p for p in sorted(folder.iterdir()) if p.is_dir())
    return prepare(read_native(case))


def misfit_with(problem: Problem, found: Localisation) -> tuple[float, float]:
    """Misfit of the twin per number observed, without and with the formula as an effect."""
    assert found.formula is not None
    effect = EffectFormula(correction=True)
    problem.plant.candidate_set.effects["unnamed"] = effect  # type: ignore[index]
    change = {f"unnamed.{k}": v - getattr(effect, k) for k, v in found.formula.parameters().items()}
    fitter = problem.fitter
    tolerances = dict(fitter.fit(()).values)
    out = []
    for values in (tolerances, {**tolerances, **change}):
        whitened = fitter.misfit(values)
        out.append(float(whitened.product(whitened).sum()) / fitter.windows.observed)
    return out[0], out[1]


@pytest.mark.thorough
def test_nothing_is_made_of_a_sound_model(tmp_path: Path) -> None:
    """A log within its tolerances shows no force, no sentence but that, and no formula."""
    problem = flown(tmp_path, "null", "quad", "", 5)
    found = locate_residual_force(problem)
    assert not found.residual.missing
    assert found.formula is None
    assert len(found.signature.sentences) == 1
    pulls = found.residual.force / found.residual.force_sd
    assert np.sqrt(np.mean(pulls**2)) < 1.5


@pytest.mark.slow
def test_wind_is_a_constant_of_the_world_until_it_is_named(tmp_path: Path) -> None:
    """Wind is constant in the world rather than in the body; once named, nothing is left over."""
    problem = flown(tmp_path, "clear", "quad", "wind", 11)
    found = locate_residual_force(problem)
    assert found.signature.frame == "world"
    share = {d.frame: d.whole.share for d in found.dependences if d.variable == "constant"}
    assert share["world"] > max(0.8, share["body"])
    assert found.residual.ceiling > 0.9
    left = locate_residual_force(problem, search_log(problem).best)
    assert not left.residual.missing


@pytest.mark.slow
def test_a_cubic_drag_is_read_off(tmp_path: Path) -> None:
    """A drag outside the library: exponent, sign and the formula that takes the misfit away."""
    problem = flown(tmp_path, "out_of_library", "quad", "cubic_drag", 7)
    found = locate_residual_force(problem)
    speed = next(e for e in found.exponents if e.law == "speed")
    assert speed.value == pytest.approx(3.0, abs=max(3.0 * speed.sd, 0.2))
    assert min(speed.coefficients) > 0.0
    assert any(s.startswith("Opposes the motion") for s in found.signature.sentences)
    assert found.formula is not None
    assert [t.kind for t in found.formula.terms] == ["drag"]
    assert found.formula.share > 0.8


@pytest.mark.slow
def test_a_region_becomes_a_formula_that_repairs_the_model(tmp_path: Path) -> None:
    """A force beyond a plane is found with its border; as an effect it takes the misfit away."""
    problem = flown(tmp_path, "out_of_library", "quad", "force_region", 7)
    found = locate_residual_force(problem)
    assert found.formula is not None
    assert found.formula.terms[0].kind == "beyond"
    assert found.formula.terms[0].settings["normal"][0] == pytest.approx(1.0)
    assert -0.2 < found.formula.terms[0].settings["edge"] < 0.25
    before, after = misfit_with(problem, found)
    assert before > 1.08
    assert after < 1.02


@pytest.mark.thorough
def test_a_magnet_becomes_a_pull_with_its_place_and_power(tmp_path: Path) -> None:
    """A force that fades with the square of the distance gives place and power, and repairs."""
    problem = flown(tmp_path, "out_of_library", "quad", "magnet", 7)
    found = locate_residual_force(problem)
    assert found.pull is not None
    assert found.pull.share > 0.9
    assert found.pull.power == pytest.approx(2.0, abs=max(3.0 * found.pull.power_sd, 0.4))
    assert np.abs(found.pull.place[:2]).max() < 0.75
    before, after = misfit_with(problem, found)
    assert before > 1.1
    assert after < 1.02


@pytest.mark.slow
def test_a_periodic_torque_gives_its_line(tmp_path: Path) -> None:
    """A torque that swings is found at its frequency, between 8 and 25 rad/s."""
    problem = flown(tmp_path, "out_of_library", "quad", "periodic_torque", 7)
    found = locate_residual_force(problem)
    assert found.spectrum.sure
    assert found.spectrum.axis.startswith("torque")
    assert 8.0 < 2.0 * np.pi * found.spectrum.peak < 25.0
    assert found.formula is not None
    assert found.formula.terms[0].kind == "shake"
    before, after = misfit_with(problem, found)
    assert after < 0.5 * before


@pytest.mark.slow
def test_a_sensor_fault_is_no_force(tmp_path: Path) -> None:
    """A biased accelerometer: no force could explain the misfit, and the words say so."""
    problem = flown(tmp_path, "clear", "quad", "accelerometer_bias", 3)
    found = locate_residual_force(problem)
    assert found.residual.ceiling < 0.5
    assert "sensors disagree" in str(found.signature)
    assert found.formula is None


@pytest.mark.slow
def test_an_underwater_drag_is_found_under_water(tmp_path: Path) -> None:
    """A vehicle that crosses the surface: the force acts under water only, against the motion."""
    problem = flown(tmp_path, "clear", "crossing", "quadratic_drag", 4)
    found = locate_residual_force(problem)
    assert "water" in found.signature.media
    assert "air" not in found.signature.media
    table = {r.name: r for r in found.regimes}
    assert table["water"].force_ratio > table["air"].force_ratio
    assert found.seconds < 8.0
    text = json.dumps(found.to_dict(), allow_nan=False)
    assert len(json.loads(text)["residual"]["time"]) <= 400
