"""Checkpoints of trainings by strangers: refused in words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("torchrl")

from seals.errors import ConfigError  # noqa: E402  only where there is PyTorch
from seals.learn.training.checkpoint import FILE, write_checkpoint  # noqa: E402
from seals.learn.training.loop import take_up  # noqa: E402  likewise
from tests.unit.test_learn_training import LEARNERS, losses, training_of  # noqa: E402

Change = Callable[[dict[str, Any]], Any]


def entry(*path: str, value: Any) -> Change:
    """Return a forgery: another value at a place of the state."""

    def change(state: dict[str, Any]) -> None:
        for name in path[:-1]:
            state = state[name]
        assert path[-1] in state
        state[path[-1]] = value(state[path[-1]]) if callable(value) else value

    return change


def first(change: Callable[[Any], Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return a function that changes the first entry of a mapping."""
    return lambda part: {
        name: change(value) if number == 0 else value
        for number, (name, value) in enumerate(part.items())
    }


def more(tensor: Any) -> Any:
    """Return a tensor of another shape."""
    return torch.cat([tensor, tensor])


def _repeated(rows: Any, times: int) -> Any:
    if hasattr(rows, "items"):
        return {name: _repeated(part, times) for name, part in rows.items()}
    return torch.cat([rows] * times)


def _doubled(part: Any) -> Any:
    if isinstance(part, dict):
        return {name: _doubled(one) for name, one in part.items()}
    if isinstance(part, list | tuple):
        return type(part)(map(_doubled, part))
    return more(part) if hasattr(part, "shape") and part.ndim else part


FORGERIES: dict[str, tuple[Change, str]] = {
    "weights of another shape": (
        entry("agent", "nets", "modules", "actor", value=first(more)),
        "array",
    ),
    "weights of another kind": (
        entry("agent", "nets", "modules", "actor", value=first(lambda w: w.double())),
        "array float64",
    ),
    "weights that are texts": (
        entry("agent", "nets", "modules", "actor", value=first(lambda w: "x" * 9)),
        "is an entry str",
    ),
    "no actor": (
        entry("agent", "nets", "modules", value=lambda m: {"critics": m["critics"]}),
        "no entry",
    ),
    "an agent that is a list": (entry("agent", value=lambda agent: [agent]), "is an entry list"),
    "optimisers without parameters": (
        entry("agent", "nets", "optimisers", value=first(lambda o: {**o, "param_groups": []})),
        "parameter group",
    ),
    "steps of a text": (entry("place", "step", value="soon"), "is an entry str"),
    "no place": (entry("place", value=None), "is an entry NoneType"),
    "a place of other rows": (entry("place", "next", value={}), "no entry"),
    "a generator of another size": (entry("random", value=more), "array uint8"),
    "a memory of a billion": (entry("agent", "memory", "protected", value=10**9), "protected"),
    "a memory of less than none": (entry("agent", "memory", "protected", value=-1), "protected"),
    "a next row behind the last": (entry("agent", "memory", "cursor", value=10**6), "next at"),
    "more rows than there is room for": (
        entry("agent", "memory", "rows", value=lambda rows: _repeated(rows, 100)),
        "transitions",
    ),
    "rows of other lengths": (entry("agent", "memory", "rows", value=first(more)), "size|shape"),
    "no rows at all": (entry("agent", "memory", "rows", value={}), "cannot be resumed"),
    "environments of another count": (
        entry("environment", value=_doubled),
        "array",
    ),
}


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Keep a training after some updates."""
    training = training_of(LEARNERS["sac"], tmp_path_factory.mktemp("trained"))
    losses(training, 3)
    return training


@pytest.mark.parametrize("name", ["as it was", *FORGERIES])
def test_forged_trainings_are_refused(trained: Any, tmp_path: Path, name: str) -> None:
    """The digest is right in each; the training at hand says what can be."""
    state = {**trained.state(), "config": "0"}
    fresh = training_of(LEARNERS["sac"], tmp_path)
    if name == "as it was":
        write_checkpoint(tmp_path, state)
        assert take_up(fresh, device="cpu") == []
        assert fresh.step == trained.step
        return
    change, words = FORGERIES[name]
    change(state)
    write_checkpoint(tmp_path, state)
    with pytest.raises(ConfigError, match=words) as refusal:
        take_up(fresh, device="cpu")
    assert f"{FILE} cannot be resumed" in str(refusal.value)
