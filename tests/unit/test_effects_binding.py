"""Effects on links: names, refusals, batched parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from seals.effects import Effect, MediumKind, bind_effects
from seals.effects.binding import refuse_double_counting
from seals.errors import ConfigError
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.gravity import Gravity
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.run import build_twin
from seals.run.build import run_settings

LINKS = ("hull", "upper", "fore")


@pytest.mark.parametrize(
    ("names", "indices"),
    [(["root"], (0,)), (["*"], (0, 1, 2)), (["fore", "root"], (0, 2)), (["fore", "fore"], (2,))],
)
def test_link_names_become_indices(names: list[str], indices: tuple[int, ...]) -> None:
    """``root`` is the base, ``*`` every link, names may come in any order."""
    assert bind_effects({"a": Gravity(links=names)}, LINKS).bound[0].links == indices


def test_an_unknown_link_is_refused_with_the_nearest() -> None:
    """A link that does not exist is named with its effect and the nearest name."""
    with pytest.raises(ConfigError) as refusal:
        bind_effects({"drag": DragLinear(links=["uper"])}, LINKS)
    assert "effects.drag.links: there is no link 'uper'" in str(refusal.value)
    assert "Did you mean 'upper'?" in str(refusal.value)


def test_two_owners_of_one_phenomenon_are_refused() -> None:
    """The refusal names both effects, the phenomenon, the link, and the way out."""
    effects = {"first": Buoyancy(links=["*"]), "second": Buoyancy(links=["upper"])}
    with pytest.raises(ConfigError) as refusal:
        bind_effects(effects, LINKS)
    text = str(refusal.value)
    assert "'first' and 'second' both account for buoyancy on link 'upper'" in text
    assert "effects.second.correction=true" in text


def test_a_correction_may_add() -> None:
    """An effect that says it is a correction may stand beside the owner."""
    effects = {"first": Buoyancy(), "second": Buoyancy(correction=True)}
    assert bind_effects(effects, LINKS).names == ("first", "second")


@pytest.mark.parametrize(
    ("first", "second", "clash"),
    [
        (MediumKind.water, MediumKind.air, False),
        (MediumKind.water, MediumKind.any, True),
        (MediumKind.any, MediumKind.air, True),
        (MediumKind.air, MediumKind.air, True),
    ],
)
def test_water_and_air_have_owners_of_their_own(
    first: MediumKind, second: MediumKind, clash: bool
) -> None:
    """Drag in water and drag in air are two phenomena; ``any`` claims both."""
    effects = {"a": DragQuadratic(medium=first), "b": DragQuadratic(medium=second)}
    if not clash:
        assert len(bind_effects(effects, LINKS).bound) == 2
        return
    with pytest.raises(ConfigError, match="'a' and 'b' both account for quadratic drag"):
        bind_effects(effects, LINKS)


def test_other_links_are_no_clash() -> None:
    """One phenomenon may have different owners on different links."""
    effects: dict[str, Effect] = {"a": AddedMass(links=["hull"]), "b": AddedMass(links=["fore"])}
    assert len(bind_effects(effects, LINKS).inertias) == 2


def test_particle_water_is_an_owner_too() -> None:
    """Water that already lifts and drags refuses coefficients for the same."""
    bound = bind_effects({"lift": Buoyancy()}, LINKS).bound
    with pytest.raises(ConfigError, match="'particles' and 'lift' both account for buoyancy"):
        refuse_double_counting(bound, LINKS, {"particles": ("buoyancy", "form drag")})


def test_axes_are_joined_into_vectors() -> None:
    """Parameters ending in _x, _y, _z reach the law as one row of three."""
    drag = DragLinear(coefficient_x=1.0, coefficient_y=2.0, coefficient_z=3.0)
    params = bind_effects({"a": drag}, LINKS).bound[0].params
    np.testing.assert_array_equal(params["coefficient"], [[1.0, 2.0, 3.0]])


def test_batched_values_repeat_for_every_link() -> None:
    """An array over the batch is laid out link by link."""
    effects = bind_effects({"a": DragLinear(coefficient_x=1.0, links=["*"])}, LINKS)
    values = {"a.coefficient_y": np.array([5.0, 6.0])}
    table = effects.with_values(values, np.zeros(1), 2).bound[0].params["coefficient"]
    np.testing.assert_array_equal(table[:, 0], np.ones(6))
    np.testing.assert_array_equal(table[:, 1], [5.0, 6.0, 5.0, 6.0, 5.0, 6.0])


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"a.coeficient_y": 1.0}, r"Did you mean 'a\.coefficient_y'\?"),
        ({"b.coefficient_y": 1.0}, "is not a parameter of this model"),
        ({"a.coefficient_y": np.ones(3)}, r"has shape \(3,\)"),
    ],
)
def test_wrong_values_are_refused(values: dict[str, Any], words: str) -> None:
    """Unknown parameters and arrays of the wrong length are refused in words."""
    effects = bind_effects({"a": DragLinear()}, LINKS)
    with pytest.raises(ConfigError, match=words):
        effects.with_values(values, np.zeros(1), 2)


def test_a_batch_of_three_drags_is_three_runs() -> None:
    """Each row of a batch with its own drag moves as a twin of that drag alone."""
    options = ["robot=free_arm", "water=fossen", "initial.position=[0,0,0.05]"]
    moving = ["initial.velocity=[0.5,0.2,-0.1]", "initial.joint_velocity=[1,-2]"]
    run, drags = run_settings([*options, *moving]), np.array([0.0, 5.0, 20.0])

    def end(batch: int, drag: Any) -> list[Any]:
        values = {"water_drag.coefficient_z": drag}
        twin, state = build_twin(run, batch=batch, values=values)
        for k in range(40):
            state, _ = twin.step(state, 0.004 * k, 0.004)
        return list(state)

    together = end(3, drags)
    assert np.abs(np.diff(together[0][:, 2])).min() > 1e-4
    for row, drag in enumerate(drags):
        for all_rows, alone in zip(together, end(1, float(drag)), strict=True):
            np.testing.assert_allclose(all_rows[row : row + 1], alone, atol=1e-12)


def test_memory_has_a_row_for_every_link_and_body() -> None:
    """Memory at reset is zero, rows are links times batch, and only effects with memory have it."""

    @dataclass(kw_only=True)
    class Lagging(Gravity):
        memory_size = 2

    effects = bind_effects({"a": Gravity(correction=True), "b": Lagging(links=["*"])}, LINKS)
    memory = effects.zero_memory(4)
    assert list(memory) == ["b"]
    assert memory["b"].shape == (12, 2)
    assert not memory["b"].any()
