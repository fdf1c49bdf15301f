"""Checks of an effect's hooks at single instants: libraries, purity, batching, state, power."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Array
from seals.contract import ContractError, require
from seals.effects.binding import bind_effects
from seals.effects.effect import Effect, Parameters
from seals.motion import Timing
from seals.schema import parameters_of
from seals.testing.calling import QUIET, call_hook, expected_shapes, is_bundle, nothing
from seals.testing.instants import (
    Instant,
    converted,
    copied,
    leaves,
    picked,
    random_instant,
    repeated,
)

ROWS = 7
EQUAL = 1e-12
"""Largest difference between two evaluations of one law, relative to the largest value or 1."""

PASSIVE = ("drag", "damping", "friction")
"""Words in a phenomenon that promise never to drive a body."""

_AT_LINKS = "Use whole arrays with one row per link or sample, as described in seals.Effect."
_AT_JOINTS = (
    "Joints and the force have the shape (N, J), motion and medium J N rows, joint by joint: "
    "seals.by_joint(column, joints) turns a column of them into (N, J)."
)


class HookCheck:
    """Checks of one effect, with its parameters varied over a batch.

    Args:
        name: of the effect, named in refusals.
        effect: with material parameter values.
        hooks: it defines.
        seed: of the random instants.
    """

    def __init__(self, name: str, effect: Effect, hooks: tuple[str, ...], *, seed: int = 0) -> None:
        self.name, self.effect, self.hooks = name, effect, hooks
        self.rng = np.random.default_rng(seed)
        self.values: dict[str, Any] = {}
        for parameter, meta in parameters_of(effect).items():
            value = getattr(effect, parameter)
            if isinstance(value, float):
                spread = value * self.rng.uniform(0.7, 1.3, ROWS)
                self.values[f"it.{parameter}"] = np.clip(spread, *meta.bounds)

    def run(self) -> tuple[str, ...]:
        """Run all checks and return the array libraries that were used."""
        used = {"numpy"}
        for hook in self.hooks:
            for still in (False, True):
                instant = random_instant(self.rng, ROWS, still=still)
                memory = self._memory(hook)
                expected = self._call(hook, instant, memory, self._params(np.zeros(1)))
                self._check_shape(hook, expected)
                if hook == "inertia_change":
                    bound = bind_effects({"it": self.effect}, [_link(self.effect)])
                    output, _ = call_hook(self.effect, hook, instant, None, bound.bound[0].params)
                    self._require(
                        tuple(output.shape) == (ROWS, 6, 6),
                        f"{hook} returns {tuple(output.shape)} for {ROWS} bodies of one change",
                        f"Allowed: ({ROWS}, 6, 6): add zeros in the rows of the body.",
                    )
                self._check_nothing(hook, instant, expected)
                # check that a second call gives the same result and leaves its arguments unchanged
                params = dict(self._params(np.zeros(1)))
                given = (instant, memory, tuple(params.values()))
                before = copied(tuple(given))
                again = self._call(hook, instant, memory, params)
                self._require(
                    _apart(given, before) == 0.0,
                    f"{hook} changes its inputs",
                    "Create new arrays; never write in place.",
                )
                self._require(
                    _apart(again, expected) == 0.0,
                    f"{hook} gives a different result when called again",
                    "Keep no state: use memory.",
                )
                self._check_rows(hook, instant, memory, expected)
                self._check_implicit(hook, instant, memory, expected[0])
                used |= self._check_libraries(hook, instant, memory, expected)
            self._check_power(hook)
        return tuple(sorted(used))

    def _params(self, like: Array, row: int | None = None) -> Parameters:
        """Parameter arrays of the batch, or of one row."""
        bound = bind_effects({"it": self.effect}, [_link(self.effect)])
        if row is None:
            return bound.with_values(self.values, like, ROWS).bound[0].params
        return (
            bound.with_values({k: v[row : row + 1] for k, v in self.values.items()}, like, 1)
            .bound[0]
            .params
        )

    def _call(
        self, hook: str, instant: Instant, memory: Array | None, params: Parameters
    ) -> tuple[Any, Any]:
        """Output and new memory of one hook; arrays that do not fit are refused by its name."""
        try:
            return call_hook(self.effect, hook, instant, memory, params)
        except (ValueError, IndexError) as cause:
            remedy = _AT_JOINTS if hook == "joint_loads" else _AT_LINKS
            raise ContractError(
                f"{self.name}: {hook} fails on arrays of {ROWS} rows: {cause}.\n{remedy}"
            ) from cause

    def _memory(self, hook: str) -> Array | None:
        """Memory after three calls from zero, or None."""
        size = self.effect.memory_size
        if not size:
            return None
        memory: Array = np.zeros((ROWS, size))
        for _ in range(3):
            _, memory = self._call(
                hook, random_instant(self.rng, ROWS), memory, self._params(np.zeros(1))
            )
        return memory

    def _check_shape(self, hook: str, expected: tuple[Any, Any]) -> None:
        """Check the shapes of output and memory, and that all is finite."""
        output, kept = expected
        self._require(
            is_bundle(hook, output),
            f"{hook} returns a {type(output).__name__}",
            "Return the bundle of seals.motion that the hook promises.",
        )
        shapes = expected_shapes(hook, output, ROWS)
        for leaf, allowed in zip(leaves(output), shapes, strict=True):
            fits = leaf is None or (tuple(leaf.shape) in allowed and bool(np.isfinite(leaf).all()))
            self._require(
                fits,
                f"{hook} returns an array of shape {getattr(leaf, 'shape', None)}, or not finite",
                f"Allowed: {' or '.join(map(str, allowed))}."
                + (f"\n{_AT_JOINTS}" if hook == "joint_loads" else ""),
            )
        size = self.effect.memory_size
        good = kept is None if size == 0 else kept is not None and tuple(kept.shape) == (ROWS, size)
        self._require(
            good,
            f"{hook} returns memory of shape {getattr(kept, 'shape', None)}",
            f"Allowed: ({ROWS}, {size}) for {ROWS} rows; without memory return the input.",
        )

    def _check_nothing(self, hook: str, instant: Instant, found: tuple[Any, Any]) -> None:
        """Check that a zero change has no effect, and a significant one has."""
        same = nothing(hook, instant)
        declared = parameters_of(self.effect)
        plain = type(self.effect)(links=self.effect.links)
        zero = all(getattr(plain, p) == 0.0 for p, meta in declared.items() if meta.fit)
        if same is None or not zero:
            return
        bound = bind_effects({"it": plain}, [_link(plain)])
        given = bound.with_values({}, np.zeros(1), ROWS).bound[0].params
        output, _ = call_hook(plain, hook, instant, None, given)
        apart = _apart(_filled(output), same)
        self._require(
            apart <= EQUAL,
            f"{hook} changes {apart:.1e} while all its parameters are zero",
            "Zero must mean no change.",
        )
        self._require(
            hook not in QUIET or _apart(_filled(found[0]), same) > EQUAL,
            f"{hook} has no effect at significant values",
            "Use the parameters, or give values=.",
        )

    def _check_rows(
        self, hook: str, instant: Instant, memory: Array | None, expected: tuple[Any, Any]
    ) -> None:
        """Check that each row alone gives the same result, and a medium of one row is broadcast."""
        for row in range(ROWS):
            alone = self._call(
                hook, picked(instant, row), picked(memory, row), self._params(np.zeros(1), row)
            )
            apart = _apart(alone, picked(expected, row))
            self._require(
                apart <= EQUAL,
                f"{hook} of row {row} alone differs from the batch by {apart:.1e}",
                "Rows must not mix: sum over axis 1 only.",
            )
        full = instant._replace(medium=repeated(instant.medium, ROWS))
        apart = _apart(self._call(hook, full, memory, self._params(np.zeros(1))), expected)
        self._require(
            apart <= EQUAL,
            f"{hook} reads a medium of one row as {apart:.1e} off",
            "Broadcast along axis 0.",
        )

    def _check_libraries(
        self, hook: str, instant: Instant, memory: Array | None, expected: tuple[Any, Any]
    ) -> set[str]:
        """Check the results under other array libraries and return the libraries' names."""
        likes = other_libraries()
        for library, like in likes.items():
            given, kept = converted(instant, like), converted(memory, like)
            try:
                found = call_hook(self.effect, hook, given, kept, self._params(like))
            except Exception as cause:  # whatever a library raises, the law asked for it
                raise ContractError(
                    f"{self.name}: {hook} fails under {library}: {type(cause).__name__}: {cause}.\n"
                    "Use functions of seals.arrays.namespace(x), and Python scalars only."
                ) from cause
            apart = _apart(copied(found), expected)
            self._require(
                apart <= EQUAL,
                f"{hook} under {library} differs by {apart:.1e} from NumPy",
                "Use one formula for all.",
            )
        return set(likes)

    def _check_implicit(
        self, hook: str, instant: Instant, memory: Array | None, output: Any
    ) -> None:
        """Check that a law which steps take implicitly is that of ``joint_loads``, and stable."""
        if hook == "joint_drive":
            held = np.clip(output.force, -output.limit, output.limit)
            plain, _ = self._call("joint_loads", instant, memory, self._params(np.zeros(1)))
            apart = _apart(held, plain)
            self._require(
                apart <= EQUAL,
                f"joint_drive within its limit differs by {apart:.1e} from joint_loads",
                "Both are one law: joint_loads is the force of joint_drive within its limit.",
            )
        steep = {"joint_drive": output[1:3], "joint_resistance": (output,)}.get(hook, ())
        least = min((float(np.min(x)) for x in steep), default=0.0)
        self._require(
            least >= 0.0,
            f"{hook} returns a slope of {least:.2g}",
            "Allowed: slopes of 0 or more; an implicit step with negative slopes diverges.",
        )

    def _check_power(self, hook: str) -> None:
        """Check that a drag never drives the body through the medium."""
        owned = " ".join(self.effect.accounts_for)
        if self.effect.memory_size:
            # what is stored may come back
            return
        if hook not in ("loads", "joint_loads", "drive_loads") or not any(
            word in owned for word in PASSIVE
        ):
            return
        instant = random_instant(self.rng, ROWS)
        output, _ = self._call(hook, instant, self._memory(hook), self._params(np.zeros(1)))
        if hook == "joint_loads":
            power = np.sum(output * instant.joints.velocity, axis=1)
        else:
            motion = instant.motion
            relative = motion.velocity - instant.medium.velocity
            force, torque = (0.0 if part is None else part for part in output)
            power = np.sum(force * relative + torque * motion.angular_velocity, axis=1)
        most = float(power.max())
        self._require(
            most <= 1e-12,
            f"{hook} accounts for {owned} and gives {most:.2g} W to the body",
            "Turn the sign.",
        )

    def _require(self, kept: bool, broken: str, remedy: str) -> None:
        require(kept, self.name, broken, remedy)


def other_libraries() -> Mapping[str, Array]:
    """Return a float64 array of every further library installed: array-api-strict, PyTorch."""
    found: dict[str, Array] = {}
    if importlib.util.find_spec("array_api_strict"):
        import array_api_strict

        found["array-api-strict"] = array_api_strict.zeros(1, dtype=array_api_strict.float64)
    if importlib.util.find_spec("torch"):
        import torch

        found["torch"] = torch.zeros(1, dtype=torch.float64)
    return found


def _link(effect: Effect) -> str:
    """A link name that the effect's own list allows."""
    return next((link for link in effect.links if link not in ("*", "root")), "base")


def _filled(output: Any) -> Any:
    """Convert a change of timing from numbers to arrays; other outputs stay."""
    if not isinstance(output, Timing):
        return output
    return Timing(*(np.full((1, 1), x) if isinstance(x, int | float) else x for x in output))


def _apart(found: Any, expected: Any) -> float:
    """Largest difference relative to the largest value or 1; None stands for zero, as in motion."""
    most = 0.0
    pairs = list(zip(leaves(found), leaves(expected), strict=True))
    for pair in pairs:
        a, b = (0.0 if x is None else x for x in pair)
        wide = np.broadcast_shapes(np.shape(a), np.shape(b))
        scale = max(1.0, float(np.abs(b).max(initial=0.0)))
        difference = np.abs(np.broadcast_to(a, wide) - np.broadcast_to(b, wide))
        most = max(most, float(difference.max(initial=0.0)) / scale)
    return most
