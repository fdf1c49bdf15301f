"""The readers against what is known of the real measurements."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.logs import Log, Severity, check_log
from seals.plugins.readers.balls import ReaderBalls
from seals.plugins.readers.crazyflie import ReaderCrazyflie
from seals.plugins.readers.flume import ReaderFlume
from seals.plugins.readers.glider import ReaderGlider
from seals.plugins.readers.impack import ImpackSensor, ReaderImpack
from seals.plugins.readers.pendulum import ReaderPendulum

pytestmark = pytest.mark.validation

BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"
G = 9.80665


def _logs(reader: Any, folder: str, monkeypatch: pytest.MonkeyPatch) -> list[Log]:
    root = Path(os.environ.get("SEALS_DATA") or BESIDE)
    if not (root / folder).is_dir():
        pytest.skip(f"no measurements: set SEALS_DATA to a folder that holds {folder}")
    monkeypatch.setenv("SEALS_DATA", str(root))
    return list(reader.read())


@pytest.fixture
def drops(monkeypatch: pytest.MonkeyPatch) -> list[Log]:
    """The water-entry drops."""
    return _logs(ReaderImpack(), "water-entry-impack", monkeypatch)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[Log]:
    """The flume runs."""
    return _logs(ReaderFlume(), "wave-flume-ship-section", monkeypatch)


@pytest.fixture
def flights(monkeypatch: pytest.MonkeyPatch) -> list[Log]:
    """The quadrotor flights."""
    return _logs(ReaderCrazyflie(), "crazyflie-sysid", monkeypatch)


def _still(log: Log) -> Log:
    """The first second and a half, after the recorder's filter has settled."""
    since = log.time - log.time[0]
    return log.select((since > 0.1) & (since < 1.6))


def test_drops_rest_at_one_g_up_the_body_z_axis(drops: list[Log]) -> None:
    """Before each of the 15 drops z reads +1 g within 0.1 %, x and y less than 0.03 g."""
    assert len(drops) == 15
    for log in drops:
        rest = _still(log).channel("specific_force").mean(axis=0) / G
        assert rest[2] == pytest.approx(1.0, abs=1e-3)
        assert np.abs(rest[:2]).max() < 0.03


def test_drops_are_sampled_at_2009_hertz_and_their_noise_is_as_stated(drops: list[Log]) -> None:
    """Rate 2009 Hz within 1; the stated sigma is the scatter at rest within 15 %."""
    for log in drops:
        channel = log.meta["sensors"]["channels"]["specific_force"]
        assert channel["rate"] == pytest.approx(2009.3, abs=1.0)
        scatter = _still(log).columns["specific_force_z"].std()
        assert scatter == pytest.approx(channel["sigma"], rel=0.15)


def test_free_fall_lasts_as_long_as_the_nominal_speed_says(drops: list[Log]) -> None:
    """The longest stretch below 0.05 g, times g, is the nominal speed within 4 %."""
    for log in drops:
        falling = np.abs(log.columns["specific_force_z"]) < 0.05 * G
        catch = int(np.argmax(log.columns["specific_force_z"]))
        change = np.diff(falling[:catch].astype(int), prepend=0, append=0)
        begins, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
        speed = 9.81 * (log.time[ends] - log.time[begins]).max()
        assert speed == pytest.approx(log.meta["drop"]["nominal_speed"], rel=0.04)


def test_drop_names_are_read(drops: list[Log]) -> None:
    """Nine hemisphere drops at three speeds, six cone drops at two."""
    noses = [log.meta["drop"]["nose"] for log in drops]
    assert (noses.count("sphere"), noses.count("150degcone")) == (9, 6)
    assert {log.meta["drop"]["nominal_speed"] for log in drops} == {2.0, 4.0, 6.0}


def test_clipping_of_the_40_g_channel_is_noticed(drops: list[Log]) -> None:
    """The nine drops whose catch reaches 42 g are reported as saturated, the others are not."""
    saturated = {log.name for log in drops if any(f.code == "saturated" for f in check_log(log))}
    reaching = {log.name for log in drops if log.columns["specific_force_z"].max() > 42.0 * G}
    assert saturated == reaching
    assert len(saturated) == 9


def test_fast_channel_of_a_drop_is_available(monkeypatch: pytest.MonkeyPatch) -> None:
    """The 100 g channel comes at 20 kHz and sees the catch too."""
    reader = ReaderImpack(path="2mps_sphere_1", sensor=ImpackSensor.PIEZORESISTIVE)
    (log,) = _logs(reader, "water-entry-impack", monkeypatch)
    assert log.meta["sensors"]["channels"]["specific_force"]["rate"] == pytest.approx(2e4, rel=0.01)
    assert np.abs(log.channel("specific_force")).max() > 20.0 * G


def test_balls_fall_at_about_g_when_heavy(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bowling ball falls freely: a parabola with 9.81 leaves less than 0.2 m on both drops."""
    logs = _logs(ReaderBalls(), "falling-balls", monkeypatch)
    assert len(logs) == 11
    assert all(len(log.segments()) == 2 for log in logs)
    ball = next(log for log in logs if log.name == "bowling_ball")
    for drop in ball.segments():
        height = drop.columns["position_z"] + 0.5 * 9.81 * drop.time**2
        line = np.polyfit(drop.time, height, 1)
        assert np.std(height - np.polyval(line, drop.time)) < 0.2
    assert ball.meta["vehicle"]["mass"] == pytest.approx(2.296, abs=1e-3)
    assert ball.meta["vehicle"]["radius"] == pytest.approx(0.67 / (2 * math.pi))


def test_balls_have_the_published_length_and_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """15 Hz, 2.8 to 3.8 s, from about 47 m; only the volleyball lacks a weight."""
    logs = _logs(ReaderBalls(), "falling-balls", monkeypatch)
    for log in logs:
        for drop in log.segments():
            assert np.median(np.diff(drop.time)) == pytest.approx(1 / 15, rel=0.01)
            assert 2.6 < np.ptp(drop.time) < 3.9
            assert drop.columns["position_z"][0] == pytest.approx(47.5, abs=2.5)
    assert [log.name for log in logs if log.meta["vehicle"]["mass"] is None] == ["volleyball"]


def test_pendulum_hangs_at_zero_and_lasts_55_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """55 s in 4 + 2 segments at 1 kHz, around zero, and the rate is the angle's derivative."""
    fit, held_out = _logs(ReaderPendulum(), "single-pendulum", monkeypatch)
    assert (len(fit.segments()), len(held_out.segments())) == (4, 2)
    assert fit.rows + held_out.rows == pytest.approx(55_000, abs=10)
    assert held_out.time[-1] == pytest.approx(55.0, abs=0.01)
    for part in (*fit.segments(), *held_out.segments()):
        angle, rate = part.columns["joint_position_1"], part.columns["joint_velocity_1"]
        assert abs(angle.mean()) < 0.03
        gained = np.trapezoid(rate, part.time)
        assert gained == pytest.approx(angle[-1] - angle[0], abs=0.02)


def test_pendulum_swings_with_the_known_frequency(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small swings at the end: w0^2 = 64 1/s^2 within 5 %, corrected for amplitude."""
    _, held_out = _logs(ReaderPendulum(), "single-pendulum", monkeypatch)
    last = held_out.segments()[-1]
    angle = last.columns["joint_position_1"]
    rising = last.time[1:][(angle[:-1] < 0.0) & (angle[1:] >= 0.0)]
    swing = float(np.abs(angle).max() + np.abs(angle[-2000:]).max()) / 2
    # period of a pendulum, first term of the series in the amplitude
    frequency = 2 * math.pi / np.diff(rising).mean() * (1 + swing**2 / 16)
    assert frequency**2 == pytest.approx(64.05, rel=0.05)


def test_glider_has_the_published_ranges(monkeypatch: pytest.MonkeyPatch) -> None:
    """13,140 samples over 4.1 h, Baltic density, 69 % of the Doppler log missing."""
    (log,) = _logs(ReaderGlider(), "slocum-glider", monkeypatch)
    assert log.rows == 13_140
    assert log.time[-1] / 3600 == pytest.approx(4.1, abs=0.05)
    assert np.isnan(log.columns["speed_through_water"]).mean() == pytest.approx(0.69, abs=0.01)
    assert log.columns["pressure"].max() == pytest.approx(4.18e5, rel=1e-3)
    density = log.columns["water_density"]
    assert 1004.0 < density.min() < density.max() < 1007.5
    assert np.nanmin(log.columns["speed_through_water"]) == pytest.approx(0.14, abs=0.01)
    assert np.abs(log.columns["ballast_volume"]).max() == pytest.approx(231e-6, rel=0.01)


def test_glider_climbs_nose_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pitch is nose up positive: the depth falls where it is positive, and rises where negative."""
    (log,) = _logs(ReaderGlider(), "slocum-glider", monkeypatch)
    sinking = np.gradient(log.columns["depth"], log.time)
    pitch = log.columns["pitch"]
    assert np.median(sinking[pitch > 0.3]) < -0.05
    assert np.median(sinking[pitch < -0.3]) > 0.05


def test_flights_rest_at_one_g_and_run_at_one_kilohertz(flights: list[Log]) -> None:
    """50, 62 and 47 s at 1.01 kHz; motors off, |f| = 1 g within 1 %."""
    lengths = [round(float(np.ptp(log.time))) for log in flights]
    assert lengths == [50, 62, 47]
    for log in flights:
        assert 1.0 / np.median(np.diff(log.time)) == pytest.approx(1011, abs=3)
        rest = log.select(log.time < log.time[0] + 0.5)
        assert rest.channel("motor_pwm").max() == 0.0
        size = np.linalg.norm(rest.channel("specific_force"), axis=1).mean()
        assert size / G == pytest.approx(1.0, abs=0.01)


def test_flights_hover_at_two_thirds_of_full_pulse_width(flights: list[Log]) -> None:
    """In the air the median pulse width is 0.6 to 0.7 of full."""
    for log in flights:
        pwm = log.channel("motor_pwm")
        assert pwm.max() <= 1.0
        flying = pwm.min(axis=1) > 0.3
        if flying.sum() > 5000:
            assert np.median(pwm[flying]) == pytest.approx(0.65, abs=0.06)


def _amplitude(log: Log, frequency: float) -> float:
    """Mean amplitude at the place of the model over six periods of steady waves."""
    stroke = np.abs(log.columns["wave_maker_position"])
    start = log.time[np.argmax(stroke > 0.05 * stroke.max())]
    # deep-water group speed g / (2 w) over the 7 m to the model, then 8 periods to settle
    period, group_speed = 2 * math.pi / frequency, 9.81 / (2 * frequency)
    first = start + 7.0 / group_speed + 8 * period
    steady = log.select((log.time > first) & (log.time < first + 6 * period))
    probes = [steady.columns[f"wave_elevation_{k}"].std() for k in (4, 6)]
    return math.sqrt(2.0) * float(np.mean(probes))


def test_flume_waves_have_the_stated_height_and_frequency(runs: list[Log]) -> None:
    """Wave-only runs: amplitude 0.012 or 0.020 m within 5 %, frequency within 0.3 %."""
    alone = [log for log in runs if not log.has("position")]
    assert (len(runs), len(alone)) == (17, 7)
    for log in alone:
        wave = log.meta["wave"]
        spectrum_size = 8 * log.rows
        probe = log.columns["wave_elevation_4"] * np.hanning(log.rows)
        peak = np.argmax(np.abs(np.fft.rfft(probe, spectrum_size)))
        step = np.median(np.diff(log.time))
        frequency = 2 * math.pi * peak / (spectrum_size * step)
        assert frequency == pytest.approx(wave["angular_frequency"], rel=3e-3)
        amplitude = _amplitude(log, wave["angular_frequency"])
        assert amplitude == pytest.approx(wave["nominal_height"] / 2, rel=0.05)


def test_flume_model_runs_have_every_channel(runs: list[Log]) -> None:
    """200 Hz, about 60 s; sway, heave, roll, springs and three accelerometers."""
    model = [log for log in runs if log.has("position")]
    assert len(model) == 10
    for log in model:
        assert np.median(np.diff(log.time)) == pytest.approx(0.005, rel=1e-3)
        assert np.ptp(log.time) == pytest.approx(61.0, abs=4.0)
        assert log.channel("heave_acceleration").shape[1] == 2
        assert log.channel("spring_tension").shape[1] == 2
        assert log.meta["vehicle"]["mass"] == 46.8


@pytest.mark.thorough
def test_real_logs_pass_the_check(
    drops: list[Log], runs: list[Log], flights: list[Log], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No published log is refused: the check does not mistake real data for broken data."""
    logs = [*drops, *runs, *flights]
    for reader, folder in (
        (ReaderBalls(), "falling-balls"),
        (ReaderPendulum(), "single-pendulum"),
        (ReaderGlider(), "slocum-glider"),
    ):
        logs += _logs(reader, folder, monkeypatch)
    assert len(logs) == 49
    for log in logs:
        assert not [found for found in check_log(log) if found.severity is Severity.REFUSE]


@pytest.mark.thorough
def test_a_lost_link_is_the_only_bad_log_of_the_nanobench_flights(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One flight goes on in straight lines from 36.85 s; clocks are within 25 ms in the others."""
    from seals.logs import check_log
    from seals.logs.time_offset import time_offset
    from seals.plugins.readers.nanobench import ReaderNanobench

    bad = {}
    for log in _logs(ReaderNanobench(), "nanobench", monkeypatch):
        for finding in check_log(log):
            if finding.severity.value == "refuse":
                bad[log.name] = (finding.code, finding.where)
        offset = time_offset(log)
        assert offset is not None
        assert abs(offset.late) < 0.025
    assert bad == {"B9_trefoil_medium_rep13": ("filled", pytest.approx(36.85, abs=0.02))}
