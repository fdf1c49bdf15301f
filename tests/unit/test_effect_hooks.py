"""Hooks take what they name; those of other names get the plain arguments by their order."""

from __future__ import annotations

from typing import Any

import pytest

from seals.effects.binding import bind_effects
from seals.effects.effect import Effect
from seals.effects.hooks import POSITIONAL, arguments_of, names_any, pick_of
from seals.errors import ConfigError


class Plain:
    """A law with the plain arguments."""

    @staticmethod
    def loads(motion: Any, medium: Any, inputs: Any, memory: Any, params: Any) -> Any:
        """Return what it was given."""
        return motion, medium, inputs, memory, params


class Renamed:
    """A law that calls its plain arguments otherwise, and is no static method."""

    def loads(self, m: Any, _medium: Any, u: Any, state: Any, p: Any) -> Any:
        """Return what it was given."""
        return m, _medium, u, state, p


class Few:
    """A law that names few arguments in an order of its own."""

    @classmethod
    def joint_loads(cls, params: Any, medium: Any, joints: Any) -> Any:
        """Return what it was given."""
        return params, medium, joints


class Any_:
    """A law that takes whatever comes."""

    @staticmethod
    def joint_loads(*given: Any) -> Any:
        """Return what it was given."""
        return given


class Strange(Effect):
    """An effect that asks for what no hook is given."""

    @staticmethod
    def loads(motion: Any, weather: Any) -> Any:
        """Never called."""
        raise AssertionError


OFFERED = ("motion", "medium", "joints", "inputs", "memory", "params")


@pytest.mark.parametrize(
    ("law", "hook", "expected"),
    [
        (Plain(), "loads", ("motion", "medium", "inputs", "memory", "params")),
        (Renamed(), "loads", ("motion", "medium", "inputs", "memory", "params")),
        (Few(), "joint_loads", ("params", "medium", "joints")),
        (Any_(), "joint_loads", ("joints", "inputs", "memory", "params")),
    ],
)
def test_a_hook_gets_what_it_names(law: Any, hook: str, expected: tuple[str, ...]) -> None:
    """By name where all names are known, otherwise by the plain order."""
    assert arguments_of(law, hook) == expected
    assert getattr(law, hook)(*pick_of(law, hook)(OFFERED)) == expected


def test_dear_arguments_are_known_to_be_named() -> None:
    """Motion and medium at the joints are made for hooks that name them."""
    assert names_any(Few(), "joint_loads", ("motion", "medium"))
    assert not names_any(Any_(), "joint_loads", ("motion", "medium"))


def test_a_strange_argument_is_refused_when_effects_are_bound() -> None:
    """The refusal names the effect, the argument and what there is."""
    with pytest.raises(ConfigError, match=r"effects.odd: Strange.loads takes 'weather'") as found:
        bind_effects({"odd": Strange()}, ["base"])
    assert "joints, inputs, memory, params" in str(found.value)


def misspelt(hook: str, *names: str) -> Any:
    """Return an effect whose hook has arguments of some names."""
    space: dict[str, Any] = {}
    exec(f"def {hook}({', '.join(names)}): ...", space)
    return type("Typo", (), {hook: staticmethod(space[hook])})()


@pytest.mark.parametrize(
    ("hook", "names", "wrong", "meant"),
    [
        ("joint_loads", ("joint", "medium", "memory", "params"), "joint", "joints"),
        ("joint_loads", ("joints", "mediun", "memory", "params"), "mediun", "medium"),
        ("loads", ("motion", "medium", "joint", "memory", "params"), "joint", "joints"),
        ("loads", ("motion", "_joints", "inputs", "memory", "params"), "_joints", "joints"),
        ("loads", ("moton", "params"), "moton", "motion"),
    ],
)
def test_a_misspelt_argument_is_not_taken_by_its_place(
    hook: str, names: tuple[str, ...], wrong: str, meant: str
) -> None:
    """As many arguments as the plain hook has do not hide a misspelt one."""
    with pytest.raises(ConfigError, match=f"takes '{wrong}'.*\\n.*Did you mean '{meant}'"):
        arguments_of(misspelt(hook, *names), hook)


@pytest.mark.parametrize(
    ("hook", "names"),
    [
        ("loads", ("motion", "medium", "_inputs", "memory", "params")),
        ("loads", ("state", "fluid", "u", "kept", "values")),
        ("joint_loads", ("q", "_", "memory", "p")),
        ("joint_loads", ("joint", "inputs", "mem", "param")),
        ("drive_loads", ("rotors", "motion", "medium", "u", "memory", "params")),
    ],
)
def test_plain_arguments_may_have_names_of_their_own(hook: str, names: tuple[str, ...]) -> None:
    """Names that resemble no argument of another place are given by their order."""
    assert arguments_of(misspelt(hook, *names), hook) == POSITIONAL[hook]
