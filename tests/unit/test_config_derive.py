"""A plug-in's own dataclass is its schema."""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from omegaconf import OmegaConf
from omegaconf.errors import ConfigAttributeError, ValidationError

from seals import registry
from seals.config.build import build
from seals.config.derive import derive, schema_of
from seals.errors import BrokenPlugin, ConfigError
from seals.schema import optional, param, vector

Install = Callable[[str, str, dict[str, str]], Path]


class Colour(enum.Enum):
    """A closed set."""

    red = "red"
    blue = "blue"


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A nested, frozen part."""

    stiffness: float = param(5.0, "N/m", bounds=(0.0, 10.0), tolerance=0.1, source="chosen")


@dataclass(frozen=True, kw_only=True)
class Gadget:
    """A plug-in with a field of every allowed type."""

    mass: float = param(1.0, "kg", bounds=(0.1, 9.0), tolerance=0.1, source="chosen")
    depth: float | None = optional("m", bounds=(0.0, 10.0), source="chosen")
    axis: list[float] = vector((0.0, 0.0, 1.0), "1", bounds=(-1.0, 1.0), source="chosen")
    size: tuple[float, float] = (1.0, 2.0)
    count: int = 3
    colour: Colour = Colour.red
    spring: Spring = field(default_factory=Spring)
    springs: dict[str, Spring] = field(default_factory=dict)
    links: list[str] = field(default_factory=lambda: ["root"])
    places: list[list[float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Refuse what bounds cannot say."""
        if self.count == 13:
            raise ConfigError("count=13 brings bad luck.\nAllowed: any other number")


def node(**values: object) -> object:
    """Compose a node of Gadget's schema under the key that a run would use."""
    root = OmegaConf.create({"effects": {"gadget": OmegaConf.structured(derive(Gadget))}})
    for key, value in values.items():
        OmegaConf.update(root, f"effects.gadget.{key}", value, merge=True, force_add=True)
    return root.effects.gadget


def test_built_object_is_the_plugin_itself() -> None:
    """Types survive the way through the configuration: enum, tuple, nested frozen dataclass."""
    built = build(
        node(colour="blue", size=[3, 4], springs={"left": {"stiffness": 2}}), where="effects.gadget"
    )
    expected = Gadget(colour=Colour.blue, size=(3.0, 4.0), springs={"left": Spring(stiffness=2.0)})
    assert built == expected


def test_whole_numbers_are_numbers_in_rows_too() -> None:
    """Rows of numbers may hold whole ones, beside others."""
    built = build(node(places=[[0, 0, -3], [1, 0.5, -3]]), where="effects.gadget")
    assert built.places == [[0.0, 0.0, -3.0], [1.0, 0.5, -3.0]]
    assert all(type(number) is float for row in built.places for number in row)


def test_schema_is_open_to_change_although_the_class_is_frozen() -> None:
    """A frozen plug-in class does not make its configuration read-only."""
    config = OmegaConf.structured(derive(Gadget))
    config.mass = 2
    config.spring.stiffness = 3
    assert (config.mass, config.spring.stiffness) == (2.0, 3.0)


def test_schema_refuses_unknown_keys_and_wrong_types() -> None:
    """The derived schema is typed."""
    config = OmegaConf.structured(derive(Gadget))
    with pytest.raises(ConfigAttributeError):
        config.mss = 2
    with pytest.raises(ValidationError):
        config.mass = "heavy"


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"mass": 0.0}, "effects.gadget.mass=0.0"),
        ({"mass": float("nan")}, "effects.gadget.mass=nan"),
        ({"mass": float("inf")}, "effects.gadget.mass=inf"),
        ({"depth": -1.0}, "effects.gadget.depth=-1.0"),
        ({"axis": [0.0, 0.0, 2.0]}, "effects.gadget.axis[2]=2.0"),
        ({"axis": [0.0, 1.0]}, "effects.gadget.axis=[0.0, 1.0] has 2 numbers"),
        ({"size": [1.0, 2.0, 3.0]}, "effects.gadget.size=[1.0, 2.0, 3.0] has 3 entries"),
        ({"size": [1.0, float("nan")]}, "effects.gadget.size[1]=nan"),
        ({"spring": {"stiffness": 11.0}}, "effects.gadget.spring.stiffness=11.0"),
        ({"springs": {"left": {"stiffness": -1.0}}}, "effects.gadget.springs.left.stiffness=-1.0"),
        ({"mss": 1.0}, "effects.gadget.mss"),
        ({"places": [[0, 1], [0, "x"]]}, "effects.gadget.places[1][1]=x is not allowed"),
        ({"count": 13}, "brings bad luck"),
        ({"mass": "???"}, "effects.gadget.mass has no value"),
        ({"_target_": "os.system"}, "effects.gadget._target_=os.system is not allowed"),
    ],
)
def test_refusal_names_the_full_key(values: dict[str, object], key: str) -> None:
    """Bounds, finiteness, length and unknown keys are refused with the full key."""
    with pytest.raises(ConfigError) as refusal:
        build(node(**values), where="effects.gadget")
    assert key in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 2


def test_node_without_schema_is_refused() -> None:
    """A hand-written _target_ is not a plug-in."""
    bare = OmegaConf.create({"_target_": "os.getcwd"})
    with pytest.raises(ConfigError, match="without the schema of a plug-in"):
        build(bare, where="effects.bare")
    with pytest.raises(ConfigError, match="names no plug-in"):
        build(3, where="effects.bare")


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("class Tide:\n    pass", "is not a dataclass"),
        (
            "from dataclasses import dataclass\n@dataclass\nclass Tide:\n    height: float = 1.0",
            "fields height are not keyword-only",
        ),
        (
            "from __future__ import annotations\nfrom dataclasses import dataclass\n"
            "@dataclass(kw_only=True)\nclass Tide:\n    height: Unknown = 1.0",
            "Unknown",
        ),
    ],
)
def test_unfit_class_is_a_broken_plugin(install: Install, source: str, reason: str) -> None:
    """A plug-in that is no keyword-only typed dataclass is refused in words."""
    install("tide-reef", "[seals.effects]\ntide = tide_reef:Tide", {"tide_reef.py": source})
    with pytest.raises(BrokenPlugin, match=reason):
        schema_of(registry.get("effect", "tide"))


def test_every_installed_class_has_a_schema() -> None:
    """Every installed plug-in yields a schema that OmegaConf accepts."""
    for kind in registry.GROUPS:
        if kind in registry.FOLDER_KINDS:
            continue
        for name, plugin in registry.plugins(kind).items():
            assert "_target_" in OmegaConf.structured(schema_of(plugin)), f"{kind} {name}"
