"""Candidates of quadratic drag have the form of the vehicle's own drag, or that of its hull."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.api import load_log
from seals.cli.main import main
from seals.config.overlay import read_overlay
from seals.effects import MediumKind, bind_effects
from seals.effects.discrepancy import DragExponent
from seals.effects.drag_form import DragForm, HullAxis, form_of_hull, speed_squares
from seals.errors import ConfigError, LogError
from seals.hydrostatics import HullBox, HullCapsule, HullCompound, HullCylinder, HullSphere
from seals.logs.native import read_native
from seals.motion import Inputs, Medium, Motion
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.sysid.candidates.catalogue import candidate_set_of
from seals.sysid.data.robot_description import describe_run
from seals.sysid.data.vehicle import read_vehicle

BALL = ("robot=ball", "water=fossen", "initial.position=[0,0,-3]", "time.duration=0.1")
BOX = ("robot=box", "water=fossen", "initial.position=[0,0,-3]", "time.duration=0.1")


def ran(place: Path, *words: str) -> Path:
    """Return the folder of a short run."""
    assert main(["run", *words, f"hydra.run.dir={place}"]) == 0
    return place


def change_of(folder: Path, *, own_robot: bool) -> Any:
    """Return the quadratic drag in water that a diagnosis of a run would add."""
    description = describe_run(folder) if own_robot else None
    vehicle = read_vehicle(read_native(folder).meta, description)
    return candidate_set_of(vehicle, speeds=np.ones(3)).effects["quadratic_drag_water_change"]


@pytest.mark.parametrize("own_robot", [True, False])
def test_a_missing_part_of_the_drag_has_its_form(tmp_path: Path, own_robot: bool) -> None:
    """Read from the robot of the run or from the log's own metadata, a ball's is isotropic."""
    change = change_of(ran(tmp_path / "run", *BALL), own_robot=own_robot)
    assert (change.form, change.coefficient_x) == (DragForm.isotropic, 0.0)


def test_a_drag_in_any_medium_has_its_tolerance(tmp_path: Path) -> None:
    """A stated drag that acts in air and water may be off by its tolerance in each."""
    meta = read_native(ran(tmp_path / "run", *BALL)).meta
    stated = {"coefficient_x": 0.2, "coefficient_y": 0.3, "coefficient_z": 0.4}
    own = [e for e in meta["baseline"] if e["name"] != "angular_drag"]
    meta["baseline"] = [*own, {"name": "angular_drag", "medium": "any", "parameters": stated}]
    meta["tolerance"] = {"angular_drag_coefficient": {"sigma": 0.15, "meaning": "relative"}}
    found = candidate_set_of(read_vehicle(meta, None), speeds=np.ones(3)).parameters
    z = found["angular_drag_water_change.coefficient_z"]
    assert (z.tolerance, z.bounds[0]) == pytest.approx((0.06, -0.4))


def test_a_drag_that_is_missing_altogether_has_the_form_of_the_hull(tmp_path: Path) -> None:
    """The model of a box without its drag may lack that of its faces."""
    change = change_of(ran(tmp_path / "run", *BOX, "hide=[water_drag]"), own_robot=True)
    assert (change.form, change.size_x, change.size_z) == (DragForm.faces, 0.3, 0.1)


def test_drag_per_axis_that_a_model_states_stays_per_axis(tmp_path: Path) -> None:
    """A ball whose configuration says per_axis is diagnosed so."""
    words = (*BALL, "effects.water_drag.form=per_axis")
    assert change_of(ran(tmp_path / "run", *words), own_robot=True).form is DragForm.per_axis


def test_a_drag_of_unknown_shape_may_act_spread(tmp_path: Path) -> None:
    """Per axis, the mean squares of its places are fitted beside it; a form has its own size."""
    for more, beside in (("effects.water_drag.form=per_axis",), 3), ((), 0):
        meta = read_native(ran(tmp_path / f"run_{beside}", *BALL, *more)).meta
        found = candidate_set_of(read_vehicle(meta, None), speeds=np.ones(3))
        drag = next(
            c for c in found.candidates if c.name == "quadratic_drag" and c.variant["medium"]
        )
        assert len(drag.nuisance) == beside
        assert len(drag.keys) == 3


def test_a_spread_beside_a_form_is_refused() -> None:
    """A form says where the drag acts; what would be passed over in silence is refused."""
    assert DragQuadratic(spread_x=0.01).constants()
    with pytest.raises(ConfigError, match="form=per_axis"):
        DragQuadratic(form=DragForm.faces, spread_x=0.01)


def test_a_log_with_an_unknown_form_is_refused() -> None:
    """The refusal names what there is."""
    meta = copy.deepcopy(load_log("hidden_effect/flight_a").meta)
    drag = next(e for e in meta["baseline"] if e["name"] == "quadratic_drag")
    drag["options"] = {"form": "isotropic"}
    read_vehicle(meta)
    for options, words in (({"form": "isotropc"}, "'isotropic'"), ({"from": "faces"}, "'form'")):
        drag["options"] = options
        with pytest.raises(LogError, match=f"Did you mean {words}"):
            read_vehicle(meta)


def test_an_unknown_form_is_refused_on_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 2 and the nearest form."""
    assert main(["run", *BALL, "effects.water_drag.form=crossflow"]) == 2
    assert "Did you mean 'cross_flow'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("hull", "expected"),
    [
        (HullSphere(radius=0.1, position=(0, 0, 0.2)), {"form": "isotropic", "position_z": 0.2}),
        (
            HullCylinder(radius=0.1, length=1.0, rpy=(0.0, np.pi / 2.0, 0.0)),
            {"form": "cross_flow", "axis": "x", "size_x": 1.0, "size_z": 0.0},
        ),
        (
            HullCapsule(radius=0.1, length=1.0),
            {"form": "cross_flow", "axis": "z", "size_z": 1.2},
        ),
        (
            HullBox(size=(0.3, 0.2, 0.1), rpy=(0.0, 0.0, np.pi / 2.0)),
            {"form": "faces", "size_x": 0.2, "size_y": 0.3, "size_z": 0.1},
        ),
        (HullBox(size=(0.3, 0.2, 0.1), rpy=(0.0, 0.0, 0.5)), {}),
        (HullCompound(parts=[HullSphere(radius=0.1)], displaced_volume=0.002), {}),
        (None, {}),
    ],
)
def test_the_form_suits_the_hull(hull: Any, expected: dict[str, Any]) -> None:
    """One shape along the link axes has a form; all else has none."""
    found = {k: getattr(v, "value", v) for k, v in form_of_hull(hull).items()}
    assert {k: pytest.approx(v) for k, v in expected.items()} == {k: found[k] for k in expected}
    assert bool(found) == bool(expected)


def test_an_overlay_keeps_the_form() -> None:
    """A drag that an overlay adds is built with its form; another word is refused."""
    entry = {"effect": "quadratic_drag", "form": "cross_flow", "axis": "z", "coefficient_x": 2.0}
    drag: Any = read_overlay({"effects": {"tail": entry}}).effects["tail"]
    assert (drag.form, drag.axis) == (DragForm.cross_flow, HullAxis.z)
    with pytest.raises(ConfigError, match="Did you mean 'faces'"):
        read_overlay({"effects": {"tail": {**entry, "form": "face"}}})


@pytest.mark.parametrize("form", DragForm)
def test_the_exponent_of_drag_follows_the_form(form: DragForm) -> None:
    """The discrepancy is the slope of c V0^-e V^(1 + e) v in e, V the speed that counts."""
    c, at, v = np.array([2.0, 5.0, 4.0]), np.array([1.0, 0.6, 0.8]), np.array([[0.9, -0.4, 1.1]])
    squares = speed_squares(form, HullAxis.x)
    speed, usual = np.sqrt(v**2 @ squares), np.sqrt(at**2 @ squares)
    own = DragQuadratic(form=form).constants().get("squares")
    effect = DragExponent(coefficients=tuple(c), speeds=tuple(at), squares=own, exponent=1e-6)
    params = bind_effects({"it": effect}, ["base"]).bound[0].params
    zero, one = np.zeros((1, 3)), np.ones((1, 1))
    motion = Motion(one, zero, one, zero, v, zero, None)  # type: ignore[arg-type]
    around = Medium(one, zero, zero, one, one, one, one, zero, zero, one, one)
    found, _ = effect.loads(motion, around, Inputs(0.004, zero), zero, params)
    rise = c * speed * v * ((speed / usual) ** 1e-6 - 1.0)
    # second order in e
    np.testing.assert_allclose(found.force, -rise, rtol=1e-5)
    assert effect.medium is MediumKind.water


def laws_of(meta: dict[str, Any]) -> dict[str, int]:
    """Return the forms in which the angular drag of the water may be missing, with their sizes."""
    found = candidate_set_of(read_vehicle(meta, None), speeds=np.ones(3)).candidates
    return {
        c.law: len(c.keys) for c in found if c.name == "angular_drag" and c.variant["medium"] == 1
    }


def test_angular_drag_may_be_missing_in_all_its_forms(tmp_path: Path) -> None:
    """Linear, quadratic and both, where neither is stated; a stated quadratic part may be off."""
    meta = read_native(ran(tmp_path / "run", *BALL)).meta
    others = [e for e in meta["baseline"] if e["name"] != "angular_drag"]
    meta["baseline"] = others
    assert laws_of(meta) == {"": 3, "quadratic": 3, "linear and quadratic": 6}
    own = {"name": "angular_drag", "medium": "water", "parameters": {"quadratic_x": 0.1}}
    meta["baseline"] = [*others, own]
    assert laws_of(meta) == {"": 3}


def test_an_added_mass_that_is_missing_altogether_is_as_large_as_the_hull(tmp_path: Path) -> None:
    """6 kg of water that a box displaces; else half of what is stated, 5 kg, or a third of those 6.

    With a third of it at most, the fit of a vehicle that lacks 1.4 times its displaced water along
    one axis made all thrusts weaker instead. No more can be missing than what is stated: a vehicle
    of negative added mass whose thrusts are a tenth moves as one whose thrusters lose at speed.
    """
    meta = read_native(ran(tmp_path / "run", *BOX)).meta

    def sizes() -> tuple[float, float]:
        found = candidate_set_of(read_vehicle(meta, None), speeds=np.ones(3)).parameters
        change = found["added_mass_change.mass_z"]
        return float(change.scale), float(change.bounds[0])

    assert sizes() == pytest.approx((2.5, -5.0))
    meta["baseline"] = [e for e in meta["baseline"] if e["name"] != "added_mass"]
    assert sizes() == pytest.approx((6.0, 0.0), rel=0.01)
