"""A rigid-body scene that nobody closed ends with the last that holds it."""

from __future__ import annotations

import gc

import pytest

from seals.errors import SealsError
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings

pybullet = pytest.importorskip("pybullet", reason="no wheel of PyBullet for this interpreter")


def settings(*more: str) -> RunSettings:
    """A ball in the air."""
    return run_settings(["robot=ball", "initial.position=[0,0,1]", *more])


def scenes() -> int:
    """Number of scenes of the engine that are open in this process."""
    gc.collect()
    return sum(pybullet.isConnected(physicsClientId=k) for k in range(1024))


def test_a_refused_world_leaves_no_scene() -> None:
    """Every refusal after the scene was opened would cost 30 MB."""
    before = scenes()
    for _ in range(3):
        with pytest.raises(SealsError, match="needs four rotors"):
            build_world(settings("guide=hover", "controller=cascade"))
    assert scenes() == before


def test_a_body_keeps_its_scene() -> None:
    """A world that was let go of stays open as long as one of its robots is asked."""
    before = scenes()
    actor = build_world(settings()).actors["robot"]
    assert scenes() == before + 1
    assert actor.body.read().position[2] == pytest.approx(1.0)
    del actor
    assert scenes() == before
