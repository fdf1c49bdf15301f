"""What each family is asked to do in a log, and how it is let go where it cannot be asked."""

from __future__ import annotations

import numpy as np

from tests.validation.hidden import references
from tests.validation.hidden.references import Wanted
from tests.validation.hidden.rotation import Array, from_angles
from tests.validation.hidden.vehicles import six
from tests.validation.hidden.wild import sea
from tests.validation.hidden.wild.robots import Rng, Robot

# sizes of x, y, z [m] and yaw [rad]; periods [s]
SHAPES: dict[str, tuple[list[float], tuple[float, float]]] = {
    "hexa": ([1.3, 1.3, 0.55, 0.9], (3.8, 6.0)),
    "octo": ([1.4, 1.4, 0.6, 0.8], (4.2, 6.5)),
    "grip": ([0.8, 0.8, 0.42, 1.0], (4.0, 6.0)),
    "dual": ([0.8, 0.8, 0.42, 1.0], (4.0, 6.0)),
    "rov6": ([0.6, 0.6, 0.45, 0.9], (6.0, 9.0)),
    "rov8": ([0.6, 0.6, 0.45, 0.9], (6.0, 9.0)),
    "torpedo": ([1.6, 0.6, 0.45, 0.6], (8.0, 12.0)),
    "boat": ([1.0, 0.5, 0.0, 0.9], (7.0, 11.0)),
}
SECONDS = {"grip": 16.0, "dual": 16.0, "projectile": 2.4, "buoy": 20.0, "torpedo": 22.0}
PREROLL = 0.6
RELEASE = {"position": 0.005, "orientation": 0.01, "velocity": 0.02, "angular_velocity": 0.02}


def middle(robot: Robot, wavy: bool) -> float:
    """Mean height of a log [m]."""
    if robot.vehicle.ground is not None:
        return 1.8
    if robot.family == "boat":
        return sea.afloat(robot.vehicle)
    return -1.1 if wavy else -3.0


def draw(robot: Robot, rng: Rng, seconds: float, height: float) -> Wanted:
    """A reference of its own for one log."""
    sizes, period = SHAPES[robot.family]
    out: Wanted = references._sines(rng, sizes, period)
    step = [0.35, 0.35, 0.2, 0.5] if robot.vehicle.rotor else [0.2, 0.2, 0.15, 0.4]
    step[2] *= sizes[2] > 0.0
    out.update(references._steps(rng, step, 2, seconds - 1.5))
    out["step_width"] = np.array(0.3 if robot.vehicle.rotor else 0.7)
    out["middle"] = np.array([0.0, 0.0, height, rng.uniform(-1.5, 1.5)])
    out["line"] = np.zeros(4)
    tree = robot.tree
    if tree is not None:
        m = len(tree.names)
        jaw = np.arange(m) >= tree.joints
        out["joint_rate"] = 2.0 * np.pi / rng.uniform(2.2, 4.5, (m, 2))
        swing = rng.uniform(0.22, 0.36, (m, 2))
        out["joint_size"] = np.where(jaw[:, None], 0.35 * swing, swing)
        out["joint_phase"] = rng.uniform(0.0, 2.0 * np.pi, (m, 2))
        rest = np.array(([0.5, -1.0] * (tree.joints // 2) + [0.2, -0.2])[:m])
        out["joint_middle"] = rest + rng.uniform(-0.1, 0.1, m)
    return out


def release(robot: Robot, rng: Rng) -> dict[str, Array]:
    """Stated state at the first row of a segment, and by what the true one misses it."""
    if robot.family == "projectile":
        height, tilt, spin = rng.uniform(0.4, 1.2), 0.06, rng.uniform(-0.3, 0.3, 3)
        place = np.array([*rng.uniform(-0.01, 0.01, 2), height])
        push = np.zeros(3)
    else:
        tilt, spin = 0.12, rng.uniform(-0.25, 0.25, 3)
        rise = sea.afloat(robot.vehicle) + rng.uniform(-0.05, 0.05)
        place = np.array([*rng.uniform(-0.2, 0.2, 2), rise])
        push = rng.uniform(-0.15, 0.15, 3)
    roll, pitch = np.clip(tilt * rng.standard_normal(2), -0.3, 0.3)
    q = from_angles(roll, pitch, rng.uniform(-np.pi, np.pi))

    def miss(size: float) -> Array:
        return size * np.clip(rng.standard_normal(3), -2.5, 2.5)

    return {
        "position": six(place),
        "orientation": six(q),
        "velocity": push,
        "angular_velocity": six(spin),
        "position_miss": miss(RELEASE["position"]),
        "orientation_miss": miss(RELEASE["orientation"]),
        "velocity_miss": miss(RELEASE["velocity"]),
        "angular_velocity_miss": miss(RELEASE["angular_velocity"]),
    }
