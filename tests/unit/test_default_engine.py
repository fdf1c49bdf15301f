"""The engine of whoever names none: PyBullet where it is installed, else MuJoCo."""

from __future__ import annotations

import importlib.util
from typing import Any

import pytest

from seals import registry
from seals.config.compose import compose

ROOTS = (("run", "robot=ball"), ("learn", "env=crab_walk"))


@pytest.fixture(params=[True, False])
def installed(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Let PyBullet be found, or not."""
    found = importlib.util.find_spec

    def find(name: str, package: str | None = None) -> Any:
        return request.param or None if name == "pybullet" else found(name, package)

    monkeypatch.setattr(importlib.util, "find_spec", find)
    return bool(request.param)


@pytest.mark.parametrize(("root", "word"), ROOTS)
def test_recipes_take_the_engine_that_is_there(installed: bool, root: str, word: str) -> None:
    """Runs and tasks that touch things are composed with the engine at hand."""
    wanted = "BackendPybullet" if installed else "BackendMujoco"
    assert registry.default_backend() == ("pybullet" if installed else "mujoco")
    assert compose([word], root=root).backend._target_.endswith(wanted)


def test_a_named_engine_is_taken(installed: bool) -> None:
    """What is said rules over what is there."""
    assert compose(["robot=ball", "backend=mujoco"]).backend._target_.endswith("BackendMujoco")
