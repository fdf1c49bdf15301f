"""Fuzz targets: loaders of files that SEALS writes itself."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import struct
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz_targets import Target

_MODEL = (
    "summary: a found drag\n"
    "effects:\n  drag: {effect: quadratic_drag, medium: water, coefficient_x: 2.0}\n"
    "changes:\n  lift: {effect: buoyancy, volume_change: 0.001}\n"
    "wave: {wave: airy, amplitude: 0.1}\n"
    "intervals: {drag: {coefficient_x: [1.5, 2.5]}}\n"
    "nominal: {mass: {value: 0.1, sd: 0.02, alone: 0.3}}\nspeeds: [0.5, 1.0]\n"
    "provenance: {log: flight_a, verdict: named}\n"
)
_MANOEUVRE = (
    "kind: manoeuvre\nname: up and down\nwords: w\neffects: [payload]\nstep: 0.01\ntilt: 0.4\n"
    "runs:\n- {spacing: 0.1, x: [0, 0, 0, 0], y: [0, 0, 0, 0], z: [0, 1, 2, 3], "
    "yaw: [0, 0, 0, 0], joints: [], voltage: 16}\nmeta: {vehicle: {name: a, mass: 1.5}}\n"
)
_ANSWER = {
    "verdict": "named",
    "effects": [{"name": "payload", "parameters": {"mass": {"value": 0.3, "unit": "kg"}}}],
    "ambiguous_with": [["payload", "thrust_coefficient"]],
    "nominal": {"mass": {"value": 0.1}},
    "log": {"path": "flight_a", "sha256": "0" * 64},
    "reasons": ["because"],
    "formula": None,
}
_RUN = (
    *("run", "robot=ball", "backend=free", "time.duration=0.1", "time.step=0.01"),
    *("checkpoint=1e-9", "water=none"),
)


def _model() -> Target:
    from seals.config.overlay import load_overlay, read_overlay

    return Target(
        whole=_MODEL.encode(), name="a.yaml", load=lambda path: read_overlay(load_overlay(path))
    )


def _manoeuvre() -> Target:
    from seals.sysid.experiment_design.experiment import KIND, read_experiment

    text = _MANOEUVRE.replace("kind: manoeuvre", f"kind: {KIND}")
    return Target(whole=text.encode(), name="a.yaml", load=read_experiment)


def _answer() -> Target:
    from seals.sysid.validation.answer import load_answer, read_answer

    def load(path: Path) -> None:
        load_answer(path)
        read_answer(path)

    return Target(whole=json.dumps(_ANSWER).encode(), name="diagnosis.json", load=load)


def _run_folder(*more: str) -> Path:
    """Make a run; with words that let it fail, its last checkpoint stays."""
    from seals.cli.main import main

    place = Path(tempfile.mkdtemp(prefix="fuzz_run_")) / "run"
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        main([*_RUN, *more, f"hydra.run.dir={place}"])
    return place


def _run(name: str) -> Target:
    from seals.view import open_replay

    kept = (".hydra/config.yaml", "run.json", "meta.yaml", "log.parquet")
    return _of_folder(_run_folder(), name, open_replay, kept)


def _of_folder(
    place: Path, name: str, load: Callable[[Path], Any], kept: Iterable[str] = ()
) -> Target:
    """Return the target of one file of a folder; beside it lie those that are kept, or all."""
    files = kept or [p.relative_to(place).as_posix() for p in place.rglob("*") if p.is_file()]
    beside = {one: (place / one).read_bytes() for one in files}
    return Target(whole=beside.pop(name), name=name, load=load, beside=beside, folder=True)


def _state() -> Target:
    """The checkpoint of a run, taken up in a world of the same settings."""
    from seals.run.assembly import build_world
    from seals.run.build import run_settings
    from seals.run.checkpoint import STATE, take_up, write_checkpoint

    settings = run_settings([w for w in _RUN if w != "run"])
    place = Path(tempfile.mkdtemp(prefix="fuzz_state_")) / "checkpoint"
    world = build_world(settings)
    write_checkpoint(place, world, {"rows": [1.0, 2.0], "note": "a"})

    def load(folder: Path) -> None:
        _sign(folder / STATE)
        take_up(folder, world)

    return _of_folder(place, STATE, load)


def _training() -> Target:
    import torch

    from seals.learn.training.checkpoint import FILE, read_checkpoint, write_checkpoint

    place = Path(tempfile.mkdtemp(prefix="fuzz_training_"))
    write_checkpoint(place, {"agent": {"w": torch.ones(3, 4)}, "place": {"step": 5}})

    def load(folder: Path) -> None:
        _sign(folder / FILE)
        read_checkpoint(folder, device="cpu")

    return _of_folder(place, FILE, load, [FILE])


def _sign(file: Path) -> None:
    """Give a damaged state the lengths and the digest that belong to it: its content is read."""
    raw = file.read_bytes()
    if len(raw) < _BEGIN:
        return
    magic, version, text, _ = _HEAD.unpack_from(raw)
    text = min(text, len(raw) - _BEGIN)
    head = _HEAD.pack(magic, version, text, len(raw) - _BEGIN - text)
    digest = hashlib.blake2b(head + raw[_BEGIN:], digest_size=_DIGEST).digest()
    file.write_bytes(head + digest + raw[_BEGIN:])


_HEAD, _DIGEST = struct.Struct("<8sIQQ"), 32
_BEGIN = _HEAD.size + _DIGEST


def _words() -> Target:
    """The overrides that a training is taken up with."""
    from seals.cli.train import _begun

    words = b"- env=reach\n- learner=sac\n- course.steps=500\n"
    return Target(whole=words, name=".hydra/overrides.yaml", load=_begun, folder=True)


def _table() -> Target:
    from seals.learn.comparison.runs import EVALUATION, read_run

    text = "step,success,return\n" + "".join(f"{100 * k},0.{k},{k}.5\n" for k in range(9))
    facts = {"run.json": b'{"seed": 1, "state": "done"}'}
    return Target(
        whole=text.encode(),
        name=EVALUATION,
        load=lambda folder: read_run(folder, arm="a"),
        beside=facts,
        folder=True,
    )


def _policy(name: str) -> Target:
    import torch

    from seals.learn.metadata import config_hash
    from seals.learn.networks import actor_of, description
    from seals.learn.policy import load_policy, save_policy

    network = description(observation=5, action=2, hidden=[8, 8], layer_norm=True)
    card = {"env": "Toy-v0", "config_hash": config_hash({}), "learner": "sac", "seed": 1}
    place = Path(tempfile.mkdtemp(prefix="fuzz_policy_")) / "policy"
    save_policy(place, network=network, tensors=actor_of(network).state_dict(), metadata=card)

    def load(folder: Path) -> None:
        load_policy(folder).act(torch.zeros(1, 5))

    return _of_folder(place, name, load)


def _demonstrations() -> Any:
    from seals.learn.demonstrations.episode import Demonstrations, Episode, Origin, Who
    from seals.learn.metadata import config_hash

    last = np.arange(6) == 5
    episode = Episode(
        observation=np.ones((7, 4), np.float32),
        action=np.zeros((6, 2), np.float32),
        reward=np.ones(6, np.float32),
        terminated=last,
        truncated=last & False,
        success=True,
        seed=3,
    )
    origin = Origin(
        env="Toy-v0",
        config_hash=config_hash({"a": 1}),
        who=Who.scripted,
        by="expert",
        observation=["x", "y", "vx", "vy"],
        action=["ax", "ay"],
        rate=25.0,
        config={"a": 1},
    )
    return Demonstrations(origin=origin, episodes=[episode, episode])


def _recording(name: str) -> Target:
    from seals.learn.demonstrations.folder import read, write

    place = write(_demonstrations(), Path(tempfile.mkdtemp(prefix="fuzz_demo_")) / "demo")
    return _of_folder(place, name, read)


def _new_robot() -> Target:
    """A URDF on its way into a robot's folder."""
    from benchmarks.fuzz_targets import URDF
    from seals.scaffold.robot import scaffold_robot

    def load(path: Path) -> None:
        import shutil

        shutil.rmtree(path.parent / "made", ignore_errors=True)
        scaffold_robot("made", path, parent=path.parent)

    return Target(whole=URDF.encode(), name="a.urdf", load=load)


STORED: dict[str, Callable[[], Target]] = {
    "model": _model,
    "manoeuvre": _manoeuvre,
    "answer": _answer,
    "run_config": lambda: _run(".hydra/config.yaml"),
    "run_json": lambda: _run("run.json"),
    "state": _state,
    "training": _training,
    "words": _words,
    "table": _table,
    "card": lambda: _policy("card.json"),
    "weights": lambda: _policy("policy.safetensors"),
    "demo_card": lambda: _recording("card.json"),
    "demo_steps": lambda: _recording("episodes.safetensors"),
    "new_robot": _new_robot,
}
"""Loaders of models, plans, answers, runs, trainings, policies and demonstrations by name."""
