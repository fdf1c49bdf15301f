"""What stands beside a log: data sheets of robots, healthy flights, models to be verified."""

from __future__ import annotations

import os
import re
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml

from seals.config.overlay import read_overlay
from seals.errors import ConfigError, LogError, SealsError
from seals.logs import Log
from seals.logs.check_meta import check_meta
from seals.logs.native import read_native
from seals.logs.shipped import shipped_logs
from seals.run.equipment_metadata import DATASHEET, datasheet_of
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.healthy_flights.balance import layout_of
from seals.sysid.validation.drawing import draw_ablation

FINE: dict[str, Any] = {
    "sensors": {
        "imu": {"position": [0.0, 0.0, 0.0], "orientation": [1.0, 0.0, 0.0, 0.0]},
        "channels": {"position": {"sigma": 0.01, "rate": 100.0}},
    },
    "tolerance": {"mass": {"sigma": 0.01}},
    "disturbance": {"force_sigma": 0.0, "torque_sigma": 0.0, "correlation_time": 0.3},
    "simulated": {"step": 0.01},
}


def channel(sigma: Any) -> dict[str, Any]:
    """Sheet of one channel."""
    return {"sensors": {"channels": {"position": {"sigma": sigma}}}}


SHEETS: dict[str, dict[str, Any]] = {
    "sensors as list": {"sensors": [1]},
    "sensors as text": {"sensors": "imu"},
    "channels as text": {"sensors": {"channels": "position"}},
    "channel as number": {"sensors": {"channels": {"position": 0.1}}},
    "noise as text": channel("small"),
    "noise below zero": channel(-0.1),
    "noise of zero": channel(0.0),
    "no noise": channel(float("nan")),
    "noise of truth": channel(True),
    "sensor without attitude": {"sensors": {"imu": {"orientation": [0.0, 0.0, 0.0, 0.0]}}},
    "sensor that stretches": {"sensors": {"imu": {"orientation": [3.0, 0.0, 0.0, 0.0]}}},
    "attitude as text": {"sensors": {"imu": {"orientation": "north"}}},
    "place of two": {"sensors": {"imu": {"position": [0.0, 0.0]}}},
    "sensor as list": {"sensors": {"imu": [1]}},
    "tolerance as list": {"tolerance": [1]},
    "tolerance as number": {"tolerance": {"mass": 0.1}},
    "tolerance below zero": {"tolerance": {"mass": {"sigma": -0.1}}},
    "gusts as text": {"disturbance": {"force_sigma": "strong"}},
    "gusts below zero": {"disturbance": {"force_sigma": -1.0}},
    "gusts of no time": {"disturbance": {"correlation_time": 0.0}},
    "step of zero": {"simulated": {"step": 0.0}},
    "step as text": {"simulated": {"step": "x"}},
    "starts as number": {"initial_state": 5},
    "effects without names": {"baseline": [{"law": "x"}]},
    "weight as text": {"environment": {"gravity": "down"}},
    "lookup": {"motors": {"command": "${oc.env:HOME}"}},
}


@pytest.mark.parametrize("name", SHEETS)
def test_an_odd_data_sheet_is_refused(name: str, tmp_path: Path) -> None:
    """It fills in what a log leaves out, and is checked as the log is; its own name is told."""
    (tmp_path / DATASHEET).write_text(yaml.safe_dump({**FINE, **SHEETS[name]}))
    with pytest.raises(SealsError, match=re.escape(DATASHEET)):
        datasheet_of(tmp_path)


def test_a_sound_data_sheet_is_read(tmp_path: Path) -> None:
    """Gusts of zero are sound, and a folder need not have a sheet."""
    assert datasheet_of(tmp_path) == {}
    (tmp_path / DATASHEET).write_text(yaml.safe_dump(FINE))
    assert datasheet_of(tmp_path) == FINE


@pytest.mark.parametrize("kind", ["pipe", "folder", "loop", "nowhere"])
def test_a_data_sheet_is_an_ordinary_file(kind: str, tmp_path: Path) -> None:
    """What is there and cannot be read is told, not taken for a robot without a sheet."""
    sheet = tmp_path / DATASHEET
    if kind == "pipe":
        os.mkfifo(sheet)
    elif kind == "folder":
        sheet.mkdir()
    else:
        sheet.symlink_to(sheet if kind == "loop" else tmp_path / "nothing")
    with pytest.raises(LogError, match=re.escape(DATASHEET)):
        datasheet_of(tmp_path)


def test_a_log_is_checked_without_a_vehicle_too() -> None:
    """A converted log gets its vehicle from robot=; its sensors and tolerances are its own."""
    log = Log(name="a", columns={"t": np.zeros(1)}, meta={"tolerance": {"mass": {"sigma": -1.0}}})
    assert [one.channel for one in check_meta(log)] == ["tolerance.mass.sigma"]


def test_healthy_flights_carry_a_weight() -> None:
    """Without gravity drives carry nothing that could be compared (it was nan, and a warning)."""
    log = read_native(shipped_logs()["hidden_effect/flight_b"])
    around = {**log.meta["environment"], "gravity": [0.0, 0.0, 0.0]}
    with pytest.raises(LogError, match="states a gravity of zero"):
        layout_of(read_vehicle({**log.meta, "environment": around}), log)


@pytest.mark.parametrize("confidence", [5, "payload", ["payload"], True, 0.5])
def test_a_model_notes_confidence_by_effect(confidence: Any) -> None:
    """``verify`` wrote its answer and ended in a traceback, where the note was a number."""
    raw = {"effects": {}, "provenance": {"confidence": confidence}}
    with pytest.raises(ConfigError, match=r"provenance\.confidence=.*\nAllowed: a mapping"):
        read_overlay(raw)


NAMES = ["\x1b[2J", "a\nb", "\x07", "\u202ea", "\x00", "\u2028b", "\x9b2K", "\r", "\x85", "\ufeffa"]


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_odd_names_of_effects_are_drawn_without_a_word(name: str, tmp_path: Path) -> None:
    """Signs that no font has made the chart of ``verify`` warn on the console."""
    steps = [SimpleNamespace(model=SimpleNamespace(name=name), level=k + 1.0) for k in range(2)]
    ablation = SimpleNamespace(variants=steps, name=name)
    found: Any = SimpleNamespace(
        ablation=ablation, word="withdrawn", overlay=SimpleNamespace(name=name)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        draw_ablation(tmp_path / "a.png", found)
    assert (tmp_path / "a.png").is_file()
