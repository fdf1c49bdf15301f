"""Check of a simulated manoeuvre against the allowed space, speeds and tilt."""

from __future__ import annotations

import numpy as np

from seals.frames import matrix_of
from seals.sysid.experiment_design.flight import Rehearsal
from seals.sysid.experiment_design.manoeuvres import LONGEST, Manoeuvre
from seals.sysid.experiment_design.scene import DROP, Scene

_MARGIN = 0.1
"""Distance by which the room may be left [m]."""
_LEAN = 0.2
"""Angle by which the lean may exceed its bound in passing [rad]."""
_FAST = 1.6
"""Factor by which the speed may exceed its bound in passing."""


def breaches(scene: Scene, rehearsal: Rehearsal, manoeuvre: Manoeuvre) -> list[str]:
    """Return the limits that a manoeuvre violates, in words; empty when it is safe."""
    found = []
    if manoeuvre.seconds > LONGEST:
        found.append(f"it takes {manoeuvre.seconds:g} s, more than {LONGEST:g} s")
    for run in rehearsal.runs:
        if run.manoeuvre.name != manoeuvre.name:
            continue
        rows, trajectory = rehearsal.rows(run), rehearsal.trajectory
        place = trajectory.position[rows]
        if not np.isfinite(place).all():
            found.append("the vehicle is lost")
            continue
        if place[:, 2].min() < scene.low - _MARGIN:
            found.append(f"it comes down to {place[:, 2].min():.2f} m, below {scene.low:.2f} m")
        if place[:, 2].max() > scene.high + _MARGIN:
            found.append(f"it rises to {place[:, 2].max():.2f} m, above {scene.high:.2f} m")
        if scene.kind == DROP:
            continue
        away = float(np.abs(place[:, :2] - scene.home[:2]).max())
        if away > scene.reach + _MARGIN:
            found.append(f"it moves {away:.1f} m away, more than {scene.reach:g} m")
        speed = float(np.linalg.norm(trajectory.velocity[rows], axis=1).max())
        if speed > _FAST * scene.speed:
            found.append(f"it reaches {speed:.1f} m/s, more than {_FAST * scene.speed:.1f} m/s")
        up = matrix_of(trajectory.quaternion[rows])[:, 2, 2]
        lean = float(np.arccos(np.clip(up, -1.0, 1.0)).max())
        if lean > scene.tilt + _LEAN:
            found.append(f"it leans {np.degrees(lean):.0f} degrees")
    return found
