"""Force laws from which a formula for an unknown effect is built.

Each is linear in its coefficients and states a wrench about the link origin in link axes. They are
written on the array API: the search for a formula and the effect of that formula share them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeAlias

from seals.arrays import Array, namespace
from seals.frames import cross, unrotate

_STILL = 1e-2
"""Speed below which the direction of a drag fades [m/s]."""
_NEAR = 1e-2
"""Distance below which the direction of a pull and the height fade [m]."""


class Scene(NamedTuple):
    """Arguments of the force laws; N rows.

    Args:
        time: [s], shape (1 or N, 1).
        position: world [m], shape (N, 3).
        rotation: R_WL, shape (N, 3, 3).
        up: world z in link axes [1], shape (N, 3).
        velocity: against the medium, link axes [m/s], shape (N, 3).
        spin: link axes [rad/s], shape (N, 3).
        share: weight of the medium [1], shape (N, 1).
        drive: force and torque of the actuators, link axes [N, N m], shape (N, 6); None for none.
    """

    time: Array
    position: Array
    rotation: Array
    up: Array
    velocity: Array
    spin: Array
    share: Array
    drive: Array | None = None


Coefficient: TypeAlias = Array
Settings: TypeAlias = Mapping[str, Array]
Law: TypeAlias = Callable[[Scene, Coefficient, Settings], Array]


def _fixed(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Constant force or torque in body axes."""
    return c + scene.velocity * 0.0


def _world(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Constant force in world axes."""
    return unrotate(scene.rotation, c + scene.velocity * 0.0)


def _drag(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Drag against the motion, with a power of the total speed."""
    vector = scene.velocity
    xp = namespace(vector)
    size = xp.sqrt(xp.sum(vector * vector, axis=1, keepdims=True) + _STILL**2)
    return -c * scene.velocity * size ** (settings["drag_power"] - 1.0)


def _lift(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Lift across motion and rotation: angular velocity x velocity."""
    return c * cross(scene.spin, scene.velocity)


def _spin(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Damping of rotation."""
    return -c * scene.spin


def _wheel(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Gyroscopic torque of an angular momentum fixed to the body: -angular velocity x momentum."""
    return cross(c + scene.spin * 0.0, scene.spin)


def _pull(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Central force toward a point, with a power of the distance."""
    away = settings["place"] - scene.position
    core = settings["core"]
    xp = namespace(away)
    reach = xp.sqrt(xp.sum(away * away, axis=1, keepdims=True) + core * core + _NEAR**2)
    return c * unrotate(scene.rotation, away) * reach ** (-1.0 - settings["pull_power"])


def _spot(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Force of constant direction in the world around a point."""
    away = scene.position - settings["place"]
    xp = namespace(away)
    square = xp.sum(away * away, axis=1, keepdims=True)
    size = xp.exp(-0.5 * square / (settings["spread"] ** 2 + 1e-6))
    return unrotate(scene.rotation, (c + scene.velocity * 0.0) * size)


def _near(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Upward force, with a power of the height above a level."""
    xp = namespace(scene.position)
    height = scene.position[:, 2:3] - settings["level"]
    reach = xp.sqrt(height * height + _NEAR**2)
    return c * scene.up * reach ** (-settings["near_power"])


def _beyond(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Constant force in the world beyond a plane."""
    xp = namespace(scene.position)
    along = xp.sum(scene.position * settings["normal"], axis=1, keepdims=True)
    inside = 0.5 + 0.5 * xp.tanh((along - settings["edge"]) / (settings["width"] + 1e-3))
    return unrotate(scene.rotation, (c + scene.velocity * 0.0) * inside)


def _cosine(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Force or torque with the cosine of time."""
    xp = namespace(scene.velocity)
    return c * xp.cos(settings["rate"] * scene.time) + scene.velocity * 0.0


def _sine(scene: Scene, c: Coefficient, settings: Settings) -> Array:
    """Force or torque with the sine of time."""
    xp = namespace(scene.velocity)
    return c * xp.sin(settings["rate"] * scene.time) + scene.velocity * 0.0


FORCES: Mapping[str, Law] = {
    "push": _fixed,
    "hold": _world,
    "drag": _drag,
    "lift": _lift,
    "pull": _pull,
    "spot": _spot,
    "near": _near,
    "beyond": _beyond,
    "swing_cos": _cosine,
    "swing_sin": _sine,
}
"""Laws of force by stem of their coefficients."""
TORQUES: Mapping[str, Law] = {
    "twist": _fixed,
    "spin": _spin,
    "wheel": _wheel,
    "shake_cos": _cosine,
    "shake_sin": _sine,
}
"""Laws of torque by stem of their coefficients."""
DRIVEN = "thrust"
"""Coefficient on the wrench of the actuators."""
SCALARS = ("pull", "near", DRIVEN)
"""Stems with one coefficient; the others have one an axis."""
