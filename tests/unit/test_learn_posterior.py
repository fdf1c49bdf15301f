"""Environments drawn from what a diagnosis found, and from tolerances where it says nothing."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.errors import ConfigError
from seals.learn.environments.build import build_learning
from seals.learn.environments.posterior import drawn_parameters, posterior_of

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

WIND = "+effect@effects.breeze=wind"


def number(value: float, sd: float) -> dict[str, Any]:
    """A parameter as an answer tells it."""
    half = 1.6449 * sd
    return {"value": value, "low90": value - half, "high90": value + half, "unit": "1"}


def answer(folder: Path, *effects: dict[str, Any], **more: Any) -> Path:
    """Write a diagnosis into a folder and return the folder."""
    folder.mkdir(exist_ok=True)
    content = {"verdict": "named", "effects": list(effects), "nominal": {}, "reasons": [], **more}
    (folder / "diagnosis.json").write_text(json.dumps(content))
    return folder


def wind() -> dict[str, Any]:
    """A wind that was found."""
    told = {"velocity_x": number(2.0, 0.3), "velocity_y": number(-1.0, 0.1)}
    return {"name": "wind", "confidence": 0.99, "parameters": told}


def water_drag() -> dict[str, Any]:
    """Drag in water that is larger than the model of the log says."""
    told = {"coefficient_x": number(4.0, 0.5)}
    return {"name": "quadratic_drag", "medium": "water", "confidence": 0.9, "parameters": told}


def effects_of(*words: str) -> Any:
    """Effects of an environment by name."""
    return build_learning(compose(["env=hover", *words], root="train"))[0].effects


def test_draws_have_the_means_and_spreads_of_the_posterior(tmp_path: Path) -> None:
    """What was found is as sure as it was found; all else is as wide as its tolerance."""
    folder = answer(
        tmp_path / "a",
        wind(),
        water_drag(),
        nominal={
            "quadratic_drag_air_change.coefficient_z": {"value": 0.002, "sd": 0.0004},
            "gyroscope_bias.bias_x": {"value": 0.1, "sd": 0.1},
        },
    )
    effects = effects_of(WIND)
    known = posterior_of(folder, effects)
    assert set(known.estimates) == {
        "breeze.velocity_x",
        "breeze.velocity_y",
        "water_drag.coefficient_x",
        "air_drag.coefficient_z",
    }
    rng = np.random.default_rng(3)
    found = drawn_parameters(effects, 20_000, share=0.5, rng=rng, known=known)
    # changes are added to what is configured: wind of 0, drag of 13 and 0.038
    for key, mean, sd in (
        ("breeze.velocity_x", 2.0, 0.3),
        ("breeze.velocity_y", -1.0, 0.1),
        ("water_drag.coefficient_x", 17.0, 0.5),
        ("air_drag.coefficient_z", 0.040, 0.0004),
        # half of a tolerance of 8 %
        ("water_drag.coefficient_y", 13.0, 0.52),
    ):
        # five standard errors of a mean of 20,000 draws
        assert found[key].mean() == pytest.approx(mean, abs=5.0 * sd / np.sqrt(20_000)), key
        assert found[key].std() == pytest.approx(sd, rel=0.03), key
    alone = drawn_parameters(effects, 10, share=0.0, rng=rng, known=known)
    assert set(alone) == set(known.estimates)


def covariance(correlation: float) -> dict[str, Any]:
    """Wind and drag of the data sheet that a log tells apart by their sum alone."""
    names = ["effects.0.velocity_x", "nominal.rest.value", "nominal.quadratic_drag_air_change."]
    names[2] += "coefficient_z"
    rows = np.diag([0.3**2, 1.0, 0.0004**2])
    rows[0, 2] = rows[2, 0] = correlation * 0.3 * 0.0004
    return {"parameters": names, "matrix": rows.tolist()}


def test_what_a_log_tells_by_its_sum_is_drawn_jointly(tmp_path: Path) -> None:
    """Draws have the correlation that the diagnosis holds, and the spreads as before."""
    drag = {"quadratic_drag_air_change.coefficient_z": {"value": 0.01, "sd": 0.0004}}
    effects = effects_of(WIND)
    keys = ("breeze.velocity_x", "air_drag.coefficient_z", "breeze.velocity_y")
    for told in (-0.95, None):
        more = {} if told is None else {"covariance": covariance(told)}
        folder = answer(tmp_path / f"a{told}", wind(), nominal=drag, **more)
        known = posterior_of(folder, effects)
        rng = np.random.default_rng(5)
        found = drawn_parameters(effects, 20_000, share=0.0, rng=rng, known=known)
        seen = np.corrcoef([found[key] for key in keys])
        # five standard errors of a correlation of 20,000 draws
        wanted = told or 0.0
        assert seen[0, 1] == pytest.approx(wanted, abs=5.0 * (1.0 - wanted**2) / np.sqrt(2e4))
        assert np.abs(seen[2, :2]).max() < 5.0 / np.sqrt(2e4)
        assert found[keys[0]].std() == pytest.approx(0.3, rel=0.03)
        assert found[keys[1]].std() == pytest.approx(0.0004, rel=0.03)


def test_a_covariance_of_nothing_possible_is_refused(tmp_path: Path) -> None:
    """Correlations beyond 1, holes and other shapes are named; null is what was not determined."""
    drag = {"quadratic_drag_air_change.coefficient_z": {"value": 0.01, "sd": 0.0004}}
    sound, wild = covariance(0.5), covariance(1.5)
    skew = {**sound, "matrix": [*sound["matrix"][:2], [0.0, 0.0, 1.6e-7]]}
    short = {**sound, "matrix": sound["matrix"][:2]}
    twice = {**sound, "parameters": ["a", "a", "b"]}
    for k, (bad, said) in enumerate(
        [(wild, "not positive"), (skew, "not symmetric"), (short, "3 rows of 3"), (twice, "3 rows")]
    ):
        folder = answer(tmp_path / f"a{k}", wind(), nominal=drag, covariance=bad)
        with pytest.raises(ConfigError, match=said):
            posterior_of(folder, effects_of(WIND))
    blank = {**sound, "matrix": [[None] * 3] * 3}
    folder = answer(tmp_path / "blank", wind(), nominal=drag, covariance=blank)
    assert (posterior_of(folder, effects_of(WIND)).correlation == np.eye(3)).all()


def test_draws_keep_to_physical_bounds(tmp_path: Path) -> None:
    """Drag that may be nothing is never less than nothing."""
    entry = water_drag()
    entry["parameters"]["coefficient_x"] = number(-12.0, 5.0)
    known = posterior_of(answer(tmp_path / "a", entry), effects_of())
    found = drawn_parameters(
        effects_of(), 500, share=0.0, rng=np.random.default_rng(0), known=known
    )
    values = found["water_drag.coefficient_x"]
    assert values.min() == 0.0
    assert (values > 0.0).any()


def test_a_model_made_of_the_diagnosis_holds_its_means_already(tmp_path: Path) -> None:
    """With the model that was made of it nothing is added twice; one of another is refused."""
    folder = answer(tmp_path / "a", wind())
    sha = hashlib.sha256((folder / "diagnosis.json").read_bytes()).hexdigest()
    effects = effects_of(WIND, "effects.breeze.velocity_x=2.0", "effects.breeze.correction=true")
    model = {"name": "m", "provenance": {"diagnosis_sha256": sha}}
    found = posterior_of(folder, effects, model).estimates["breeze.velocity_x"]
    assert found == pytest.approx((2.0, 0.3))
    with pytest.raises(ConfigError, match="made from another diagnosis"):
        posterior_of(folder, effects, {"name": "m", "provenance": {"diagnosis_sha256": "0"}})


def test_a_rotor_is_found_by_its_number(tmp_path: Path) -> None:
    """Two weak rotors in an environment: the answer says which."""
    told = {"rotor": number(2, 0.0), "relative_loss": number(0.2, 0.02)}
    folder = answer(tmp_path / "a", {"name": "weak_rotor", "parameters": told})
    words = [f"+effect@effects.weak_{k}=weak_rotor" for k in (1, 2)]
    words += [f"effects.weak_{k}.rotor={k}" for k in (1, 2)]
    found = posterior_of(folder, effects_of(*words)).estimates
    assert set(found) == {"weak_2.relative_loss"}


def test_what_was_found_on_the_root_link_is_known_by_its_name(tmp_path: Path) -> None:
    """A diagnosis says ``body``, an effect ``root``: both are the link that bears the others."""
    told = {"name": "payload", "link": "body", "parameters": {"mass": number(0.25, 0.01)}}
    folder, effects = answer(tmp_path / "a", told), effects_of("+effect@effects.load=payload")
    found = posterior_of(folder, effects, root="body").estimates
    assert found["load.mass"] == pytest.approx((0.25, 0.01))
    with pytest.raises(ConfigError, match="payload on link body"):
        posterior_of(folder, effects, root="hull")


@pytest.mark.parametrize(
    ("entry", "more", "words", "said"),
    [
        (wind(), {}, [], "it found wind, and the environment has no such effect"),
        (wind(), {}, [WIND, "+effect@effects.gale=wind"], "is ambiguous: breeze, gale"),
        ({**water_drag(), "link": 3}, {}, [], "quadratic_drag on link 3"),
        ({**water_drag(), "link": "fin"}, {}, [], "quadratic_drag on link fin"),
        (wind(), {"verdict": "nothing_missing"}, [WIND], "nothing is missing"),
        (
            {"name": "wind", "parameters": {"velocity_x": {"value": 1}}},
            {},
            [WIND],
            "low90=None is not allowed",
        ),
        ({"name": "wind", "parameters": {"speed": number(1, 1)}}, {}, [WIND], "'speed' is not"),
    ],
)
def test_what_does_not_fit_the_environment_is_refused(
    entry: dict[str, Any], more: dict[str, Any], words: list[str], said: str, tmp_path: Path
) -> None:
    """The words name the effect, and what the environment has."""
    with pytest.raises(ConfigError, match=said):
        posterior_of(answer(tmp_path / "a", entry, **more), effects_of(*words))


def test_a_misspelt_effect_gets_the_nearest_name(tmp_path: Path) -> None:
    """Effects of the environment are called by their own names."""
    with pytest.raises(ConfigError, match="Did you mean 'wind_2'"):
        posterior_of(
            answer(tmp_path / "a", {**wind(), "name": "winds"}),
            effects_of("+effect@effects.wind_2=wind"),
        )


def test_an_ambiguous_answer_is_not_drawn_from(tmp_path: Path) -> None:
    """Advice is what a training can follow: there is no choose= there."""
    folder = answer(tmp_path / "a", wind(), water_drag(), verdict="ambiguous")
    with pytest.raises(ConfigError, match="wind or quadratic_drag") as refusal:
        posterior_of(folder, effects_of(WIND))
    assert "choose=" not in str(refusal.value)
    assert "seals plan" in str(refusal.value)


@pytest.mark.thorough
def test_a_training_takes_a_diagnosis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It trains; an engine, and a folder without a diagnosis, are refused by the key."""
    folder = answer(tmp_path / "a", wind())
    tiny = ["count=4", "course.steps=8", "course.episodes=2", "task.duration=0.2", WIND]
    words = ["train", "env=hover", *tiny, f"varied_from={folder}"]
    assert main([*words, f"hydra.run.dir={tmp_path / 'run'}"]) == 0
    metadata = json.loads((tmp_path / "run" / "policy" / "card.json").read_text())
    assert not any("varied_from" in word for word in metadata["overrides"])
    capsys.readouterr()
    assert main([*words, "backend=free", f"hydra.run.dir={tmp_path / 'b'}"]) == 2
    assert "only the robots of a batch can differ" in capsys.readouterr().err
    assert main([*words[:-1], f"varied_from={tmp_path}", f"hydra.run.dir={tmp_path / 'c'}"]) == 2
    assert f"varied_from={tmp_path}: there is no diagnosis.json" in capsys.readouterr().err
