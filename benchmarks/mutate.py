"""Pytest plug-in that breaks one law, as the environment variable SEALS_MUTATION states.

    SEALS_MUTATION=effect:gravity:loads:sign python -m pytest -p benchmarks.mutate tests/unit

Nothing on disk is touched: the hook is replaced in the class and put back.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals import registry
from seals.arrays import Array, as_like, columns, namespace
from seals.motion import AddedInertia, Drives, Motion, Reading, Timing, Wrench

VARIABLE = "SEALS_MUTATION"
MUTATIONS = ("sign", "frame", "attitude", "size")
"""What is done to a law: its output changes sign; its vectors are turned by a yaw of 90 degrees;
it sees the attitude transposed, world and body exchanged; its output is 10 % too large."""
CONTROL = "none"
"""The law as it is, called in the same roundabout way: everything must pass."""
HOOKS = (
    "loads",
    "drive_loads",
    "inertia",
    "inertia_change",
    "flow",
    "joint_loads",
    "actuation",
    "drives",
    "measure",
    "timing",
)
_BARE = ("inertia_change", "actuation", "drives", "measure", "timing")
"""Hooks that hand back no memory."""
_FACTOR = {"sign": -1.0, "size": 1.1}
_YAW = np.kron(np.eye(2), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))


class Mutant(NamedTuple):
    """One broken law.

    Args:
        kind: effect or actuator.
        name: of the plug-in.
        hook: that is broken.
        mutation: how, one of ``MUTATIONS``.
    """

    kind: str
    name: str
    hook: str
    mutation: str

    def __str__(self) -> str:
        return ":".join(self)


def mutants_of(kind: str, name: str) -> list[Mutant]:
    """Return all mutants of one plug-in, after the control of each hook."""
    cls = registry.get(kind, name).load()
    hooks = [hook for hook in HOOKS if callable(getattr(cls, hook, None))]
    ways = (CONTROL, *MUTATIONS)
    return [Mutant(kind, name, hook, mutation) for hook in hooks for mutation in ways]


@contextlib.contextmanager
def broken(mutant: Mutant) -> Iterator[None]:
    """Break a law inside the block."""
    cls = registry.get(mutant.kind, mutant.name).load()
    own = vars(cls).get(mutant.hook)
    setattr(cls, mutant.hook, staticmethod(turned(getattr(cls, mutant.hook), mutant)))
    try:
        yield
    finally:
        if own is None:
            delattr(cls, mutant.hook)
        else:
            setattr(cls, mutant.hook, own)


def turned(law: Callable[..., Any], mutant: Mutant) -> Callable[..., Any]:
    """Return the law, broken."""

    def wrong(*given: Any) -> Any:
        if mutant.mutation == "attitude":
            return law(*(_transposed(x) if isinstance(x, Motion) else x for x in given))
        found = law(*given)
        if mutant.mutation == CONTROL:
            return found
        if mutant.hook in _BARE:
            return _changed(found, given[0], mutant)
        output, memory = found
        return _changed(output, given[0], mutant), memory

    return wrong


def _changed(output: Any, given: Any, mutant: Mutant) -> Any:
    """The output of a law, wrong."""
    factor, found = _FACTOR.get(mutant.mutation), output
    if isinstance(output, Wrench):
        found = Wrench(*(None if x is None else _vector(x, factor) for x in output))
    elif isinstance(output, AddedInertia):
        found = output._replace(matrix=_matrix(output.matrix, factor))
    elif isinstance(output, Reading):
        pairs = zip(output, given, strict=True)
        found = Reading(*(b + _vector(a - b, factor) for a, b in pairs))
    elif isinstance(output, Drives):
        found = _drives(output, given if mutant.hook == "actuation" else None, factor)
    elif mutant.hook == "inertia_change":
        found = _matrix(output, factor)
    elif mutant.hook == "flow":
        found = _vector(output, factor)
    elif factor is not None:
        # times and torques of joints have a size and a sign, but no direction
        found = (
            Timing(*(factor * x for x in output)) if isinstance(output, Timing) else factor * output
        )
    return found


def _drives(output: Drives, given: Drives | None, factor: float | None) -> Drives:
    """Thrusts wrong; without a factor the drives themselves are turned, places and axes."""
    if factor is None:
        if given is not None:
            return output
        return output._replace(
            position=_vector(output.position, None), axis=_vector(output.axis, None)
        )
    thrust, torque = (0.0, 0.0) if given is None else (given.thrust, given.torque)
    return output._replace(
        thrust=thrust + factor * (output.thrust - thrust),
        torque=torque + factor * (output.torque - torque),
    )


def _vector(x: Array, factor: float | None) -> Array:
    """Vectors times a factor, or turned by a yaw of 90 degrees."""
    return columns(-x[:, 1], x[:, 0], x[:, 2]) if factor is None else factor * x


def _matrix(x: Array, factor: float | None) -> Array:
    """6x6 matrices times a factor, or turned by a yaw of 90 degrees."""
    if factor is not None:
        return factor * x
    turn = as_like(_YAW, x)
    return namespace(x).matmul(namespace(x).matmul(turn, x), as_like(_YAW.T, x))


def _transposed(motion: Motion) -> Motion:
    """The motion of a body whose attitude is the inverse one."""
    rotation = namespace(motion.rotation).permute_dims(motion.rotation, (0, 2, 1))
    return motion._replace(rotation=rotation, up=rotation[:, 2, :])


class Watch:
    """Pytest plug-in that records the first failure."""

    def __init__(self) -> None:
        """Nothing failed as yet."""
        self.first = ""

    def pytest_collectreport(self, report: Any) -> None:
        """Record a test file that cannot be imported."""
        self._keep(report)

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Record a failing test."""
        self._keep(report)

    def _keep(self, report: Any) -> None:
        if report.failed and not self.first:
            self.first = report.nodeid or "collection"


def first_failures(mutants: Sequence[Mutant], words: Sequence[str]) -> dict[str, str]:
    """First failing test under every mutant, empty for none, all in this process.

    Modules of tests stay loaded: what one of them keeps of a law is what the first mutant made of
    it, so that one should be the control.

    Args:
        mutants: one after the other.
        words: arguments of pytest.

    Raises:
        RuntimeError: the tests did not run.
    """
    import pytest

    found = {}
    for mutant in mutants:
        watch = Watch()
        with broken(mutant):
            code = pytest.main(list(words), plugins=[watch])
        if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED) and not watch.first:
            raise RuntimeError(f"{mutant}: pytest ended with {code!r}")
        found[str(mutant)] = watch.first
    return found


_held = contextlib.ExitStack()


def pytest_configure() -> None:
    """Break the law before any test module is imported."""
    words = os.environ.get(VARIABLE, "")
    if words:
        _held.enter_context(broken(Mutant(*words.split(":"))))


def pytest_unconfigure() -> None:
    """Restore the law."""
    _held.close()
