"""Kernels of an accelerator give the numbers of NumPy: laws, loops, batches, environments."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.arrays import iterate, namespace
from seals.config.compose import compose
from seals.pytree import leaves, mapped
from seals.run import build_twin
from seals.run.build import run_settings
from seals.scalar_compiler import CannotCompile
from seals.scalar_compiler.device_rows import DeviceLaw, DeviceRowKernel
from tests.device_code import use_host_compiler

torch = pytest.importorskip("torch", reason="tensors need torch: pip install 'aam-seals[learn]'")

BATCH = 16


@pytest.fixture(autouse=True)
def _host(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    use_host_compiler(monkeypatch, tmp_path)


def law(x: Any, y: Any) -> list[Any]:
    """Functions, links within a batch, a matrix, numbers, and a condition."""
    xp = namespace(x)
    turned = xp.stack([x[:, 0] * y[:, 1], xp.tanh(x[:, 1]), xp.expm1(y[:, 0]) + x[:, 2]], axis=1)
    matrix = xp.reshape(xp.concat([turned, x], axis=1), (-1, 2, 3))
    links = xp.concat([y, xp.maximum(y, y[:, ::-1]) ** 1.5], axis=0)
    return [turned, matrix, links, xp.zeros((len(x), 2)) + 3.0, x[:, 0] < y[:, 0], turned[:, 0]]


@pytest.mark.parametrize("kind", [torch.float64, torch.float32])
def test_a_law_of_rows_becomes_a_kernel(kind: Any) -> None:
    """Every result has the shape and the numbers of NumPy, whatever lies in which order."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0.1, 2.0, (7, 3)), rng.uniform(0.1, 2.0, (7, 2))
    kernel = DeviceRowKernel(law, [(1, 3), (1, 2)], torch.zeros(1, dtype=kind), rows=1_000_000)
    assert "__launch_bounds__" in kernel.text
    given = [torch.tensor(x, dtype=kind), torch.tensor(y.T.copy(), dtype=kind).T]
    exact = 1e-14 if kind is torch.float64 else 1e-6
    for found, expected in zip(kernel(given), law(x, y), strict=True):
        assert found.shape == expected.shape
        np.testing.assert_allclose(found.numpy(), expected, rtol=exact, atol=exact)


def test_a_loop_changes_all_its_entries_at_once_and_ends_early() -> None:
    """Fibonacci's numbers, a loop inside it, and Newton's root that is found before the end."""

    def grown(x: Any) -> Any:
        def turn(held: Any) -> Any:
            a, b, count, still = held
            more = iterate(lambda n: n + a * 0.0 + 1.0, count, 3)
            return b, a + b, more, still

        xp = namespace(x)
        root = iterate(
            lambda r: (0.5 * (r[0] + x / r[0]), r[0]),
            (x + 1.0, x),
            60,
            lambda r: xp.all(xp.abs(r[0] - r[1]) < 1e-15),
        )
        return iterate(turn, (x * 0.0, x, x * 0.0, x * 0.0 + 5.0), 10), root[0]

    x = np.array([[2.0], [3.0]])
    made = DeviceLaw(grown, torch.zeros(1, dtype=torch.float64))
    found = made(torch.tensor(x))
    assert [part[:, 0].tolist() for part in found[0]] == [
        [110.0, 165.0],
        [178.0, 267.0],
        [30.0, 30.0],
        [5.0, 5.0],
    ]
    np.testing.assert_allclose(found[1].numpy(), np.sqrt(x), rtol=1e-15)
    assert made._kernel.text.count("for (int") == 3
    for part, expected in zip(leaves(found), leaves(grown(x)), strict=True):
        np.testing.assert_allclose(part.numpy(), expected, rtol=1e-15)


def test_a_law_that_asks_for_a_number_has_no_kernel() -> None:
    """It is told where."""
    with pytest.raises(CannotCompile, match="test_device_rows, line"):
        DeviceRowKernel(lambda x: [x if float(x[0, 0]) > 0 else -x], [(1, 1)], torch.zeros(1))


@pytest.mark.parametrize("water", ["none", pytest.param("airy", marks=pytest.mark.thorough)])
def test_a_batch_on_an_accelerator_moves_as_one_on_numpy(
    water: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """States and memories of effects agree to 1e-10 after 25 steps, in single precision to 1e-3."""
    monkeypatch.setattr("seals.batch.model.on_accelerator", lambda x: isinstance(x, torch.Tensor))
    words = ["robot=crazyflie", "+effect@effects.more=linear_drag"]
    words += [] if water == "none" else ["water=fossen", f"wave={water}"]
    settings = run_settings(words)
    rng = np.random.default_rng(4)
    values = {"more.coefficient_x": rng.uniform(0.01, 0.2, BATCH)}
    spread = {"position": 0.3, "velocity": 1.0, "angular_velocity": 0.5, "rpy": 0.4}
    starts = {name: rng.normal(size=(BATCH, 3)) * width for name, width in spread.items()}

    def flown(like: Any) -> dict[str, Any]:
        twin, _ = build_twin(settings, batch=BATCH, like=like, values=values)
        state = twin.start(**starts)
        for k in range(25):
            state, rates = twin.step(state, 0.02 * k, 0.02)
        parts = {**state._asdict(), **twin.memory, "felt": rates.specific_force}
        return {name: np.asarray(x, dtype=float) for name, x in parts.items()}

    plain = flown(np.zeros(1))
    assert np.any(np.abs(plain["velocity"]) > 1.0)
    for kind, exact in ((torch.float64, 1e-10), (torch.float32, 1e-3)):
        for name, found in flown(torch.zeros(1, dtype=kind)).items():
            expected = plain[name]
            np.testing.assert_allclose(found, expected, rtol=exact, atol=exact, err_msg=name)


def test_a_batch_without_a_kernel_is_computed_operation_by_operation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A compiler that refuses the text, or none, leaves the result as it is."""

    def refused(text: str) -> Any:
        raise CannotCompile("no compiler")

    monkeypatch.setattr("seals.scalar_compiler.device_rows._compiled", refused)
    settings, found = run_settings(["robot=ball"]), []
    for there in (True, False):
        monkeypatch.setattr("seals.batch.model.on_accelerator", lambda x, there=there: there)
        twin, start = build_twin(settings, batch=2, like=torch.zeros(1, dtype=torch.float64))
        found.append(twin.step(start, 0.0, 0.02)[0].velocity)
    assert torch.equal(*found)
    assert bool((found[0][:, 2] < -0.1).all())


@pytest.mark.thorough
@pytest.mark.parametrize("task", ["hover", pytest.param("reach", marks=pytest.mark.slow)])
def test_a_control_step_on_an_accelerator_is_that_of_numpy(task: str) -> None:
    """Robots, verdicts, rewards and observations of four steps, each robot with its own drag."""
    from seals.learn.environments import batched_of

    config = compose([f"env={task}", "backend=twin", "task.duration=0.12"], root="learn")
    rng = np.random.default_rng(7)
    values = {"water_drag.coefficient_x": rng.uniform(5.0, 20.0, BATCH)}
    plain: Any = batched_of(config, count=BATCH, values=values)
    plain.reset(list(range(BATCH)))
    fresh = plain.simulator.begin(plain.task.draw(rng, BATCH))
    made = DeviceLaw(plain._law_of_one, torch.zeros(1, dtype=torch.float64))
    scene = plain._scene
    for _ in range(4):
        asked = rng.uniform(-1.0, 1.0, (BATCH, plain.action_size))
        own = {name: value[:, None] for name, value in values.items()}
        held = mapped((own, scene, fresh, asked), lambda x: torch.tensor(np.array(x)))
        scene, expected = plain._law(scene, asked, fresh)
        found = made(*held)
        for a, b in zip(leaves(found), leaves((scene, expected)), strict=True):
            # rewards and observations of NumPy are in single precision
            np.testing.assert_allclose(
                np.asarray(a, float), np.asarray(b, float), rtol=1e-6, atol=1e-6
            )
    assert bool(np.any(scene.ledger.steps < 2.0))
