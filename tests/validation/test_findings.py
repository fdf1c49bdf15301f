"""The report of a diagnosis: what it says, what it draws, and that a browser shows all of it."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from seals.logs.log import Log
from seals.logs.native import read_native
from seals.sysid.decision.verdict import Verdict
from seals.sysid.diagnosis import Diagnosis, diagnose
from seals.sysid.report.application import _write, answer_of
from seals.sysid.report.gains import ablation_steps, gain_over, held_out_by_window
from seals.sysid.report.report import LARGEST, model_after, write_report
from seals.sysid.report.sentence import sentence
from seals.sysid.report.started import attitude, tracks
from seals.sysid.report.table import NAMED, REJECTED, UNTRIED, ranking
from seals.sysid.report.tolerances import moved
from seals.sysid.report.words import headline, next_steps
from seals.sysid.report.wrench import log_rows
from seals.sysid.residual_force import locate_residual_force
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.validation.answer import read_answer
from seals.sysid.validation.writing import models_of, overlay_of
from tests.validation.hidden import generate

pytestmark = pytest.mark.thorough

# opens every fold and every choice, so that each chart has to be drawn
_OPEN_ALL = """<script>
addEventListener("load", () => {
  document.querySelectorAll("details").forEach((fold) => { fold.open = true; });
  document.querySelectorAll("select").forEach((choice) => [...choice.options].forEach((option) => {
    choice.value = option.value;
    choice.dispatchEvent(new Event("change"));
  }));
});
</script></body>"""


def made(folder: Path, *words: str) -> tuple[Diagnosis, Log]:
    """Make one log with the independent generator and diagnose it."""
    assert generate.main([str(folder), "--count", "1", "--no-gain", *words]) in (None, 0)
    log = read_native(next(p for p in sorted(folder.iterdir()) if p.is_dir()))
    return diagnose(log), log


@pytest.fixture(scope="module")
def report(windy: tuple[Diagnosis, Log], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the report on it."""
    folder = tmp_path_factory.mktemp("report")
    assert write_report(*windy, folder) == folder / "report.html"
    return folder


def test_figures_that_are_not_determined_end_in_no_traceback(
    windy: tuple[Diagnosis, Log], tmp_path: Path
) -> None:
    """A 1-sigma that is NaN: null in JSON, words in text and page, and the verdict stays."""
    found, log = windy
    claim, rounds = found.answer.claims[0], found.search.rounds

    def lost(h: EvidenceHypothesis) -> EvidenceHypothesis:
        fit = dataclasses.replace(h.fit, known=dict.fromkeys(h.fit.keys, np.nan))
        return dataclasses.replace(h, fit=fit)

    claim = dataclasses.replace(claim, hypothesis=lost(claim.hypothesis))
    tried = ((lost(rounds[0][0]), *rounds[0][1:]), *rounds[1:])
    doubtful = dataclasses.replace(
        found,
        answer=dataclasses.replace(found.answer, claims=(claim,)),
        search=dataclasses.replace(found.search, rounds=tried),
        held_out={"stated": 3.0, "before": 2.0, "after": np.nan, "noise_floor": 1.0},
    )
    missing = locate_residual_force(found.problem, found.search.nominal)
    _write(tmp_path, answer_of(doubtful, missing))
    page = write_report(doubtful, log, tmp_path, localisation=missing).read_text(encoding="utf-8")
    for name in ("diagnosis.json", "report.json"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert re.search(r"\bNaN\b|\bInfinity\b", text) is None
    table = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    value = next(iter(table["effects"][0]["parameters"].values()))
    assert value["low90"] is None
    assert isinstance(value["value"], float)
    assert table["held_out_error"]["after"] is None
    assert "(90 %: not determined)" in sentence(doubtful)
    assert "2 → not determined" in page
    assert doubtful.answer.verdict.exit_code == 10
    # an effect without an interval can still be added
    added = overlay_of(read_answer(tmp_path), {}, source={})
    assert set(added["effects"]) == {"wind"}
    assert added["intervals"] == {"wind": {}}


def test_a_rival_has_a_model_of_its_own(windy: tuple[Diagnosis, Log]) -> None:
    """Of what a log cannot tell apart, each comes with the nominal values fitted beside it."""
    found, _ = windy
    claim = found.answer.claims[0]
    rival = next(h for h in found.search.rounds[0] if h.names[-1] != claim.name)
    claim = dataclasses.replace(claim, rivals=(rival.names[-1],))
    answer = dataclasses.replace(found.answer, verdict=Verdict.ambiguous, claims=(claim,))
    models = models_of(dataclasses.replace(found, answer=answer), vehicle="quad")
    assert list(models) == [claim.name, rival.names[-1]]
    for name, model in ((claim.name, claim.hypothesis), (rival.names[-1], rival)):
        parts = {**models[name].get("effects", {}), **models[name].get("changes", {})}
        assert set(parts) == {name}
        assert models[name]["provenance"] == {"vehicle": "quad"}
        value = models[name]["nominal"]["mass.mass"]["value"]
        assert value == pytest.approx(model.fit.values["mass.mass"], rel=1e-5)
        alone = models[name]["nominal"]["mass.mass"]["alone"]
        assert alone == pytest.approx(found.search.nominal.fit.values["mass.mass"], rel=1e-5)


def test_the_report_is_two_whole_files_of_bounded_size(report: Path) -> None:
    """One page and one JSON file, nothing loaded from elsewhere, the script once."""
    assert sorted(p.name for p in report.iterdir()) == ["report.html", "report.json"]
    html = (report / "report.html").read_text(encoding="utf-8")
    assert len(html.encode("utf-8")) <= LARGEST
    assert html.count("const lineChart") == 1
    assert re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=", html) == []


def test_the_page_names_the_effect_and_the_next_command(report: Path) -> None:
    """Name, confidence, interval, error fall and command line stand on the page."""
    html = (report / "report.html").read_text(encoding="utf-8")
    main = html.split("<main")[1].split("</main")[0]
    for words in ("The model lacks wind", "velocity x", "90 % interval", "seals add diagnosis="):
        assert words in main
    assert "seals plan" not in main


def test_a_browser_draws_every_chart_without_errors(report: Path, tmp_path: Path) -> None:
    """Behind every selector and fold there is a drawn chart, and the console stays silent."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("no chromium on this machine")
    html = (report / "report.html").read_text(encoding="utf-8")
    page = tmp_path / "opened.html"
    page.write_text(_OPEN_ALL.join(html.rsplit("</body>", 1)), encoding="utf-8")
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000"]
    flags += ["--enable-logging=stderr", f"--user-data-dir={tmp_path / 'profile'}"]
    done = subprocess.run(
        [browser, *flags, "--dump-dom", f"file://{page}"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    plots = re.findall(r'<div class="([^"]*)"[^>]*id="chart-\d+"', done.stdout)
    assert len(plots) == html.count('id="chart-') > 20
    assert all("drawn" in classes for classes in plots)


def test_the_json_holds_what_the_page_shows(report: Path, windy: tuple[Diagnosis, Log]) -> None:
    """Rank, ladder, channels, tolerances and data check are there as numbers."""
    data = json.loads((report / "report.json").read_text(encoding="utf-8"))
    assert data["diagnosis"]["verdict"] == "named"
    assert data["rank"][0]["name"] == "wind"
    assert data["ladder"][-1]["held_out_error"] == pytest.approx(windy[0].held_out["after"])
    assert max(c["before"] for c in data["channels"].values()) > 3.0
    assert {t["words"] for t in data["tolerances"]} >= {"mass of the body"}


def test_residuals_of_the_right_model_fill_their_band(windy: tuple[Diagnosis, Log]) -> None:
    """Every channel's residual has the spread that noise and gusts give it, once wind is in."""
    found = windy[0]
    shown = tracks(found.search.nominal, model_after(found))
    assert shown[0].level(shown[0].before) > 3.0
    for track in shown:
        assert 0.75 < track.level(track.after) < 1.3, track.name


def test_gains_add_up_to_the_fall_of_the_held_out_error(windy: tuple[Diagnosis, Log]) -> None:
    """The named effect's gain is before less after, with an error bar far below it."""
    found = windy[0]
    base, best = found.search.nominal, found.search.best
    seen = base.fitter.windows.observed
    gain = gain_over(base, best)
    assert held_out_by_window(base).sum() / seen == pytest.approx(found.held_out["before"])
    fall = found.held_out["before"] - found.held_out["after"]
    # windows that follow a late sensor leave out a row each: both count them, not quite alike
    assert gain.value == pytest.approx(fall, rel=1e-3)
    assert gain.error is not None
    assert 0.0 < gain.error < 0.5 * gain.value
    errors = [step.error for step in ablation_steps(found.search)]
    assert errors[0] > errors[-1] == pytest.approx(found.held_out["after"])


def test_every_effect_has_a_fate_and_a_reason(windy: tuple[Diagnosis, Log]) -> None:
    """All candidates are in the rank, one is named, and each says why."""
    found = windy[0]
    rank = ranking(found)
    assert [e.name for e in rank if e.status == NAMED] == ["wind"]
    assert {e.name for e in rank} == {c.name for c in found.problem.plant.candidate_set.candidates}
    assert all(e.reason for e in rank)
    assert all((e.gain is None) == (e.status == UNTRIED) for e in rank)


def test_an_ambiguous_answer_asks_for_another_flight(windy: tuple[Diagnosis, Log]) -> None:
    """With a rival that does as well, the words name both and the commands plan and choose."""
    found = windy[0]
    rival = next(h.candidates[-1].name for h in found.search.rounds[0][1:])
    claim = dataclasses.replace(
        found.answer.claims[0], confidence=0.6, rivals=(rival,), alike=(rival,)
    )
    answer = dataclasses.replace(found.answer, verdict=Verdict.ambiguous, claims=(claim,))
    doubtful = dataclasses.replace(found, answer=answer)
    data = doubtful.to_dict() | {"next_experiment": {"sentence": "Fly low."}}
    assert "does not determine which: wind (60 %)" in headline(doubtful, data)
    words, commands = next_steps(doubtful, data, None, Path("out"))
    assert words[0] == "Fly low."
    assert commands.splitlines() == [
        "seals plan diagnosis=out",
        "seals add diagnosis=out name=my_model choose=wind",
    ]
    assert [e.status for e in ranking(doubtful)][:2] == ["possible", "possible"]


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["quad", "drop_imu_only"])
def test_nothing_missing_is_said_plainly(vehicle: str, tmp_path: Path) -> None:
    """A sound model gets a clean page: no effect named, no command, values within tolerance."""
    words = ("--level", "null", "--vehicle", vehicle, "--seed", "5")
    found, log = made(tmp_path / "log", *words)
    html = write_report(found, log, tmp_path / "out").read_text(encoding="utf-8")
    assert "Nothing is missing" in html
    assert "seals add" not in html.split("<main")[1].split("</main")[0]
    assert max(abs(m.sigmas) for m in moved(found.search.nominal)) < 4.0


def test_a_quiet_answer_offers_no_command(windy: tuple[Diagnosis, Log]) -> None:
    """Where nothing is missing there is no effect to add, and no effect is called named."""
    found = windy[0]
    answer = dataclasses.replace(found.answer, verdict=Verdict.nothing_missing, claims=())
    quiet = dataclasses.replace(found, answer=answer)
    data = quiet.to_dict()
    assert headline(quiet, data).startswith("Nothing is missing")
    assert next_steps(quiet, data, None, Path("out"))[1] == ""
    assert {e.status for e in ranking(quiet)} <= {REJECTED, UNTRIED}


def test_points_in_time_find_their_rows(windy: tuple[Diagnosis, Log]) -> None:
    """Every second row's time leads back to that row."""
    problem = windy[0].problem
    rows = np.arange(0, problem.samples.rows, 2)
    assert log_rows(problem, problem.samples.time[rows]).tolist() == rows.tolist()


def test_attitude_residuals_are_differences_of_angles() -> None:
    """A yaw error of a level vehicle shows as yaw, across the seam at half a turn."""
    half = np.array([[0.0, 0.0, np.sin(1.565), np.cos(1.565)]])
    turn = np.array([[0.0, 0.0, 0.05]])
    assert attitude(half, turn)[0] == pytest.approx([0.0, 0.0, 0.05], abs=1e-12)
