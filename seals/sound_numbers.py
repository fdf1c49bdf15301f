"""The one boundary at which numbers that cannot be computed with become words.

Each number may lie within its bounds, and their system still have no solution: a controller without
gravity to lean on, a fit of fewer rows than unknowns, a load so heavy that its square overflows.
"""

from __future__ import annotations

import contextlib
import math
import traceback
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from seals.errors import LogError, PhysicsError, SealsError

_LIBRARIES = ("numpy", "scipy", "torch")
"""Packages whose complaint about a value is one about numbers."""


def numeric_fault(error: BaseException) -> str | None:
    """Return words for an error of arithmetic or linear algebra, else None.

    An index or a value that a library of numbers complains about is one of numbers; one beyond the
    end of an array in a line of this package is a fault of that line, and keeps its traceback.

    Example:
        >>> numeric_fault(ZeroDivisionError("float division by zero"))
        'ZeroDivisionError, float division by zero'
        >>> numeric_fault(KeyError("a")) is None
        True
    """
    if isinstance(error, SealsError):
        return None
    # by name: NumPy is not imported to explain an error
    algebra = type(error).__name__ == "LinAlgError"
    numbers = algebra or isinstance(error, ArithmeticError)
    if not numbers and not (isinstance(error, ValueError | IndexError) and _of_library(error)):
        return None
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "seals" in Path(frame.filename).parts]
    # in a checkout the plug-ins lie beside the package
    found = own or list(frames)
    place = f" in {Path(found[-1].filename).stem}.{found[-1].name}" if found else ""
    return f"{type(error).__name__}, {' '.join(str(error).split())[:160]}{place}"


def arises_inside(error: BaseException) -> bool:
    """Return whether an error was raised in this package or a library of numbers it calls."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    module = "" if trace is None else str(trace.tb_frame.f_globals.get("__name__", ""))
    return module.partition(".")[0] in {"seals", *_LIBRARIES}


def refuse_not_finite(odd: Sequence[str], where: str, advice: str) -> None:
    """Refuse components that compute with non-finite numbers.

    Args:
        odd: names of such numbers; none for sound ones.
        where: place or time, for the message.
        advice: what to do about it.

    Raises:
        PhysicsError: there are some.

    Example:
        >>> refuse_not_finite(["the reward"], "at step 3", "Look into the task.")
        Traceback (most recent call last):
        seals.errors.PhysicsError: the reward is not finite at step 3.
        Look into the task.
    """
    if odd:
        verb = "is" if len(odd) == 1 else "are"
        raise PhysicsError(f"{', '.join(odd)} {verb} not finite {where}.\n{advice}")


@contextlib.contextmanager
def sound_numbers(what: str, advice: str) -> Iterator[None]:
    """Turn errors of arithmetic and linear algebra inside the block into bad data.

    Args:
        what: that is computed, for the message.
        advice: what to do.

    Raises:
        LogError: such an error; it is the cause.
    """
    try:
        yield
    except Exception as cause:
        words = numeric_fault(cause)
        if words is None:
            raise
        raise LogError(f"{what} cannot be computed from these numbers: {words}.\n{advice}") from (
            cause
        )


@contextlib.contextmanager
def trials() -> Iterator[None]:
    """Let arithmetic overflow without a warning: for fits, whose diverging trials are refused.

    What such arithmetic returns is not finite: `refuse_undefined` is for the results.
    """
    import numpy as np

    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        yield


def refuse_undefined(what: str, values: Iterable[float]) -> None:
    """Refuse results that are not finite.

    Args:
        what: that is computed, for the message.
        values: of the result.

    Raises:
        LogError: one of them is not finite.

    Example:
        >>> refuse_undefined("misfit", [float("nan")])
        Traceback (most recent call last):
        seals.errors.LogError: no misfit can be computed: readings, or the motion between them, ...
    """
    if not all(math.isfinite(value) for value in values):
        raise LogError(
            f"no {what} can be computed: readings, or the motion between them, are not finite.\n"
            "Check the channels of the log, or cut out a valid part with span=."
        )


def _of_library(error: BaseException) -> bool:
    frames = traceback.extract_tb(error.__traceback__)
    last = frames[-1].filename if frames else ""
    # of another process, only the text of the trace is left
    remote = str(error.__cause__) if error.__cause__ is not None else ""
    lines = [line for line in remote.splitlines() if line.lstrip().startswith('File "')]
    parts = {*Path(last).parts, *(Path(lines[-1].split('"')[1]).parts if lines else ())}
    return bool(parts & set(_LIBRARIES))
