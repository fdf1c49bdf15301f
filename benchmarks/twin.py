"""Body-steps per second of batch dynamics: ``python benchmarks/twin.py [--torch cpu|cuda]``.

A rigid vehicle with eight effects crosses the surface; one step is four evaluations.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import machine

HULLS = {"sphere": (0.1,), "box": (0.3, 0.2, 0.1), "cylinder": (0.1, 0.2)}
MASSES = {"sphere": 2.1, "box": 3.0, "cylinder": 3.1}
BLOCK = 20


def like_of(device: str | None, *, single: bool) -> Any:
    """Return an array of the library to use: NumPy, or PyTorch on a device."""
    if device is None:
        import numpy as np

        return np.zeros(1)
    import torch

    torch.set_num_threads(1)
    return torch.zeros(1, dtype=torch.float32 if single else torch.float64, device=device)


def vehicles(kind: str, batch: int, like: Any) -> tuple[Any, Any]:
    """Return rigid vehicles with eight effects that cross the surface, and their states."""
    import numpy as np
    import scene

    from seals.run import build_twin

    with tempfile.TemporaryDirectory() as folder:
        robot = scene.vehicle(Path(folder), kind, HULLS[kind], MASSES[kind])
        settings = scene.settings(robot, scene.effects(added_mass=True), height=0.0)
        twin, _ = build_twin(settings, batch=batch, like=like)
    rng = np.random.default_rng(0)
    return twin, twin.start(
        position=rng.normal(size=(batch, 3)) * [1.0, 1.0, 0.02],
        rpy=rng.normal(size=(batch, 3)) * 0.3,
        velocity=rng.normal(size=(batch, 3)) * 0.3,
        angular_velocity=rng.normal(size=(batch, 3)) * 0.3,
    )


def speed_of(kind: str, chosen: Any) -> tuple[float, float, float]:
    """Return median, lowest and highest body-steps a second."""
    batch, device = chosen.batch, chosen.torch
    like = like_of(device, single=chosen.single)
    twin, start = vehicles(kind, batch, like)
    fly = recorded(twin, start) if device == "cuda" else None

    def block() -> float:
        state = start
        begin = time.perf_counter()
        for k in range(BLOCK):
            if fly is None:
                state, _ = twin.step(state, k * 0.004, 0.004)
            else:
                state = fly()
        # reading one number waits for a device that works on its own
        float(state.position[0, 0])
        return BLOCK * batch / (time.perf_counter() - begin)

    block()
    return machine.median(block, chosen.repeats)


def recorded(twin: Any, start: Any) -> Any:
    """Return a step that goes on from where the last one ended, launched as one CUDA graph."""
    import torch

    from seals.learn.recorded import Recorded

    time = torch.zeros((1, 1), dtype=twin.like.dtype, device="cuda")

    def law(state: Any, given: Any) -> Any:
        with torch.no_grad():
            return twin.step(state, time, 0.004)[0], given

    draw, nothing = torch.Generator(device="cuda"), torch.zeros(1, device="cuda")
    whole = Recorded(law, start, nothing, draw)

    def step() -> Any:
        whole(nothing)
        return whole.state

    return step


def main() -> None:
    """Print body-steps a second for three hulls."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--torch", metavar="DEVICE", nargs="?", const="cpu", help="use PyTorch on cpu or cuda"
    )
    parser.add_argument("--single", action="store_true", help="with PyTorch: float32")
    parser.add_argument("--hulls", nargs="+", default=list(HULLS), choices=HULLS)
    parser.add_argument("--batch", type=int, default=1000, help="bodies at once")
    parser.add_argument("--repeats", type=int, default=9, help="blocks of 20 steps of each case")
    chosen = parser.parse_args()
    if chosen.torch is None and chosen.single:
        parser.error("--single goes with --torch")
    print(machine.describe())
    library = "NumPy" if chosen.torch is None else f"PyTorch on {chosen.torch}"
    library += ", float32" * chosen.single
    title = f"twin, {library}, batch {chosen.batch}"
    print(f"{title:34} {'body-steps/s':>13} {'lowest':>9} {'highest':>9}")
    for kind in chosen.hulls:
        speed = speed_of(kind, chosen)
        print(
            f"{kind + ', crossing, 8 effects':34} {speed[0]:13.0f} {speed[1]:9.0f} {speed[2]:9.0f}"
        )


if __name__ == "__main__":
    machine.one_thread()
    main()
