"""Drag proportional to the square of speed: per axis, isotropic, in cross-flow, of faces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from seals.arrays import Array, Floats, namespace, some
from seals.effects.drag_form import (
    DRAWING,
    OTHERS,
    DragForm,
    HullAxis,
    drag_points,
    form_of_hull,
    is_spread,
    power_law_additions,
    speed_squares,
    states_spread,
    turning_slope,
)
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.effects.identification import Addition, Comparison, Identification, Stage, Subject
from seals.errors import ConfigError
from seals.frames import cross_last
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.schema import LATER, param

if TYPE_CHECKING:
    from seals.robot.model import RobotModel

_SHAPE = (
    *("form", "axis"),
    *(f"{stem}_{axis}" for stem in ("size", "position") for axis in "xyz"),
)
"""Fields that describe the body; a change of its drag has them, too."""
_LIMITS: dict[str, Any] = {
    "bounds": (0.0, 1e7),
    "tolerance": 0.08,
    "relative": True,
    "source": "zero unless stated for the vehicle",
}
_PLACE: dict[str, Any] = {**DRAWING, "bounds": (-1e3, 1e3)}


@dataclass(kw_only=True)
class DragQuadratic(Effect):
    """Quadratic drag: form drag of bluff bodies.

    Equation:
        F = sum_k F_k, T = sum_k r_k x F_k with F_k,i = -c_i w_k,i V_k,i v_k,i along body axis i;
        times the share of the medium. v_k = v_r + w x r_k is the velocity of point k relative to
        the medium, c_i = rho C_d A_i / 2, and the weights w_k,i sum to one over the points. The
        form says which points there are and which speed V counts:

        - ``per_axis``: the link origin, V_i = abs(v_i). Where the drag acts spread about it, at
          places whose mean squares are s, it brakes the rotation, too, to first order in w:
          T_i = -2 w_i (d_j s_k + d_k s_j), d = c V, j and k the other two axes.
        - ``isotropic``: the body's centre, V = abs(v). With one c for all axes, F = -c abs(v) v at
          any attitude: a sphere.
        - ``cross_flow``: strips along ``axis``, V = abs(v_n) across it and abs(v_a) along it, v_n
          the transverse velocity of the strip: a slender hull.
        - ``faces``: points on the faces of a box, each with the force c_i abs(v) v_n along its own
          normal, so that a turned box shows its projected areas.

        In motion along one body axis without turning all forms agree.

    Args:
        coefficient_x: c along body x [N s^2/m^2].
        coefficient_y: c along body y [N s^2/m^2].
        coefficient_z: c along body z [N s^2/m^2].
        form: see the equation.
        axis: along which the hull lies, of ``cross_flow``.
        size_x: extent of the body along x, of ``cross_flow`` and ``faces``; zero leaves out the
            drag of turning about the centre [m].
        size_y: along y [m].
        size_z: along z [m].
        spread_x: s along body x, of ``per_axis`` [m^2].
        spread_y: along y [m^2].
        spread_z: along z [m^2].
        position_x: centre of the body in link axes, of all forms but ``per_axis`` [m].
        position_y: along y [m].
        position_z: along z [m].
        medium: water, air or any.

    Assumptions:
        Density is inside the coefficient; the flow is uniform along the body. ``per_axis``: axes
        are uncoupled, as measured coefficients of vehicles are stated. ``cross_flow``: the
        transverse drag is the same along the whole hull.

    Valid range:
        Reynolds numbers from about 1e3 to the drag crisis (2e5 for a smooth sphere). The cross-flow
        principle holds for hulls of at least some five diameters.

    Limitations:
        No drag crisis, no lift, no memory of the wake. ``per_axis`` depends on the attitude: a
        sphere falls 2^(1/4) times as fast when turned by 45 degrees. A cube has the same ``faces``
        drag edge on as face on; measured it is 8 % more (C_d 0.80 on the projected area, and 1.05;
        Hoerner, ch. 3). Force and moment of a box turning fast about a skew axis are within 0.1 %
        of the integral over its faces. A body that is partly submerged is braked in proportion, not
        where it is wet. ``cross_flow`` and ``faces`` hold the quadratic drag of turning: do not
        state it again as ``angular_drag``.

    References:
        Fossen 2011 and 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, ch. 6
        (cross-flow drag); Morison et al. 1950; Hoerner 1965, Fluid-Dynamic Drag, ch. 3.

    Example:
        >>> DragQuadratic(coefficient_z=20.0, medium=MediumKind.water).coefficient_z
        20.0
        >>> DragQuadratic(form=DragForm.cross_flow, coefficient_y=90.0, size_x=1.5).axis.value
        'x'
    """

    coefficient_x: float = param(0.0, "N s^2/m^2", **_LIMITS)
    coefficient_y: float = param(0.0, "N s^2/m^2", **_LIMITS)
    coefficient_z: float = param(0.0, "N s^2/m^2", **_LIMITS)
    form: DragForm = field(default=DragForm.per_axis, metadata=LATER)
    axis: HullAxis = field(default=HullAxis.x, metadata=LATER)
    size_x: float = param(0.0, "m", **DRAWING)
    size_y: float = param(0.0, "m", **DRAWING)
    size_z: float = param(0.0, "m", **DRAWING)
    spread_x: float = param(0.0, "m^2", **DRAWING)
    spread_y: float = param(0.0, "m^2", **DRAWING)
    spread_z: float = param(0.0, "m^2", **DRAWING)
    position_x: float = param(0.0, "m", **_PLACE)
    position_y: float = param(0.0, "m", **_PLACE)
    position_z: float = param(0.0, "m", **_PLACE)
    medium: MediumKind = MediumKind.water
    accounts_for: ClassVar[tuple[str, ...]] = ("quadratic drag",)
    zero_when_dry: ClassVar[bool] = True
    identification: ClassVar[Identification] = Identification(
        confounders=("linear_drag",),
        resists=True,
        may_begin=True,
        may_end=True,
        family="drag",
        power=2,
        compared=Comparison(
            order=(Stage.water, 8),
            media=(
                "water",
                "air",
            ),
            scales={"coefficient": lambda s: 0.2 * s.weight / s.speed**2},
        ),
    )

    def __post_init__(self) -> None:
        """Refuse a spread beside a form that says where the drag acts.

        Raises:
            ConfigError: with what to leave out.
        """
        if self.form is not DragForm.per_axis and states_spread(self):
            raise ConfigError(
                f"a spread needs form=per_axis; form={self.form.value} already determines where "
                "the drag acts.\nLeave spread_x to spread_z out, or give form=per_axis."
            )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidates: drag in each medium; its exponent has a tolerance."""
        return power_law_additions(
            cls,
            name,
            subject,
            power=2,
            share={MediumKind.water: 3.0, MediumKind.air: 0.01},
            forms=(DragForm.isotropic,),
        )

    @classmethod
    def options_on(
        cls, robot: RobotModel, effects: Mapping[str, Effect], medium: MediumKind | None
    ) -> dict[str, Any]:
        """Return form and size of the model's own drag, else those that suit the base's hull."""
        base = {"root", "*", robot.links[0]}
        own = [e for e in effects.values() if type(e) is cls and not e.correction]
        own = [e for e in own if base & set(e.links)]
        if not own:
            return form_of_hull(robot.hulls[0])
        # in another medium it is the same body
        held = next((e for e in own if e.medium in (medium, MediumKind.any)), own[0])
        return {name: getattr(held, name) for name in _SHAPE}

    def constants(self) -> dict[str, Floats]:
        """Return the axes whose speeds count, and several points with their weights.

        Of ``per_axis``: the sum over other axes, if the drag acts spread or may.
        """
        if self.form is DragForm.per_axis:
            return {"others": OTHERS} if is_spread(self) else {}
        squares = {"squares": speed_squares(self.form, self.axis)[None]}
        points, weights = drag_points(self.form, self.axis)
        one = len(points) == 1
        return squares if one else {**squares, "points": points[None], "weights": weights[None]}

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Force against the relative velocity, and its moment about the link origin [N, N m]."""
        v = motion.velocity - medium.velocity
        if "squares" not in params:
            force = abs(v) * v * params["coefficient"] * -medium.medium_fraction
            if "others" not in params:
                return Wrench(force, None), memory
            slope = abs(v) * params["coefficient"] * -2.0 * medium.medium_fraction
            return Wrench(force, turning_slope(slope, params) * motion.angular_velocity), memory
        c = params["coefficient"] * -medium.medium_fraction
        xp, rate, arm = namespace(v), motion.angular_velocity, params["position"]
        many = "points" in params
        if many:
            v, rate = v[:, None, :], rate[:, None, :]
            arm = arm[:, None, :] + params["size"][:, None, :] * params["points"]
            c = params["weights"] * c[:, None, :]
        elif not some(arm):
            return Wrench(_pressed(v, c, params["squares"][0]), None), memory
        v = v + cross_last(rate, arm)
        force = _pressed(v, c, params["squares"][0])
        torque = cross_last(arm, force)
        if many:
            force, torque = xp.sum(force, axis=1), xp.sum(torque, axis=1)
        return Wrench(force, torque), memory


def _pressed(v: Array, c: Array, squares: Array) -> Array:
    """Velocity times the speed that counts along each axis times the coefficient."""
    xp = namespace(v)
    return v * xp.sqrt(xp.matmul(v * v, squares)) * c
