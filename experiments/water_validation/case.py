"""Case of the water validation: definition and result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from seals.plugins.fluids.coupling import Device, Method
from seals.report.figures import Chart


class Grade(NamedTuple):
    """Settings of a case: resolution, device and the like.

    Args:
        quick: coarse, and only what is needed.
        device: where the particles are computed.
        threads: on the CPU; 0 for all.
        solver: of the particles.
        across: spacings across the body, of `entry`; 0 for those of the case.
    """

    quick: bool
    device: Device = Device.cpu
    threads: int = 0
    solver: Method = Method.pbf
    across: float = 0.0

    def words(self) -> list[str]:
        """Return the overrides of a run."""
        return [
            f"fluid.device={self.device.value}",
            f"fluid.threads={self.threads}",
            f"fluid.solver={self.solver.value}",
        ]

    @property
    def accelerated(self) -> bool:
        """Whether the particles are computed on an accelerator."""
        return self.device is not Device.cpu

    def command(self, name: str) -> str:
        """Return the command that runs a case in this way.

        Example:
            >>> Grade(quick=True).command("heave")
            'seals validate water heave'
        """
        more = ("" if self.quick else " --full") + (
            f" --device {self.device.value}" if self.accelerated else ""
        )
        more += "" if self.solver is Method.pbf else f" --solver {self.solver.value}"
        more += f" --across {self.across:g}" if self.across else ""
        return f"seals validate water {name}{more}"


class Line(NamedTuple):
    """One figure against its reference.

    Args:
        what: quantity and unit.
        found: by the simulation.
        reference: measured, or exact.
        error: of the simulation against it, in the unit of ``allowed``.
        allowed: largest error to pass; None where the figure is only published.
        share: whether error and allowed are shares, printed as per cent.
    """

    what: str
    found: float
    reference: float
    error: float
    allowed: float | None
    share: bool = True

    @property
    def passed(self) -> bool | None:
        """Return whether the error is within its bound; None without a bound."""
        return None if self.allowed is None else bool(self.error <= self.allowed)


class Outcome(NamedTuple):
    """Result of one case.

    Args:
        lines: figures.
        charts: simulated curves with their reference.
        particles: of water.
        spacing: of them [m].
        across: spacings across the length that matters.
        source: of the reference.
        remark: a sentence on what limits it.
    """

    lines: Sequence[Line]
    charts: Sequence[Chart]
    particles: int
    spacing: float
    across: float
    source: str
    remark: str = ""


class Case(NamedTuple):
    """A case by name.

    Args:
        name: of the case, also of its picture.
        title: one line.
        run: takes how to run it.
        quick: whether it is part of the quick set.
    """

    name: str
    title: str
    run: Callable[[Grade], Outcome]
    quick: bool = True


def relative(what: str, found: float, reference: float, allowed: float | None) -> Line:
    """Return a figure whose error is a share of the reference.

    Example:
        >>> relative("period [s]", 1.02, 1.0, 0.03).passed
        True
    """
    return Line(what, found, reference, abs(found / reference - 1.0), allowed)
