"""Diagnosis of a log for Python programs, in the style of scikit-learn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from seals.errors import ConfigError
from seals.logs.log import Log
from seals.sysid.diagnosis import Diagnosis, diagnose
from seals.sysid.predictors.linearise import predict
from seals.sysid.predictors.problem import prepare, rewindowed
from seals.sysid.report.settable import Settable, bar, read_usable
from seals.sysid.report.threads import one_thread

_STAGES = 6
_TICKS = 32
"""Ticks of the progress bar a stage."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Fitted parameter with its 90 % interval.

    Args:
        value: best estimate, the change against the stated model.
        low90: lower end of its 90 % interval.
        high90: upper end of it.
        unit: of all three.
    """

    value: float
    low90: float
    high90: float
    unit: str


class MissingEffect(Settable):
    """Estimator of the physical effect that the model of a log is missing.

    Nothing is drawn at random: starting values are fixed, the fits are damped Gauss-Newton steps,
    and results are collected in order however many processes share the work. The same log on the
    same machine gives the same answer.

    Args:
        processes: that share the fits.
        progress: whether a bar shows how far ``fit`` is, on a terminal.

    Attributes:
        verdict_: ``named``, ``ambiguous``, ``none_of_these``, ``nothing_missing`` or
            ``cannot_tell``.
        effects_: estimates by effect and parameter; the claimed one first. With ``ambiguous`` they
            are the members of the set.
        confidence_: by effect, that it is this one and no other.
        held_out_error_: misfit per degree of freedom on rows that no fit saw: ``before``, ``after``
            and ``noise_floor``.
        diagnosis_: all of it.

    Example:
        >>> missing = MissingEffect().fit("hidden_effect/flight_a")
        >>> missing.verdict_, missing.held_out_error_["after"] < 1.1
        ('named', True)
        >>> missing.score("hidden_effect/flight_b") > -1.1  # a flight that no fit saw
        True
    """

    verdict_: str
    effects_: dict[str, dict[str, Estimate]]
    confidence_: dict[str, float]
    held_out_error_: dict[str, float]
    diagnosis_: Diagnosis
    _log: Log

    def __init__(self, *, processes: int = 1, progress: bool = False) -> None:
        self.processes = processes
        self.progress = progress

    def fit(self, log: Log | str | Path, y: object = None) -> MissingEffect:
        """Diagnose a log and return the estimator itself.

        Args:
            log: the log, its folder, or the short name of one that comes with the package.
            y: ignored; there for tools that pass a target.

        Raises:
            ConfigError: there is no such log, or a setting is impossible.
            LogError: the log cannot be used.
        """
        if isinstance(self.processes, bool) or self.processes < 1:
            raise ConfigError(f"processes={self.processes} is not allowed.\nAllowed: 1 and more.")
        read = read_usable(log)
        with one_thread(), bar(self.progress, "diagnosing", _STAGES * _TICKS) as tell:
            found = diagnose(
                read, processes=self.processes, tell=lambda stage: tell(stage * _TICKS)
            )
        table = found.to_dict()
        self._log, self.diagnosis_ = read, found
        self.verdict_ = str(table["verdict"])
        self.effects_ = {
            e["name"]: {k: Estimate(**p) for k, p in e["parameters"].items()}
            for e in table["effects"]
        }
        self.confidence_ = {e["name"]: float(e["confidence"]) for e in table["effects"]}
        self.held_out_error_ = {k: float(v) for k, v in found.held_out.items()}
        return self

    def score(self, log: Log | str | Path, y: object = None) -> float:
        """Return how well the found model explains another log: larger is better, -1 is perfect.

        Nothing is fitted to the other log but the start of every window of a second; effects and
        nominal values are those of the fitted log, and the twin predicts.

        Args:
            log: of the same vehicle.
            y: ignored.

        Returns:
            Less the misfit per degree of freedom; noise and stated gusts leave -1.

        Raises:
            ConfigError: the log is of another vehicle.
            LogError: the log cannot be used.
            NotFitted: ``fit`` was not called.
        """
        fitted = self.diagnosis_.hypothesis
        with one_thread():
            return -misfit_of(read_usable(log), fitted.fit.values, self.diagnosis_)

    def report(self, folder: str | Path) -> Path:
        """Write ``report.html`` and ``report.json`` of the fitted log; return the page.

        Args:
            folder: made where it is not there.

        Raises:
            NotFitted: ``fit`` was not called.
        """
        from seals.sysid.report.report import write_report

        with one_thread():
            return write_report(self.diagnosis_, self._log, Path(folder))


def misfit_of(log: Log, values: Mapping[str, float], found: Diagnosis) -> float:
    """Return the misfit per degree of freedom that a found model leaves of another log.

    Args:
        log: of the same vehicle.
        values: of the model's parameters.
        found: the diagnosis that they come from.

    Raises:
        ConfigError: the log is of another vehicle.
    """
    problem = prepare(log)
    own, other = found.problem.vehicle.name, problem.vehicle.name
    unknown = [k for k in values if k not in problem.plant.candidate_set.parameters]
    if own != other or unknown:
        what = f"of '{other}'" if own != other else f"without {', '.join(unknown[:3])}"
        raise ConfigError(
            f"the model was found on '{own}', log '{log.name}' is {what}.\n"
            "Give a log of the same vehicle."
        )
    late = found.hypothesis.fitter.windows.delay
    fitter = rewindowed(problem.fitter, delay=late) if late else problem.fitter
    # exponents refer to the speeds and the voltage of the log in which they were fitted
    fitted, stated = found.problem.plant.candidate_set.effects, problem.vehicle.effects
    added = {name: effect for name, effect in fitted.items() if name not in stated}
    candidate_set = problem.plant.candidate_set
    candidate_set = replace(candidate_set, effects={**candidate_set.effects, **added})
    plant = problem.plant.of(candidate_set)
    return fitter.windows.level(predict(plant, fitter.trajectory, values, delay=late))
