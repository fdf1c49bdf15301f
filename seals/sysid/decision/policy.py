"""Thresholds by which the diagnosis accepts, names, ranks or refuses an effect."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

EVIDENCE = "2 ln B"
"""Unit of evidence: twice the logarithm of the Bayes factor against the stated model."""


def threshold(value: float, unit: str, reason: str) -> Any:
    """Declare a threshold as a dataclass field.

    Args:
        value: default.
        unit: of the value; ``1`` for pure numbers.
        reason: why the threshold exists and has this size.
    """
    return field(default=value, metadata={"unit": unit, "reason": reason})


class Threshold(NamedTuple):
    """One threshold of a policy.

    Args:
        name: of the field.
        value: in this policy.
        unit: of the value.
        reason: why it exists and has this size.
    """

    name: str
    value: float
    unit: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class TieRule:
    """Distances to a rival, in units of their own uncertainty, that decide what is named beside it.

    Args:
        tied: up to which two effects cannot be told apart.
        alike: up to which an effect is listed as similar; none when left out.
        further: confidence that a second or third effect needs to be reported.
        listed: names in a set beside the best at most; None for all.
    """

    tied: float
    alike: float = -math.inf
    further: float = 0.0
    listed: int | None = None


@dataclass(frozen=True, kw_only=True)
class DecisionPolicy:
    """All thresholds of the diagnosis, each with unit and reason in its field's metadata.

    Scores are evidences by Laplace's approximation: the fall of the whitened misfit (chi-squared)
    less the Occam factor of the parameters that were freed.

    Example:
        >>> from dataclasses import replace
        >>> strict = replace(DecisionPolicy(), evidence=15.0)
        >>> next(t for t in strict.thresholds() if t.name == "evidence").unit
        '2 ln B'
    """

    # acceptance of an effect
    evidence: float = threshold(
        10.0, EVIDENCE, "very strong evidence (Kass and Raftery 1995): an effect is accepted"
    )
    evidence_further: float = threshold(
        10.0, EVIDENCE, "added for a further effect: remains of a strong one resemble another"
    )
    evidence_surface: float = threshold(
        8.0, EVIDENCE, "added where a hull pierces the surface: laws hold to a few per cent there"
    )
    evidence_unposed: float = threshold(
        14.0, EVIDENCE, "added without a pose or for late sensors: the impact fixes the trajectory"
    )
    evidence_arm: float = threshold(
        50.0,
        EVIDENCE,
        "added on a vehicle with an arm for effects outside it: its reaction is known less well",
    )
    first_order_error: float = threshold(
        0.01,
        "1",
        "share of the evidence that laws of first order leave over: of waves, and of every effect "
        "on a hull that floats throughout",
    )
    exchange_gain: float = threshold(
        1.0, EVIDENCE, "gain from which another set of as many effects replaces the chosen one"
    )
    trace: float = threshold(
        0.02, "1", "share of the plausible scale below which an effect is negligible"
    )
    trace_of_similar: float = threshold(
        3.0, "1", "factor on the trace for drags: an inexact law of another drag resembles them"
    )
    tolerances: float = threshold(
        2.0, "sigma", "multiple of the stated tolerance that an effect must exceed"
    )
    # effects that begin or end
    activity: float = threshold(
        10.0,
        EVIDENCE,
        "very strong evidence that an effect does not act throughout: most do, and a constant one "
        "is the simpler model",
    )
    activity_share: float = threshold(
        0.05,
        "1",
        "share of an effect's evidence asked besides: laws hold to a few per cent, so a constant "
        "effect may fit one part of a log better than another; of a further effect that acts for "
        "a time, or of a second power of a drag, the same share of what is explained",
    )
    activity_resolution: float = threshold(
        0.1,
        "s",
        "times this far apart are tried: each time costs 2 ln of the instants among which it was "
        "chosen, the prior of one of them (Bayesian information for a change point)",
    )
    # disturbance
    disturbance_admitted: float = threshold(
        1.6, "1", "factor on the stated disturbance within its own uncertainty of a factor of two"
    )
    disturbance_refused: float = threshold(
        1.54, "1", "factor on 1.3 times the stated disturbance, good to two: a force is left over"
    )
    disturbance_evidence: float = threshold(
        30.0, EVIDENCE, "evidence for that stronger disturbance, for it to count"
    )
    disturbance_search: float = threshold(
        25.0, EVIDENCE, "evidence for it from which effects of unknown place or period are tried"
    )
    explained: float = threshold(
        0.9, "1", "share of the excess misfit that the named effects must explain"
    )
    misfit_trusted: float = threshold(
        1.5,
        "1",
        "misfit per degree of freedom above which an effect must explain more than is left over",
    )
    plain_form: float = threshold(
        1.1,
        "1",
        "misfit per degree of freedom up to which little is left: the usual form of a law is kept, "
        "whatever a form with more numbers gains; above it a name lowers the fitted error, too",
    )
    data_sheet_kept: float = threshold(
        3.0,
        "sigma",
        "root mean square of the stated numbers' changes in tolerances, above which no name is "
        "given where a force is left over: right models keep them within 1.5",
    )
    stated_chance: float = threshold(
        0.01,
        "1",
        "chance that a right data sheet is called wrong in a number: divided among all numbers "
        "that the log determines (Bonferroni), some 4 sigma for each of 26",
    )
    stated_weight: float = threshold(
        3.0,
        "numbers",
        "weight of the stated tolerances against how far the other numbers moved: tolerances are "
        "good to a factor of two",
    )
    stated_least: float = threshold(
        0.45,
        "1",
        "share of the stated tolerances below which they are not taken to be, however little the "
        "other numbers moved",
    )
    channel_band: float = threshold(
        3.0,
        "standard errors",
        "of a channel's own misfit above 1, by the number of independent samples, from which "
        "something is left in it: right models stay below 1.2, a missing current left 50",
    )
    channel_left: float = threshold(
        1.5,
        "1",
        "error of a channel, in units of the expected one, up to which it refuses no name: the "
        "noise of a real sensor is not known better",
    )
    channel_explained: float = threshold(
        0.95,
        "1",
        "share of the excess misfit that named effects must explain in each channel that is left "
        "outside its band",
    )
    error_falls: float = threshold(
        0.01,
        "1",
        "share by which the error must fall from the stated model for every effect that is named",
    )
    self_deception: float = threshold(
        0.5,
        "1",
        "share of a gain by which the fit misses a simulation with the effect, to name nothing",
    )
    noise_floor: float = threshold(
        0.985, "1", "misfit of noise alone per number observed: rounding lowers it by 1 to 2 %"
    )
    # confidence
    temperature: float = threshold(
        2.0, EVIDENCE, "evidence by which the odds change by e; above 2 when models are inexact"
    )
    indistinguishable: float = threshold(
        3.0, EVIDENCE, "gap within which two effects cannot be told apart"
    )
    indistinguishable_assumed: float = threshold(
        8.0,
        EVIDENCE,
        "the same where tolerances are rules of thumb: half of the names so close were right",
    )
    mentioned: float = threshold(14.0, EVIDENCE, "gap within which an effect is listed as similar")
    unposed: float = threshold(
        4.0, "1", "factor on confidence scales without a pose: of whole runs the start is uncertain"
    )
    confidence_further: float = threshold(
        0.6, "1", "confidence that a second or third effect needs to be reported"
    )
    # excitation
    excitation: float = threshold(
        15.0, EVIDENCE, "expected gain of a plausible effect below which a log cannot show it"
    )
    unseen: float = threshold(
        0.5,
        "1",
        "share of the effects that need motion from which on a log shows too few of them for a "
        "verdict",
    )
    absent: float = threshold(
        1e-6, EVIDENCE, "expected gain below which an effect cannot act where the log was made"
    )
    endless: float = threshold(
        1e4,
        "1",
        "times the readings of a log that stand for any number of them: what stays hidden then is "
        "within a stated tolerance",
    )
    certain: float = threshold(
        30.0, EVIDENCE, "evidence from which a name stands however little the log was excited"
    )
    response_excited: float = threshold(
        0.5,
        "1",
        "fraction of the obtainable information above which no further evidence is required",
    )
    response_weak: float = threshold(
        0.15, "1", "fraction of it below which feedback against a disturbance imitates an effect"
    )
    response_evidence: float = threshold(
        30.0, EVIDENCE, "evidence required of effects on the response between these two fractions"
    )
    response_evidence_weak: float = threshold(
        60.0, EVIDENCE, "evidence required of them below the lower fraction"
    )
    # screening: effects that cannot win are not fitted in full
    screen: float = threshold(5.0, "chi2", "linear gain below which a full fit cannot pay, alone")
    screen_further: float = threshold(
        14.0, "chi2", "linear gain below which a full fit cannot pay, beside other effects"
    )
    screen_near: float = threshold(
        12.0, "chi2", "distance to the best linear gain within which an effect is always fitted"
    )
    screen_unposed: float = threshold(
        4.0, "chi2", "linear gain below which an effect is not fitted to whole runs"
    )
    relinearise: float = threshold(
        100.0, EVIDENCE, "evidence above which a fit is repeated about its own values"
    )
    behind: float = threshold(
        150.0, EVIDENCE, "distance to the best rough fit beyond which a fit is not finished"
    )
    unsettled: float = threshold(
        30.0,
        EVIDENCE,
        "gap to the best fit, repeated about its own values, within which others are repeated too",
    )
    behind_share: float = threshold(
        0.25, "1", "share of the best rough fit's gain that is added to that distance"
    )
    behind_unposed: float = threshold(60.0, EVIDENCE, "the same distance for fits of whole runs")
    recheck_unposed: float = threshold(
        10.0, EVIDENCE, "evidence from which stated model and rivals are fitted again, whole runs"
    )
    good_fit: float = threshold(
        1.5,
        "1",
        "misfit per degree of freedom up to which whole runs start from the stated model's fit",
    )
    late_misfit: float = threshold(
        1.2, "1", "misfit per degree of freedom from which late inertial sensors are considered"
    )
    late_gain: float = threshold(
        100.0, "chi2", "gain of the model's own trajectory over the measured one for it to be used"
    )
    trajectory_astray: float = threshold(
        3.0,
        "sigma",
        "root mean square distance of a stretch of a trajectory from the measured "
        "pose from which a refinement has diverged: noise alone leaves one",
    )
    # joints
    joint_moving: float = threshold(
        3.0,
        "standard errors",
        "excess of the variance of a joint's readings over that of their noise from which the "
        "joint moves: links whose joints all stand still are one rigid body",
    )
    joint_quiet: float = threshold(
        2.0,
        "1",
        "variance of a joint's readings over that of their noise up to which friction and play "
        "of the joint do not show: the sign of its speed is that of the noise",
    )
    # cross-validation over several runs
    parameter_price: float = threshold(
        0.03, "log rms", "fall of the log error that each further parameter must bring"
    )
    standard_errors: float = threshold(
        2.0, "standard errors", "difference of two held-out errors that is significant"
    )
    gross_error: float = threshold(
        1.1, "log rms", "held-out error above the floor from which something is missing: factor 3"
    )
    rival_gain: float = threshold(
        0.5, "1", "share of the best model's gain that a rival must reach to be named beside it"
    )
    one_speed: float = threshold(
        0.15, "1", "spread of operating speeds below which they count as one speed"
    )
    # calibration
    undetermined: float = threshold(
        0.5, "1", "share of the prior's width from which on a log does not determine a number"
    )
    tied: float = threshold(
        0.9, "1", "correlation from which on two numbers are told by their combination only"
    )
    turbulence: float = threshold(
        0.5,
        "1",
        "force of the stated gusts over that of a steady flow from which the flow is one that "
        "varies: the turbulence intensity over open land and water is 0.1 to 0.3",
    )
    # residual force
    force_strength: float = threshold(
        1.6, "chi2", "misfit a free force removes per number it chooses; 1 when nothing is missing"
    )
    force_misfit: float = threshold(
        1.03, "1", "misfit over the noise floor from which a force is missing"
    )
    other_power: float = threshold(
        0.5,
        "1",
        "by which a drag's power of the speed lies above that of its law, less two standard "
        "errors, from which it is another law: half way to the next power",
    )
    general_law: float = threshold(
        50.0, "chi2", "by which a central force must beat an effect of the place to refuse it"
    )
    centre_known: float = threshold(
        0.15, "1", "error of the point toward which a force acts, by its distance, to name it"
    )
    term_share: float = threshold(
        0.05, "1", "share of the excess that a further term of a formula must explain"
    )
    term_price: float = threshold(
        4.0, "chi2", "fall of the misfit that each coefficient of a formula must bring"
    )
    term_simpler: float = threshold(
        0.02, "1", "share of the excess within which a simpler term of a formula is preferred"
    )

    def thresholds(self) -> Iterator[Threshold]:
        """Yield every threshold with its unit and reason, in the order of declaration."""
        for one in fields(self):
            yield Threshold(
                one.name, getattr(self, one.name), one.metadata["unit"], one.metadata["reason"]
            )

    def evidence_ties(self, *, assumed: bool = False) -> TieRule:
        """Return the rule for models of one log: the unit is the evidence temperature.

        Args:
            assumed: whether tolerances are rules of thumb.
        """
        tied = self.indistinguishable_assumed if assumed else self.indistinguishable
        return TieRule(
            tied=tied / self.temperature,
            alike=self.mentioned / self.temperature,
            further=self.confidence_further,
            listed=3,
        )

    @property
    def runs_ties(self) -> TieRule:
        """Rule for models of several runs: the unit is the standard error over them."""
        return TieRule(tied=self.standard_errors)

    @property
    def response(self) -> tuple[tuple[float, float], ...]:
        """Information fractions, each with the evidence required of effects on the response."""
        return (
            (self.response_excited, 0.0),
            (self.response_weak, self.response_evidence),
            (0.0, self.response_evidence_weak),
        )


@dataclass(frozen=True, kw_only=True)
class SearchBudget:
    """Limits on the number of models that the search fits.

    Args:
        effects: that are looked for at most.
        survivors: candidates fitted in full after the linear screen.
        survivors_further: the same beside effects that were accepted already.
        spared: candidates fitted whatever their linear gain.
        relinearised: best fits repeated about their own values.
        paired: effects of the first round tried two by two.
        rivals: effects tried in the place of each accepted one.
        changing: effects whose times are found, in each round.
    """

    effects: int = 3
    survivors: int = 7
    survivors_further: int = 4
    spared: int = 3
    relinearised: int = 2
    paired: int = 5
    rivals: int = 3
    changing: int = 3
