"""Candidates derived from nothing but a law and its parameters."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from seals import registry
from seals.arrays import Array
from seals.effects.derived import default_additions, dimension, plausible_scale
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Identification, Subject
from seals.errors import BrokenPlugin
from seals.motion import Inputs, Medium, Motion, Reading, Wrench
from seals.schema import param
from seals.sysid.candidates.catalogue import installed
from seals.sysid.data.vehicle import read_vehicle


@dataclass(kw_only=True)
class Push(Effect):
    """A force whose default acts, with a shape beside its strength."""

    strength: float = param(0.5, "N s/m", bounds=(0.0, 9.0), tolerance=0.1, source="a test")
    width: float = param(0.3, "m", bounds=(0.1, 1.0), tolerance=0.1, source="a test")
    medium: MediumKind = MediumKind.air

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """No force: only its fields matter here."""
        return Wrench(None, None), memory


@dataclass(kw_only=True)
class Shaped(Push):
    """The same with a declaration."""

    identification: ClassVar[Identification] = Identification(
        scales={"strength": 2.0, "width": 0.2}, starts=((1.0, 0.0),)
    )


@dataclass(kw_only=True)
class Hinge(Effect):
    """A fault of each joint."""

    slip: float = param(0.0, "rad", bounds=(-1.0, 1.0), tolerance=0.01, source="a test")
    joint: int = 0

    @staticmethod
    def joint_loads(
        joints: Any, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """No torque."""
        return joints.velocity * 0.0, memory


@dataclass(kw_only=True)
class WetHinge(Hinge):
    """A fault of each joint in a medium."""

    medium: MediumKind = MediumKind.air


@dataclass(kw_only=True)
class Gust(Push):
    """A force that goes with one rotor and a medium."""

    rotor: int = 1


@dataclass(kw_only=True)
class Needy(Effect):
    """A sensor fault that cannot be built without an option."""

    bias: float = param(0.0, "rad/s", bounds=(-1.0, 1.0), tolerance=0.01, source="a test")
    axis: int

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """The same reading."""
        return reading


def subject(joints: int = 0) -> Subject:
    """A body of 2 kg in air, with or without an arm."""
    arm = [
        {
            "name": f"part_{k}",
            "mass": 0.1,
            "centre_of_gravity": [0.0, 0.0, -0.05],
            "inertia": np.diag([1e-4, 1e-4, 1e-5]).tolist(),
            "joint": {
                "name": f"hinge_{k}",
                "axis": [0, 1, 0],
                "lower": -1,
                "upper": 1,
                "origin": [0.0, 0.0, -0.1],
            },
        }
        for k in range(joints)
    ]
    body = {"mass": 2.0, "centre_of_gravity": [0, 0, 0], "inertia": (0.02 * np.eye(3)).tolist()}
    gains = {"kp": 9.0, "kd": 0.2, "torque_limit": 2.5, "armature": 0.002}
    held = {"base": body, "arm": {"links": arm, "controller": gains}} if joints else body
    log = {
        "vehicle": held,
        "environment": {"water_level": None},
        "baseline": [{"name": "gravity"}],
        "sensors": {"channels": {"position": {"sigma": 0.003}}},
        "tolerance": {},
    }
    return replace(read_vehicle(log), speeds=np.ones(3))


def test_a_strength_is_fitted_from_zero_and_a_shape_is_kept() -> None:
    """The default strength is switched off; the shape keeps its default."""
    (found,) = default_additions(Push, "push", subject())
    assert found.instance == "push_change"
    assert set(found.parameters) == {"strength"}
    effect: Any = found.effect
    assert (effect.strength, effect.width) == (0.0, 0.3)
    assert found.parameters["strength"].bounds == (0.0, 9.0)


def test_a_declaration_frees_the_shape_with_its_size() -> None:
    """Scales that are stated rule; changes are bounded about the default."""
    (found,) = default_additions(Shaped, "shaped", subject())
    assert {p: f.scale for p, f in found.parameters.items()} == {"strength": 2.0, "width": 0.2}
    assert found.parameters["width"].bounds == pytest.approx((-0.2, 0.7))
    assert found.starts == ((1.0, 0.0),)


def test_what_the_vehicle_lacks_is_no_candidate() -> None:
    """A medium, joints, a class that needs options."""

    @dataclass(kw_only=True)
    class Wet(Push):
        """In water only."""

        medium: MediumKind = MediumKind.water

    assert default_additions(Wet, "wet", subject()) == []
    assert default_additions(Hinge, "hinge", subject()) == []
    assert default_additions(Needy, "needy", subject()) == []


def test_a_joint_gives_a_variant_each() -> None:
    """Two joints, two candidates."""
    found = default_additions(Hinge, "hinge", subject(joints=2))
    assert [a.instance for a in found] == ["hinge_change_1", "hinge_change_2"]
    assert [a.variant for a in found] == [{"joint": 1.0}, {"joint": 2.0}]


def test_a_medium_beside_a_joint_or_rotor_keeps_a_variant_each() -> None:
    """One candidate a joint or rotor, each in the class's medium; none without rotors."""
    found = default_additions(WetHinge, "hinge", subject(joints=2))
    assert [a.instance for a in found] == ["hinge_change_1", "hinge_change_2"]
    effects: list[Any] = [a.effect for a in found]
    assert [(e.joint, e.medium) for e in effects] == [(1, MediumKind.air), (2, MediumKind.air)]
    flown = replace(subject(), lag=np.full(3, 0.05))
    gusts = default_additions(Gust, "gust", flown)
    assert [a.variant for a in gusts] == [{"rotor": 1.0}, {"rotor": 2.0}, {"rotor": 3.0}]
    assert default_additions(Gust, "gust", subject()) == []


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("N s^2/m^2", (1.0, -1.0, 0.0)),
        ("N m s/rad", (1.0, 2.0, -1.0)),
        ("kg m^2", (1.0, 2.0, 0.0)),
        ("1", (0.0, 0.0, 0.0)),
    ],
)
def test_units_are_read(unit: str, powers: tuple[float, float, float]) -> None:
    """Powers of mass, length and time; unknown units are none."""
    assert dimension(unit) == powers
    assert dimension("furlong") is None


def test_a_derived_size_grows_with_the_vehicle() -> None:
    """A tenth of m (g/l)^(1/2) for a drag coefficient, here with the radius of gyration 0.1 m."""
    assert subject().length == pytest.approx(0.1)
    assert plausible_scale(Push, "strength", subject()) == pytest.approx(
        0.1 * 2.0 * np.sqrt(9.81 / 0.1)
    )


def test_a_broken_package_does_not_stop_a_diagnosis(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is left out with a warning that names it."""
    plugin = registry.get("effect", "wind")

    def load(self: registry.Plugin) -> Any:
        if self.name == "wind":
            raise BrokenPlugin("no such module")
        return real(self)

    real = registry.Plugin.load
    monkeypatch.setattr(type(plugin), "load", load)
    with pytest.warns(UserWarning, match="'wind' is not a candidate"):
        found = installed()
    assert "wind" not in found
    assert "linear_drag" in found


def test_every_installed_effect_answers_for_any_vehicle() -> None:
    """No declaration fails, and instances differ."""
    made = subject(joints=2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        laws = installed()
    names = [a.instance for n, law in laws.items() for a in law.additions(n, made)]
    assert len(names) == len(set(names))
    assert {"wind", "tether", "mass_part_1", "joint_friction_2"} <= set(names)


def test_plausible_friction_grows_with_the_drive_of_its_joint() -> None:
    """An arm that gives 150 N m may rub by 1.9 N m; one of 2 N m, and one without a limit, less."""
    made = replace(
        subject(joints=3),
        servo={"kp": np.array([2000.0, 2.0, 40.0]), "torque_limit": np.array([150.0, 4.0, 1e6])},
    )
    added = installed()["joint_friction"].additions("joint_friction", made)
    sizes = [[a.parameters[k].scale for k in ("coulomb", "viscous")] for a in added]
    np.testing.assert_allclose(sizes, [[1.875] * 2, [0.05] * 2, [0.5] * 2])
