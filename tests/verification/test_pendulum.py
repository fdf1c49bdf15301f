"""The pendulum on a fixed pivot: its period at large angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.special import ellipk

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

G, MASS, LENGTH, MOMENT = 9.81, 0.1, 0.4, 0.002


@pytest.mark.parametrize("angle", [0.1, 1.5, 2.8])
@pytest.mark.parametrize(
    ("engine", "order", "step"), [("world", 2, 0.004), ("world", 2, 0.001), ("twin", 4, 0.016)]
)
def test_period_at_large_angles(
    bench: Bench, engine: str, order: int, step: float, angle: float
) -> None:
    """The period is that of the complete elliptic integral, up to nearly upside down."""
    arm = bench.link("arm", MASS, (MOMENT, MOMENT, 1e-4), centre=(0, 0, -LENGTH))
    joint = (
        '<joint name="pivot" type="continuous"><parent link="base"/><child link="arm"/>'
        '<origin xyz="0 0 0"/><axis xyz="0 1 0"/></joint>'
    )
    robot = bench.robot(bench.link("base", 1.0, (1.0,) * 3), arm, joint, fixed_base=True)
    run = bench.run(
        engine,
        bench.settings(
            robot, step=step, duration=5.0 if angle < 2 else 8.0, joint_position=[angle]
        ),
    )
    # T = 4 sqrt(I_p / (m g L)) K(k), k = sin(angle / 2); scipy takes the parameter k^2
    omega = np.sqrt(MASS * G * LENGTH / (MOMENT + MASS * LENGTH**2))
    expected = 4.0 / omega * ellipk(np.sin(angle / 2) ** 2)
    q = run.joints[:, 0]
    # straight lines find the crossings: no curvature there, since the torque vanishes
    k = np.flatnonzero((q[:-1] < 0.0) & (q[1:] >= 0.0))
    crossing = run.time[k] - q[k] * step / (q[k + 1] - q[k])
    period = float(np.diff(crossing).mean())
    print(
        f"{engine} {step * 1e3:g} ms, {angle} rad: T = {period:.6f} s, closed form {expected:.6f} s"
    )
    # a scheme of order p errs by less than (omega h)^p in frequency and energy; near the top the
    # period feels the energy by 1 / (1 - k^2) = 1 / cos^2(angle / 2)
    assert len(k) >= 3
    assert period == pytest.approx(expected, rel=(omega * step) ** order / np.cos(angle / 2) ** 2)
