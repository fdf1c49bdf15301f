"""Laws of one robot as machine code: the numbers of NumPy, kept on disk, refused in words."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from seals import caches
from seals.arrays import Array, namespace, some
from seals.errors import ConfigError
from seals.frames import cross, exponential, matrix_of, quaternion_of_rpy, rotation_vector
from seals.scalar_compiler import Traced, compiled, constant
from seals.scalar_compiler.graph import given

pytest.importorskip("llvmlite")


def law(a: Array, m: Array) -> list[Array]:
    """Operations of the laws: products, bounds, choices, solutions, turns."""
    xp = namespace(a)
    turn = matrix_of(quaternion_of_rpy(a))
    chosen = xp.where(a > 0.1, xp.exp(a), xp.clip(a, -0.5, None) ** 3)
    away = xp.abs(a) > 5.0
    bent = xp.concat((chosen, xp.sqrt(a * a)), axis=1) if some(away) else chosen
    solved = xp.linalg.solve(m, a[:, :, None])[:, :, 0]
    return [
        cross(a, chosen)[:, :3] @ turn[0],
        np.matmul(turn, a[:, :, None]).sum()
        if type(a) is np.ndarray
        else xp.sum(turn @ a[..., None]),
        solved + bent[:, :3],
        rotation_vector(exponential(a)),
        xp.max(a, axis=1),
        xp.cumulative_sum(a, axis=1),
    ]


def _numbers() -> tuple[Array, Array]:
    rng = np.random.default_rng(3)
    m = rng.normal(size=(2, 3, 3))
    return rng.normal(size=(2, 3)), m @ m.transpose(0, 2, 1) + np.eye(3)


def test_numbers_are_those_of_numpy() -> None:
    """Compiled results agree with NumPy's to rounding, call after call."""
    a, m = _numbers()
    kernel = compiled(law, [a.shape, m.shape])
    for scale in (1.0, -0.3):
        for own, expected in zip(kernel(scale * a, m), law(scale * a, m), strict=True):
            np.testing.assert_allclose(own, expected, rtol=1e-13, atol=1e-14)


def test_results_do_not_change_later() -> None:
    """What a call returned is its own memory."""
    a, m = _numbers()
    kernel = compiled(law, [a.shape, m.shape])
    first = kernel(a, m)
    kept = [x.copy() for x in first]
    kernel(2.0 * a, m)
    assert all(np.array_equal(x, y) for x, y in zip(first, kept, strict=True))


def test_machine_code_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second process finds the code of the first, a file that only the user can write to."""
    monkeypatch.setenv(caches.HOME, str(tmp_path))
    caches.cache_folder.cache_clear()
    try:
        for _ in range(2):
            compiled(lambda x: [x * 3.0 + 0.25], [(4,)])
        (kept,) = (tmp_path / "seals" / "kernels").iterdir()
        assert kept.suffix == ".o"
        assert os.stat(kept).st_mode & 0o077 == 0
    finally:
        caches.cache_folder.cache_clear()


def test_damaged_machine_code_is_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bit that a disk has changed is noticed, and the law is compiled anew."""
    monkeypatch.setenv(caches.HOME, str(tmp_path))
    caches.cache_folder.cache_clear()
    try:
        compiled(lambda x: [x * 3.0 + 0.25], [(4,)])
        (place,) = (tmp_path / "seals" / "kernels").iterdir()
        whole = place.read_bytes()
        for damaged in (whole[:-40], whole[:400] + b"\xff" * 8 + whole[408:], b""):
            place.write_bytes(damaged)
            (found,) = compiled(lambda x: [x * 3.0 + 0.25], [(4,)])(np.ones(4))
            assert np.array_equal(found, np.full(4, 3.25))
            assert place.read_bytes() == whole
    finally:
        caches.cache_folder.cache_clear()


def test_constants_are_folded() -> None:
    """Products with a constant zero vanish, equal operations are one, constants stay numbers."""
    node = given(0, {})
    x = Traced(np.array([node, 2.0], dtype=object))
    assert (x * constant([0.0, 3.0])).numbers == pytest.approx([0.0, 6.0])
    assert x.numbers is None
    assert (x + 1.0).entries[0] is (1.0 + (x - 0.0) * 1.0).entries[0]


def test_a_law_that_asks_for_a_number_is_refused() -> None:
    """A branch on a value is named by its place."""
    with pytest.raises(ConfigError, match=r"test_scalar_compiler, line \d+: a law asks"):
        compiled(lambda x: [x if x[0] > 0.0 else -x], [(1,)])
    with pytest.raises(ConfigError, match="asks NumPy"):
        compiled(lambda x: [np.asarray(x, dtype=float)], [(1,)])


def test_equal_laws_share_their_machine_code() -> None:
    """Two robots alike hold one function and a memory each; it is let go with the last of them."""

    def law(x: Array) -> list[Array]:
        return [3.25 * x + 0.125]

    one, other = compiled(law, [(2,)]), compiled(law, [(2,)])
    assert one.address == other.address
    first, second = one(np.array([1.0, 2.0]))[0], other(np.array([3.0, 4.0]))[0]
    assert first.tolist() == [3.375, 6.625]
    assert second.tolist() == [9.875, 13.125]
    assert one(np.array([1.0, 2.0]))[0].tolist() == first.tolist()
