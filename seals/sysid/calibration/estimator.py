"""Calibration for Python programs, in the style of scikit-learn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from seals.logs.log import Log
from seals.sysid.calibration.calibration import PRIOR, STAGES, Calibration, calibrated, score_on
from seals.sysid.data.robot_description import RobotDescription, describe_robot
from seals.sysid.report.estimator import Estimate
from seals.sysid.report.settable import Settable, bar, read_usable
from seals.sysid.report.threads import one_thread

AnyLog: TypeAlias = "Log | str | Path"


class Calibrator(Settable):
    """Estimator of a robot's parameters from its logs: masses, coefficients, time constants.

    All else keeps the tolerance that the logs state. The same logs give the same numbers.

    Args:
        parameters: names as in ``robot.yaml`` (``mass``, ``inertia``, ``effects.NAME.FIELD``,
            ``actuators.NAME.FIELD``, ``hulls.LINK.displaced_volume``), groups of them, or patterns
            with ``*``.
        robot: folder or name of the robot; None if the logs describe their vehicle.
        prior: 1-sigma of what is asked for, as a share of what is stated.
        progress: whether a bar shows how far ``fit`` is, on a terminal.

    Attributes:
        parameters_: estimates by name: value, 90 % interval, unit.
        stated_: stated value by name.
        undetermined_: names of the numbers that the logs do not tell.
        correlation_: of two numbers, by their names.
        held_out_error_: misfit per degree of freedom on rows that no fit saw: ``before``, ``after``
            and ``noise_floor``.
        calibration_: all of it.

    Example:
        >>> found = Calibrator(parameters=["mass"]).fit("hidden_effect/flight_b")
        >>> abs(found.parameters_["mass"].value / found.stated_["mass"] - 1.0) < 0.5
        True
    """

    parameters_: dict[str, Estimate]
    stated_: dict[str, float]
    undetermined_: list[str]
    correlation_: dict[str, dict[str, float]]
    held_out_error_: dict[str, float]
    calibration_: Calibration

    def __init__(
        self,
        *,
        parameters: Sequence[str] = (),
        robot: str | Path | None = None,
        prior: float = PRIOR,
        progress: bool = False,
    ) -> None:
        self.parameters = parameters
        self.robot = robot
        self.prior = prior
        self.progress = progress

    def fit(
        self, log: AnyLog | Sequence[AnyLog], y: object = None, *, held_out: AnyLog | None = None
    ) -> Calibrator:
        """Calibrate on one log or several and return the estimator itself.

        Args:
            log: log, its folder, the short name of one that ships, or a list of them.
            y: ignored; there for tools that pass a target.
            held_out: another log of the vehicle, which judges and is not fitted.

        Raises:
            ConfigError: there is no such log, or a name means none of the vehicle's numbers.
            LogError: a log cannot be used.
        """
        every = [log] if isinstance(log, Log | str | Path) else list(log)
        logs = [read_usable(one, robot=self.robot) for one in every]
        unseen = None if held_out is None else read_usable(held_out, robot=self.robot)
        with one_thread(), bar(self.progress, "calibrating", STAGES) as tell:
            found = calibrated(
                logs,
                list(self.parameters),
                robot=_robot(self.robot),
                held_out=unseen,
                prior=self.prior,
                tell=tell,
            )
        return self._take(found)

    def _take(self, found: Calibration) -> Calibrator:
        table = found.to_dict()
        self.calibration_ = found
        self.parameters_ = {}
        for number in found.numbers:
            low, high = found.interval(number)
            self.parameters_[number.name] = Estimate(
                value=found.value(number), low90=low, high90=high, unit=number.unit
            )
        self.stated_ = {n.name: n.value for n in found.numbers}
        self.undetermined_ = list(table["undetermined"])
        self.correlation_ = dict(table["correlation"])
        self.held_out_error_ = {k: float(v) for k, v in found.held_out.items()}
        return self

    def score(self, log: AnyLog, y: object = None) -> float:
        """Return how well the calibrated model explains another log: -1 is perfect.

        Nothing is fitted to the other log but the start of every window of a second.

        Args:
            log: of the same vehicle.
            y: ignored.

        Returns:
            Less the misfit per degree of freedom; noise and stated gusts leave -1.

        Raises:
            LogError: the log cannot be used.
            NotFitted: ``fit`` was not called.
        """
        found = self.calibration_
        with one_thread():
            other = read_usable(log, robot=self.robot)
            return -score_on(found, other, robot=_robot(self.robot))

    def report(self, folder: str | Path) -> Path:
        """Write ``report.html`` of the calibration; return its path.

        Args:
            folder: made where it is not there.

        Raises:
            NotFitted: ``fit`` was not called.
        """
        from seals.sysid.calibration.report import write_report

        found, place = self.calibration_, Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        with one_thread():
            return write_report(found, place)


def calibrate(
    log: AnyLog | Sequence[AnyLog],
    parameters: Sequence[str],
    *,
    robot: str | Path | None = None,
    held_out: AnyLog | None = None,
    prior: float = PRIOR,
    progress: bool = False,
) -> Calibrator:
    """Estimate parameters of a robot from its logs, as ``seals calibrate`` does.

    Args:
        log: log, its folder, the short name of one that ships, or a list of them: of one vehicle,
            fitted together.
        parameters: names as in ``robot.yaml``, groups of them, or patterns with ``*``.
        robot: folder or name of the robot; None if the logs describe their vehicle.
        held_out: another log of the vehicle, which judges and is not fitted.
        prior: 1-sigma of what is asked for, as a share of what is stated.
        progress: whether a bar shows how far it is, on a terminal.

    Returns:
        The fitted estimator.

    Raises:
        ConfigError: there is no such log, or a name means none of the vehicle's numbers.
        LogError: a log cannot be used.

    Example:
        >>> found = calibrate("hidden_effect/flight_b", ["mass"])
        >>> found.parameters_["mass"].value > 0.0
        True
    """
    made = Calibrator(parameters=parameters, robot=robot, prior=prior, progress=progress)
    return made.fit(log, held_out=held_out)


def _robot(place: str | Path | None) -> RobotDescription | None:
    return None if place is None else describe_robot(str(place))
