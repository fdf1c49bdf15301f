"""A found effect is added, verified on a flight that no fit saw, and withdrawn when it is wrong."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.cli.main import main
from seals.config.overlay import load_overlay, read_overlay
from seals.logs.native import read_native
from seals.sysid.predictors.linearise import predict
from seals.sysid.predictors.problem import Problem, prepare
from seals.sysid.predictors.windows import window_rows
from seals.sysid.validation.ablation import model_variants
from seals.sysid.validation.misfit import Misfit, Yardstick, measure, yardstick
from seals.sysid.validation.model import Model, nominal
from tests.validation.hidden import (
    batch,
    cases,
    equivalents,
    references,
    writing,
)

SECONDS = 4.0
SEED = 3


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three flights of one quadrotor: two in the same hidden wind, one in none."""
    folder = tmp_path_factory.mktemp("flights")
    spec = cases.Spec("quad", "clear", "sines", ["wind"], (SEED, 0))
    kept = cases.SECONDS["quad"]
    cases.SECONDS["quad"] = SECONDS
    try:
        made = [cases.build(spec), cases.build(spec), cases.build(replace(spec, effects=[]))]
        for k, case in enumerate(made[1:], start=1):
            rng = np.random.default_rng(100 + k)
            case.wanted = references.draw("quad", "sines", rng, SECONDS)
        flight = batch.Flight(made, SEED)
        equivalents.settle(flight)
        readings = flight.readings()
        for name, k in (("windy", 0), ("windy_too", 1), ("calm", 2)):
            writing.write(folder / name, flight, k, readings)
    finally:
        cases.SECONDS["quad"] = kept
    words = [f"log={folder / 'windy'}", f"out={folder / 'answer'}", "report=false", "plan=false"]
    assert main(["diagnose", *words]) == 10
    (folder / "answer" / "diagnosis.json").rename(folder / "diagnosis.json")
    return folder


@pytest.fixture(scope="module")
def model(flights: Path) -> Path:
    """The model that the diagnosis becomes."""
    words = [f"diagnosis={flights}", "name=windy_model", f"folder={flights / 'models'}"]
    assert main(["add", *words]) == 0
    return flights / "models" / "windy_model.yaml"


@pytest.fixture
def own(model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the model that a test may spoil, in a working directory of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").mkdir()
    return Path(shutil.copy(model, tmp_path / "models" / "mine.yaml"))


def verified(tmp_path: Path, *words: str) -> tuple[int, dict[str, object]]:
    """Exit code and result of one verification."""
    code = main(["verify", "model=mine", f"out={tmp_path / 'out'}", *words])
    return code, json.loads((tmp_path / "out" / "verify.json").read_text(encoding="utf-8"))


@pytest.mark.thorough
def test_the_model_says_what_was_found_and_where_it_comes_from(flights: Path, model: Path) -> None:
    """Values lie near the truth; intervals, nominal values and provenance are there."""
    truth = yaml.safe_load((flights / "windy" / "truth.yaml").read_text(encoding="utf-8"))
    found = yaml.safe_load(model.read_text(encoding="utf-8"))
    for name, p in truth["effects"][0]["parameters"].items():
        low, high = found["intervals"]["wind"][name]
        assert found["effects"]["wind"][name] == pytest.approx(p["value"], abs=0.75 * (high - low))
        low, high = found["intervals"]["wind"][name]
        assert low < p["value"] < high
    assert found["nominal"]["mass.mass"]["sd"] > 0.0
    origin = found["provenance"]
    assert origin["confidence"]["wind"] > 0.9
    assert len(origin["log_sha256"]) == len(origin["diagnosis_sha256"]) == 64
    assert origin["vehicle"] == "quad"


@pytest.mark.thorough
def test_the_error_falls_to_the_floor_on_an_unseen_flight(
    flights: Path, own: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the real simulator, on a flight that no fit saw, the error falls to the noise floor."""
    log = f"log={flights / 'windy_too'}"
    code, found = verified(tmp_path, log, f"older=[{flights / 'windy'}]")
    assert code == 0
    assert found["verdict"] == "confirmed"
    levels = [variant["misfit"] for variant in found["rungs"]]  # type: ignore[attr-defined,index]
    assert levels[0] > levels[1] > 2.0
    assert levels[2] == pytest.approx(1.0, abs=0.1)
    plain = [variant["rms"]["position"]["1"] for variant in found["rungs"]]  # type: ignore[attr-defined]
    floor = found["noise_floor"]["rms"]["position"]["1"]  # type: ignore[index]
    assert plain[0] > 10.0 * floor
    assert 0.4 * floor < plain[2] < 2.5 * floor
    assert (tmp_path / "out" / "ladder.png").stat().st_size > 5000
    said = capsys.readouterr().out
    assert "never fitted" in said
    assert "Older log windy: better" in said
    assert "withdrawn" not in own.read_text(encoding="utf-8")


@pytest.mark.thorough
def test_the_log_of_the_fit_confirms_nothing(
    flights: Path, own: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Verifying on the very log of the fit says so."""
    code, found = verified(tmp_path, f"log={flights / 'windy'}")
    assert (code, found["verdict"], found["used_in_fit"]) == (0, "used_in_fit", True)
    assert "used in the fit" in capsys.readouterr().out


@pytest.mark.thorough
def test_a_wrong_effect_is_withdrawn(
    flights: Path, own: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Wind from the wrong side raises the error: exit code 14, and the model is refused later."""
    raw = yaml.safe_load(own.read_text(encoding="utf-8"))
    wind = raw["effects"]["wind"]
    for name in ("velocity_x", "velocity_y"):
        wind[name] = -wind[name]
    own.write_text("# mine\n" + yaml.safe_dump(raw), encoding="utf-8")
    log = f"log={flights / 'windy_too'}"
    code, found = verified(tmp_path, log)
    assert (code, found["verdict"]) == (14, "withdrawn")
    assert "Withdrawn: on windy_too the error" in capsys.readouterr().out
    text = own.read_text(encoding="utf-8")
    assert text.startswith("# mine")
    assert text.count("\nwithdrawn:") == 1
    assert main(["verify", "model=mine", log]) == 2
    assert main(["run", "robot=ball", "+model=mine", "time.duration=0.01"]) == 2
    assert "force=true" in capsys.readouterr().err
    assert main(["run", "robot=ball", "+model=mine", "time.duration=0.01", "force=true"]) == 0


@pytest.mark.thorough
def test_an_older_log_must_not_get_worse(flights: Path, own: Path, tmp_path: Path) -> None:
    """A wind that did not blow in an older flight is a regression there."""
    words = (f"log={flights / 'windy_too'}", f"older=[{flights / 'calm'}]")
    code, found = verified(tmp_path, *words)
    assert code == 14
    assert found["older"][0]["regression"] is True  # type: ignore[index]
    assert "calm" in str(found["reason"])


@pytest.mark.thorough
def test_a_choice_and_a_base_are_written_down(
    flights: Path, own: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One of an ambiguous set on the user's own judgement, on top of a model that stays."""
    answer = json.loads((flights / "diagnosis.json").read_text(encoding="utf-8"))
    (tmp_path / "diagnosis.json").write_text(json.dumps({**answer, "verdict": "ambiguous"}))
    base = "effects:\n  tail: {effect: linear_drag, medium: air, coefficient_x: 0.1}\n"
    (tmp_path / "models" / "base.yaml").write_text(base, encoding="utf-8")
    words = ["add", "diagnosis=.", "choose=wind"]
    assert main([*words, "base=base", "name=both"]) == 0
    both = yaml.safe_load((tmp_path / "models" / "both.yaml").read_text(encoding="utf-8"))
    assert list(both["effects"]) == ["tail", "wind"]
    assert both["provenance"]["chosen"].startswith("wind, chosen by the user")
    assert both["provenance"]["base"]["name"] == "base"
    assert main([*words, "base=mine", "name=twice"]) == 2
    assert "would act twice" in capsys.readouterr().err


@pytest.mark.thorough
def test_an_accepted_formula_acts_in_the_simulator(
    flights: Path, own: Path, tmp_path: Path
) -> None:
    """What the air drag makes of a steady wind is nearly a constant force: it takes the error."""
    meta = yaml.safe_load((flights / "windy" / "meta.yaml").read_text(encoding="utf-8"))
    truth = yaml.safe_load((flights / "windy" / "truth.yaml").read_text(encoding="utf-8"))
    drag = next(e for e in meta["baseline"] if e["name"] == "linear_drag")
    share = float(drag["parameters"]["coefficient_x"])
    wind = truth["effects"][0]["parameters"]
    law = {f"hold_{a}": share * wind[f"velocity_{a}"]["value"] for a in "xyz"}
    formula = {"text": "F = c", "effect": {"name": "formula", "medium": "air", "parameters": law}}
    answer = json.loads((flights / "diagnosis.json").read_text(encoding="utf-8"))
    answer |= {"verdict": "none_of_these", "effects": [], "formula": formula}
    stated = {"effect": "formula", "medium": "air", **law}
    answer["models"] = {"formula": {**answer["models"]["wind"], "effects": {"formula": stated}}}
    answer["models"]["formula"].pop("intervals")
    (tmp_path / "diagnosis.json").write_text(json.dumps(answer), encoding="utf-8")
    assert main(["add", "diagnosis=.", "name=held", "accept=formula"]) == 0
    held = yaml.safe_load((tmp_path / "models" / "held.yaml").read_text(encoding="utf-8"))
    assert held["effects"]["formula"]["hold_x"] == pytest.approx(law["hold_x"], rel=1e-5)
    assert "by the user" in held["provenance"]["accepted"]
    code = main(["verify", f"log={flights / 'windy_too'}", "model=held", f"out={tmp_path}"])
    found = json.loads((tmp_path / "verify.json").read_text(encoding="utf-8"))
    assert code == 0
    assert found["error"]["after"] < 1.0 + 0.3 * (found["error"]["before"] - 1.0)


@pytest.fixture(scope="module")
def problem(flights: Path) -> Problem:
    """The first flight made ready."""
    return prepare(read_native(flights / "windy"))


def in_the_twin(model: Model, ruler: Yardstick) -> float:
    """Misfit per degree of freedom by the twin's one-step predictions in the same windows."""
    windows, problem = ruler.windows(model), ruler.problem
    plant, timing = model.tangent(ruler.samples, parts=problem.plant.parts)
    prediction = predict(plant, problem.fitter.trajectory, timing)
    whitened = windows.whiten(windows.residual(prediction)[:, :, None])
    return float(whitened.product(whitened).sum()) / windows.observed


def by_both(problem: Problem, model: Model, seconds: float) -> tuple[float, float]:
    """Misfit of a model in windows of some length, by the simulator and by the twin."""
    whole = yardstick(problem, [model])
    rows = window_rows(problem.samples, seconds, whole.skip)
    ruler = replace(whole, rows=rows, length=seconds)
    found: Misfit = measure(model, ruler)
    return found.level, in_the_twin(model, ruler)


@pytest.mark.thorough
def test_the_simulator_leaves_what_the_twin_leaves(problem: Problem, model: Path) -> None:
    """Whole model, windows of a second: the misfits agree within one per cent."""
    whole = model_variants(problem, read_overlay(load_overlay(model)))[-1]
    # sensors' errors belong to the readings, which the twin makes elsewhere
    mute = {n: e for n, e in whole.vehicle.effects.items() if not hasattr(e, "measure")}
    bare = replace(whole, vehicle=replace(whole.vehicle, effects=mute))
    simulated, twin = by_both(problem, bare, 1.0)
    assert simulated == pytest.approx(twin, rel=0.01)


@pytest.mark.thorough
def test_the_nominal_model_too_while_its_errors_are_small(problem: Problem) -> None:
    """Stated model, windows of a fifth of a second: within three per cent, far off the floor."""
    simulated, twin = by_both(problem, nominal(problem.vehicle), 0.2)
    assert simulated > 1.5
    assert simulated == pytest.approx(twin, rel=0.03)


@pytest.mark.thorough
def test_an_error_in_the_simulator_would_be_seen(problem: Problem) -> None:
    """Three per cent of thrust more, in the simulator alone, moves the misfit."""
    model = nominal(problem.vehicle)
    more = model.changed(
        "more", {"thrust_coefficient.relative_change": 0.03}, problem.plant.candidate_set
    )
    simulated, twin = by_both(problem, more, 0.2)[0], by_both(problem, model, 0.2)[1]
    assert abs(simulated / twin - 1.0) > 0.05
