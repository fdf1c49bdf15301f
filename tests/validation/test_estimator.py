"""The diagnosis as a Python object: learns from one flight, is judged on another."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from seals.errors import ConfigError, LogError, NotFitted
from seals.logs import Log, read_native
from seals.logs.shipped import find_log
from seals.sysid.report.estimator import MissingEffect, misfit_of

TRUTH = Path(__file__).parent / "hidden_effect_truth.yaml"
A, B = "hidden_effect/flight_a", "hidden_effect/flight_b"


def test_settings_are_kept_as_given() -> None:
    """Settings are stored untouched, read and changed by name; a wrong name is refused."""
    made = MissingEffect(processes=3)
    assert made.get_params() == {"processes": 3, "progress": False}
    assert made.set_params(processes=2) is made
    assert repr(copy.deepcopy(made)) == "MissingEffect(processes=2, progress=False)"
    with pytest.raises(ConfigError, match="Did you mean 'processes'"):
        made.set_params(proceses=1)
    with pytest.raises(ConfigError, match="processes=0 is not allowed"):
        MissingEffect(processes=0).fit(A)


def test_nothing_is_known_before_a_fit(tmp_path: Path) -> None:
    """What is learned, the score and the report ask for a fit in words."""
    made = MissingEffect()
    assert not hasattr(made, "verdict_")
    for ask in (lambda: made.effects_, lambda: made.score(B), lambda: made.report(tmp_path)):
        with pytest.raises(NotFitted, match=r"Call fit\(log\) first"):
            ask()


def test_a_log_that_is_none_is_refused(tmp_path: Path) -> None:
    """A mistyped name names the nearest; an empty folder is no log."""
    with pytest.raises(ConfigError, match="Did you mean 'hidden_effect/flight_a'"):
        MissingEffect().fit("hidden_efect/flight_a")
    with pytest.raises(LogError, match="holds neither"):
        MissingEffect().fit(tmp_path)


def test_the_effect_is_named_and_measured(fitted: MissingEffect) -> None:
    """The hidden effect is named, and its intervals hold the truth."""
    (true,) = yaml.safe_load(TRUTH.read_text(encoding="utf-8"))["effects"]
    assert fitted.verdict_ == "named"
    assert list(fitted.effects_) == list(fitted.confidence_) == [true["name"]]
    assert fitted.confidence_[true["name"]] > 0.9
    for name, p in true["parameters"].items():
        estimate = fitted.effects_[true["name"]][name]
        assert estimate.low90 < p["value"] < estimate.high90
        assert estimate.unit == p["unit"]
    assert fitted.held_out_error_["before"] > 1.5
    assert fitted.held_out_error_["after"] < 1.06


def test_the_score_is_that_of_an_unseen_flight(fitted: MissingEffect) -> None:
    """Noise alone is left of the other flight; without or against the effect much more is."""
    values = dict(fitted.diagnosis_.hypothesis.fit.values)
    nominal = fitted.diagnosis_.search.nominal.fit.values
    other = read_native(find_log(B))
    assert fitted.score(other) == pytest.approx(-1.0, abs=0.06)
    assert fitted.score(other) == fitted.score(B)
    assert misfit_of(other, nominal, fitted.diagnosis_) > 1.5
    wrong = {k: -v if k.startswith("wind.") else v for k, v in values.items()}
    assert misfit_of(other, wrong, fitted.diagnosis_) > 4.0


@pytest.mark.thorough
def test_another_vehicle_is_no_judge(fitted: MissingEffect) -> None:
    """A log of another vehicle is refused."""
    log = read_native(find_log(B))
    meta = {**log.meta, "vehicle": {**log.meta["vehicle"], "name": "glider"}}
    with pytest.raises(ConfigError, match=r"found on 'quad', log 'flight_b' is of 'glider'"):
        fitted.score(replace(log, meta=meta))


@pytest.mark.thorough
def test_the_same_log_gives_the_same_answer() -> None:
    """Two fits of one short log agree to the last bit, shared among processes or not."""
    log: Log = read_native(find_log(A)).select(slice(0, 300))
    one, two = MissingEffect().fit(log), MissingEffect(processes=2).fit(log)
    assert one.effects_ == two.effects_
    assert one.held_out_error_ == two.held_out_error_


@pytest.mark.thorough
def test_the_report_is_written(fitted: MissingEffect, tmp_path: Path) -> None:
    """The page is there and names the effect."""
    page = fitted.report(tmp_path / "answer")
    assert page == tmp_path / "answer" / "report.html"
    assert f"The model lacks {next(iter(fitted.effects_))}" in page.read_text(encoding="utf-8")
