"""Batch dynamics in single against double precision: ``benchmarks/parity.py [--device cuda]``.

The same starts are flown for a second in double precision on the processor and in single precision
on a device; what is told is how far apart they end, relative, medium by medium.

``--held`` leaves the controller out: manipulators that move and turn, under speeds of their rotors
that stay, so that nothing but the laws is compared. With a controller a difference comes back as a
command, and where its allocation changes over it grows.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import machine
import numpy as np

WORDS = ["env=reach", "backend=twin", "environment.tank_bottom=-50"]
MEDIA = {
    "air": ((-0.7, -0.7, 9.0), (0.7, 0.7, 10.0)),
    "water": ((-0.7, -0.7, -10.0), (0.7, 0.7, -9.0)),
    "crossing": ((-0.7, -0.7, -0.5), (0.7, 0.7, 0.5)),
}
"""Boxes of starts and targets, water level at 0: far from it, or around it [m]."""
SECOND = 25
"""Control steps in one."""
LEAST, MOST = 0.8, 1.1
"""Rotor speeds over those that carry the manipulator in air [1]."""
WIDE = 1e-4
"""Difference beyond which robots are counted [1]."""
THIN = 0.035
"""The same thrust under water takes this share of the speed: the root of the densities' ratio."""

States = dict[str, np.ndarray]


def flown(medium: str, device: str, count: int) -> States:
    """Return the states of a controlled batch after a second of equal actions."""
    import torch

    from seals.config.compose import compose
    from seals.learn.environments import batched_of

    low, high = MEDIA[medium]
    boxes = [
        f"task.{name}_{side}=[{','.join(map(str, corner))}]"
        for name in ("start", "target")
        for side, corner in (("low", low), ("high", high))
    ]
    environment = batched_of(compose([*WORDS, *boxes], root="learn"), count=count, device=device)
    environment.reset(list(range(count)))
    draw = torch.Generator().manual_seed(0)
    for _ in range(SECOND):
        action = torch.rand((count, environment.action_size), generator=draw) - 0.5
        environment.step(action.to(device))
    return numbers(environment.now, ("position", "rotation", "velocity", "angular_velocity"))


def drifted(medium: str, like: Any, count: int) -> States:
    """Return the states of a batch after a second of constant rotor speeds."""
    from seals.arrays import as_like
    from seals.batch import BatchDynamics
    from seals.batch.holding import hold
    from seals.config.compose import compose
    from seals.control.plant import build_plant
    from seals.frames import quaternion_of_rpy
    from seals.learn.environments.build import build_learning
    from seals.motion import Inputs
    from seals.run.assembly import build_model
    from seals.run.hover_trim import carrying_speeds

    settings, task = build_learning(compose(WORDS, root="learn"))
    robot, effects = build_model(settings)
    speeds = np.atleast_2d(
        carrying_speeds(build_plant(robot, effects, settings.environment), task.posture)
    )
    whole, held = hold(robot, effects, task.posture.tolist())
    parts = (whole, held, settings.environment, settings.wave)
    twin = BatchDynamics(*parts, batch=count, like=like)
    rng = np.random.default_rng(0)
    low, high = MEDIA[medium]
    state = twin.start(
        position=rng.uniform(low, high, (count, 3)),
        quaternion=quaternion_of_rpy(rng.uniform(-0.5, 0.5, (count, 3))),
        velocity=rng.uniform(-1.0, 1.0, (count, 3)),
        angular_velocity=rng.uniform(-2.0, 2.0, (count, 3)),
    )
    share = rng.uniform(LEAST, MOST, (count, speeds.shape[1])) * (1.0 if medium == "air" else THIN)
    inputs = Inputs(settings.backend.interval, twin.no_torque(), as_like(speeds * share, like))
    step = settings.backend.interval
    time = as_like(np.zeros((count, 1)), like)
    for _ in range(round(1.0 / step)):
        state, _ = twin.advance(state, time, step, (inputs, inputs, inputs))
        time = time + step
    return numbers(state, ("position", "quaternion", "velocity", "angular_velocity"))


def numbers(holder: Any, names: Sequence[str]) -> States:
    """Return fields as NumPy arrays of one row a robot."""
    found = {}
    for name in names:
        values = getattr(holder, name)
        values = values.cpu() if hasattr(values, "cpu") else values
        found[name] = np.asarray(values, dtype=float).reshape(len(values), -1)
    return found


def apart(one: States, other: States) -> States:
    """Return relative differences of each robot, by part of the state and of all parts together."""
    found = {}
    whole = {"all": np.concatenate(list(one.values()), axis=1)}
    more = {"all": np.concatenate(list(other.values()), axis=1)}
    for name, rows in {**one, **whole}.items():
        size = np.maximum(np.linalg.norm(rows, axis=1), 1e-12)
        found[name] = np.linalg.norm(rows - {**other, **more}[name], axis=1) / size
    return found


def single(device: str) -> Any:
    """Return a number of single precision on a device."""
    import torch

    torch.set_num_threads(1)
    return torch.zeros(1, dtype=torch.float32, device=device)


def main() -> None:
    """Print median, 99th percentile and largest relative difference, and how many are beyond."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", default="cpu", help="cpu or cuda")
    parser.add_argument("--count", type=int, default=1000, help="starts of each medium")
    parser.add_argument("--held", action="store_true", help="rotor speeds stay, no controller")
    parser.add_argument("--media", nargs="+", default=list(MEDIA), choices=list(MEDIA))
    given = parser.parse_args()
    if given.device == "cpu" and not given.held:
        parser.error("on a processor environments compute in double precision: say --held")
    print(machine.describe())
    print(
        f"{'after 1 s, relative':20} {'part':>10} {'median':>9} {'99 %':>9} {'largest':>9} > 1e-4"
    )
    for medium in given.media:
        if given.held:
            exact = drifted(medium, np.zeros(1), given.count)
            other = drifted(medium, single(given.device), given.count)
        else:
            exact = flown(medium, "cpu", given.count)
            other = flown(medium, given.device, given.count)
        for part, gap in apart(exact, other).items():
            median, most = np.quantile(gap, [0.5, 0.99])
            beyond = int((gap > WIDE).sum())
            print(f"{medium:20} {part:>10} {median:9.1e} {most:9.1e} {gap.max():9.1e} {beyond:6d}")


if __name__ == "__main__":
    machine.one_thread()
    main()
