"""The verb `compare`: its data, its fits and ladders, and what it writes."""

from __future__ import annotations

import functools
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.compare.application import clock_offset, compare_logs, print_variants, settings_of
from seals.compare.events import find_drop
from seals.compare.noise import noise_of
from seals.compare.result import Comparison
from seals.config.compose import compose
from seals.errors import ConfigError, LogError
from seals.logs import Log
from seals.logs.native import write_native


def last_folder(runs: Path) -> Path:
    """The newest run folder."""
    return max(runs.glob("*/*"), key=lambda p: p.stat().st_mtime)


@pytest.fixture
def fall(tmp_path: Path) -> Path:
    """A free fall with noise as a native log."""
    t = np.arange(0.0, 1.0, 0.02)
    z = 5.0 - 0.5 * 9.81 * t**2 + np.random.default_rng(0).normal(0.0, 0.003, t.size)
    folder = tmp_path / "fall"
    write_native(Log(name="fall", columns={"t": t, "position_z": z}), folder)
    return folder


def test_a_comparison_writes_page_data_and_pictures(
    fall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """report.html loads nothing from elsewhere; comparison.json and a picture lie beside it."""
    monkeypatch.chdir(tmp_path)
    assert main(["compare", f"log={fall}", "robot=ball"]) == 0
    folder = last_folder(tmp_path / "runs")
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)\s*=\s*[\"']http", page)
    data = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))
    assert data["groups"][0]["ladder"][0]["train"]["position"]["rms"] < 0.02
    assert (folder / "plots" / "fall.png").stat().st_size > 5000
    assert "report.html" in capsys.readouterr().out.splitlines()[-1]


@pytest.mark.thorough
def test_a_run_can_be_compared_like_a_measurement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The log of a simulated fall in air, compared with the same model, stays within its noise."""
    monkeypatch.chdir(tmp_path)
    robot = ["robot=ball", "initial.position=[0,0,20]"]
    assert main(["run", *robot, "time.duration=0.3"]) == 0
    run = last_folder(tmp_path / "runs")
    assert main(["compare", f"log={run}", *robot, "name=self"]) == 0
    data = json.loads(
        (last_folder(tmp_path / "runs") / "comparison.json").read_text(encoding="utf-8")
    )
    scores = data["groups"][0]["ladder"][0]["train"]
    assert scores["specific_force"]["ratio"] < 1.5
    assert scores["position"]["rms"] < 1e-3


def test_a_missing_log_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log that does not exist: exit code 2, no traceback, no folder left."""
    monkeypatch.chdir(tmp_path)
    assert main(["compare", "log=nowhere", "robot=ball"]) == 2
    assert "nowhere" in capsys.readouterr().err
    assert not list(tmp_path.glob("runs/*/*"))


def test_a_pure_number_is_told_without_a_unit(capsys: pytest.CaptureFixture[str]) -> None:
    """Its unit is 1, which would read as a part of the number."""
    values = [
        SimpleNamespace(key="drag.share", value=0.5, sigma=0.25, unit="1", at_bound=False),
        SimpleNamespace(key="drag.length", value=2.0, sigma=0.5, unit="m", at_bound=True),
    ]
    group = SimpleNamespace(
        name="all", variants=[SimpleNamespace(name="", scores=[], fitted=values)]
    )
    comparison: Any = SimpleNamespace(groups=[group])
    print_variants(comparison)
    told = capsys.readouterr().out.splitlines()
    assert told[-2] == "  drag.share = 0.5 +- 0.25"
    assert told[-1] == "  drag.length = 2 +- 0.5 m  (at its bound)"


def test_noise_is_found_under_motion() -> None:
    """White noise on a parabola and a slow swing is estimated within five per cent."""
    rng = np.random.default_rng(1)
    t = np.arange(8000) * 0.01
    y = 3.0 * t - 4.9 * t**2 + np.sin(0.5 * t) + rng.normal(0.0, 0.02, t.size)
    # the median of |D3| over n samples has a relative standard error of about 1.2/sqrt(n)
    assert noise_of(y[:, None])[0] == pytest.approx(0.02, rel=0.05)


def test_an_impact_does_not_raise_the_noise() -> None:
    """A spike of a thousand sigma leaves the estimate where it was."""
    rng = np.random.default_rng(2)
    y = rng.normal(0.0, 0.02, 4000)
    y[2000:2010] += 20.0
    assert noise_of(y[:, None])[0] == pytest.approx(0.02, rel=0.08)


def test_a_quantised_channel_has_the_noise_of_its_step() -> None:
    """A quiet signal that sits on two levels gets step/sqrt(12), not zero."""
    y = np.where(np.arange(1000) < 500, 0.0, 0.1)
    assert noise_of(y[:, None])[0] == pytest.approx(0.1 / np.sqrt(12.0))


def test_missing_samples_are_left_out() -> None:
    """A component without samples is unknown, or what the data sheet states."""
    y = np.full((100, 1), np.nan)
    assert np.isnan(noise_of(y)[0])
    assert noise_of(y, stated=0.3)[0] == 0.3


@pytest.mark.parametrize("lag", [0.0, 0.0137, -0.031])
def test_a_clock_offset_is_found_to_a_fraction_of_a_sample(lag: float) -> None:
    """The lag of a noisy copy is found within a fifth of the sampling."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 20.0, 0.01)

    def signal(at: np.ndarray) -> np.ndarray:
        return np.sin(2.1 * at) + 0.6 * np.sin(5.7 * at + 1.0) + 0.3 * np.sin(11.0 * at)

    found, match = clock_offset(
        t, signal(t - lag) + rng.normal(0, 0.02, t.size), signal(t), most=0.1
    )
    assert found == pytest.approx(lag, abs=0.002)
    assert match > 0.99


def test_a_channel_at_rest_has_no_clock_offset() -> None:
    """Nothing moves, so nothing is claimed."""
    t = np.arange(0.0, 5.0, 0.01)
    assert clock_offset(t, np.ones(t.size), np.ones(t.size), most=0.1) == (0.0, 0.0)


def drop(
    *, fall: float = 0.4, rate: float = 2000.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Specific force of a body that hangs, falls, enters water and is caught."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 4.0, 1.0 / rate)
    f = np.zeros((t.size, 3))
    f[:, 2] = 9.81
    f[(t >= 2.0) & (t < 2.0 + fall), 2] = 0.05
    wet = t >= 2.0 + fall
    since = t - 2.0 - fall
    f[wet, 2] = 20.0 * np.exp(-since[wet] / 0.005) + 6.0
    shock = wet & (since > 0.15) & (since < 0.17)
    f[shock, 2] = 350.0
    f[since > 0.17, 2] = 9.81
    return t, f + rng.normal(0.0, 0.02, f.shape)


def test_release_entry_and_catch_are_told_apart() -> None:
    """The largest spike is the catch at the bottom, not the water."""
    t, f = drop()
    events = find_drop(t, f)
    assert events.release == pytest.approx(2.0, abs=1e-3)
    assert events.entry == pytest.approx(2.4, abs=1e-3)
    assert events.catch == pytest.approx(2.55, abs=2e-3)
    assert events.caught
    assert events.offset == pytest.approx(0.05, abs=0.01)


def test_a_log_without_a_fall_is_refused() -> None:
    """A body that only hangs has no events."""
    t, f = drop()
    with pytest.raises(LogError, match="no free fall"):
        find_drop(t[:3000], f[:3000])


MASS, GRAVITY = 0.3, 9.81
DRAG = 0.02
NOISE = 0.01
OVERRIDES = [
    "robot=ball",
    "+effect@effects.drag=quadratic_drag",
    "effects.drag.medium=air",
    "effects.drag.correction=true",
    "fit=[effects.drag.coefficient_x+coefficient_y+coefficient_z]",
    "+ladder.gravity=[gravity]",
    "+ladder.drag=[gravity,drag]",
    "held_out=['*/1']",
    "train=['*/0']",
    "compare.step=0.02",
]


def height(t: np.ndarray, drag: float, start: float) -> np.ndarray:
    """Fall from rest, quadratic drag: z = z0 - (m/c) ln cosh(g t / v_t), v_t = sqrt(m g / c)."""
    if drag == 0.0:
        return start - 0.5 * GRAVITY * t**2
    terminal = np.sqrt(MASS * GRAVITY / drag)
    return start - terminal**2 / GRAVITY * np.log(np.cosh(GRAVITY * t / terminal))


def falls(drag: float, *, seed: int = 0, noise: float = NOISE) -> Log:
    """Two drops from different heights, seen by a camera."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 2.0, 0.02)
    z = np.concatenate([height(t, drag, 40.0), height(t, drag, 30.0)])
    return Log(
        name="fall",
        columns={
            "t": np.concatenate([t, t]),
            "position_z": z + rng.normal(0.0, noise, z.size),
        },
        segment=np.repeat([0, 1], t.size),
    )


def compared(log: Log, *more: str) -> Comparison:
    """Compare the ball with a log."""
    settings = settings_of(compose([*OVERRIDES, *more], root="compare"))
    return compare_logs(settings, [log])


@functools.cache
def falls_compared() -> Comparison:
    """The comparison that two tests look at."""
    return compared(falls(DRAG))


def test_a_hidden_drag_is_found_and_the_held_out_error_falls_to_the_noise() -> None:
    """The coefficient is within three standard deviations, the unseen drop down to the noise."""
    group = falls_compared().groups[0]
    gravity, drag = group.variants
    fitted = drag.fitted[0]
    assert fitted.value == pytest.approx(DRAG, abs=3.0 * fitted.sigma)
    assert fitted.sigma < 0.02 * DRAG
    assert gravity.rms("position", held_out=True) > 10.0 * NOISE
    # 100 samples less two for the start: the rms scatters by 7 %
    assert drag.rms("position", held_out=True) == pytest.approx(NOISE, rel=0.25)
    assert drag.scores[1].total == pytest.approx(1.0, abs=0.3)


@pytest.mark.thorough
def test_an_absent_drag_is_not_found() -> None:
    """On a fall in vacuum the fitted drag is zero within its uncertainty and nothing improves."""
    group = compared(falls(0.0, seed=4)).groups[0]
    fitted = group.variants[1].fitted[0]
    assert fitted.value <= 3.0 * fitted.sigma
    before, after = (r.rms("position", held_out=True) for r in group.variants)
    assert after == pytest.approx(before, rel=0.05)


def test_the_result_is_plain_data() -> None:
    """The JSON form holds the ladder and no number that JSON lacks."""
    import json

    data = falls_compared().as_data()
    text = json.dumps(data, allow_nan=False)
    variants: list[dict[str, Any]] = json.loads(text)["groups"][0]["ladder"]
    assert [r["name"] for r in variants] == ["gravity", "drag"]
    assert variants[1]["held_out"]["position"]["samples"] == 100


@pytest.mark.thorough
def test_the_clock_offset_is_reported() -> None:
    """A measurement that lags the model by 60 ms is said to."""
    log = falls(DRAG, noise=0.002)
    late = log.with_columns({"t": log.time})
    group = compared(late, "compare.offset=0.1").groups[0]
    lag, match = group.offsets["fall/0"]["position"]
    assert abs(lag) < 0.02
    assert match > 0.999


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("fit=[effects.drga.coefficient_x]", "drag"),
        ("fit=[effects.drag.coeficient_x]", "coefficient_x"),
        ("fit=[robot.mass]", "seals calibrate"),
        ("train=['fal/0']", "fall/0"),
    ],
)
def test_wrong_names_are_answered_with_the_right_ones(override: str, words: str) -> None:
    """Each wrong name of a comparison is refused with the nearest right one."""
    with pytest.raises(ConfigError, match=words):
        compared(falls(DRAG), override)


def test_no_variant_is_fitted_before_all_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong name in the last variant costs no minute of fitting the others."""
    monkeypatch.setattr("seals.compare.variants.predictor_of", lambda _: pytest.fail("was fitted"))
    with pytest.raises(ConfigError, match="gravity"):
        compared(falls(DRAG), "+ladder.third=[gravty]")


def test_a_log_that_the_model_cannot_predict_is_refused() -> None:
    """A log of battery voltages alone is refused in words."""
    log = Log(
        name="volts", columns={"t": np.arange(50) * 0.1, "battery_voltage": np.linspace(16, 15, 50)}
    )
    with pytest.raises(LogError, match="no channel that the model predicts"):
        compared(log, "train=[]", "held_out=[]")
