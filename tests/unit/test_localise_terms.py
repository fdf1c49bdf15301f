"""Terms of a formula: one law for search and simulation, regression on known forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seals.effects.binding import bind_effects
from seals.motion import Body, Inputs, Medium, Motion
from seals.plugins.effects.formula import EffectFormula
from seals.schema import parameters_of
from seals.sysid.residual_force.conditions import Conditions
from seals.sysid.residual_force.dependence import hats
from seals.sysid.residual_force.evidence import Evidence
from seals.sysid.residual_force.formula import Formula, options, wrench_of
from seals.sysid.residual_force.regress import Table, gain
from seals.sysid.residual_force.spectrum import spectrum
from seals.sysid.residual_force.terms import STEMS, UNITS, Term, basis_of
from seals.testing import check_effect
from seals.testing.scenes import Case

WINDOWS, KNOTS = 20, 15
N = WINDOWS * KNOTS
SETTINGS = {
    "drag": {"drag_power": 1.7},
    "pull": {"place": (0.3, -0.2, 1.0), "core": 0.2, "pull_power": 2.0},
    "spot": {"place": (0.3, -0.2, 1.0), "spread": 0.4},
    "near": {"level": -1.0, "near_power": 2.0},
    "beyond": {"normal": (0.0, 1.0, 0.0), "edge": 0.1, "width": 0.05},
    "swing": {"rate": 5.0},
    "shake": {"rate": 5.0},
}


def around() -> Conditions:
    """Conditions that vary in every way."""
    rng = np.random.default_rng(3)
    q, r = np.linalg.qr(rng.normal(size=(N, 3, 3)))
    q = q * np.sign(np.einsum("nii->ni", r))[:, None, :]
    q[np.linalg.det(q) < 0.0, :, 0] *= -1.0
    return Conditions(
        time=np.concatenate([w + np.linspace(0.0, 0.98, KNOTS) for w in range(WINDOWS)]),
        position=rng.uniform(-1.0, 1.0, (N, 3)),
        turn=q,
        velocity=rng.normal(size=(N, 3)),
        spin=rng.normal(size=(N, 3)),
        submersion=rng.uniform(0.0, 1.0, N),
        drive=rng.normal(size=(N, 6)),
        drive_rate=rng.normal(size=(N, 6)),
        throttle=rng.uniform(5.0, 10.0, N),
        voltage=None,
        ground=-1.0,
        water=0.0,
    )


def seen(wrench: np.ndarray, noise: float, rng: np.random.Generator) -> Evidence:
    """Evidence of a log that measures the wrench at every knot with white noise."""
    m = 6 * KNOTS
    measured = (wrench + rng.normal(0.0, noise, wrench.shape)) / noise
    flat = measured.reshape(WINDOWS, KNOTS, 6).transpose(0, 2, 1).reshape(WINDOWS, m)
    # rows: measurement = force / noise; one tolerance that touches nothing
    row = np.concatenate(
        [np.tile(np.eye(m) / noise, (WINDOWS, 1, 1)), np.zeros((WINDOWS, m, 1)), flat[:, :, None]],
        axis=2,
    )
    quiet, wide = np.eye(m) * 1e6, np.eye(m) * 1e-6
    return Evidence(
        gram=np.matmul(row.transpose(0, 2, 1), row),
        knots=KNOTS,
        rows=np.arange(N).reshape(WINDOWS, KNOTS),
        tight=np.tile(quiet, (WINDOWS, 1, 1)),
        loose=np.tile(wide, (WINDOWS, 1, 1)),
        precision=np.ones(1),
        centre=np.zeros(1),
        observed=WINDOWS * m,
        gust=np.array([1e-3, 1e-3]),
    )


@pytest.mark.parametrize("kind", [k for k in UNITS if k != "thrust"])
def test_search_and_effect_share_one_law(kind: str) -> None:
    """The effect made from a term gives the wrench that the term was fitted with."""
    place = around()
    width = basis_of(kind, SETTINGS.get(kind, {}), place).shape[2]
    term = Term(
        kind=kind,
        medium="water",
        settings=SETTINGS.get(kind, {}),
        coefficients=tuple(np.linspace(0.5, 1.5, width)),
        sd=(0.0,) * width,
    )
    law = Formula(terms=(term,), share=1.0, share_sd=0.0, after=1.0)
    effect = EffectFormula(**options(law))
    assert set(effect.terms) == set(STEMS.get(kind, (kind,)))
    bound = bind_effects({"it": effect}, ("base",)).bound[0]
    one = np.ones((N, 1))
    motion = Motion(
        time=place.time[:, None],
        position=place.position,
        rotation=place.turn,
        up=place.turn[:, 2, :],
        velocity=place.velocity + 0.3,
        angular_velocity=place.spin,
        body=Body(one, np.zeros((N, 3)), one, one),
    )
    still = np.zeros((N, 3))
    wet = place.submersion[:, None]
    medium = Medium(wet, still + 0.3, still, one, one, wet, wet, still, still, one, one[:1])
    wrench, _ = effect.loads(motion, medium, Inputs(0.0, still), None, bound.params)
    found = np.concatenate([wrench.force, wrench.torque], axis=1)
    expected = wrench_of((term,), place)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_units_of_terms_are_those_of_the_effect() -> None:
    """The unit that a formula states is the unit of the effect's parameter."""
    declared = parameters_of(EffectFormula)
    for kind, unit in UNITS.items():
        for stem in STEMS.get(kind, (kind,)):
            name = stem if stem in declared else f"{stem}_x"
            assert declared[name].unit == unit


def test_the_effect_keeps_the_contract() -> None:
    """All terms at once: libraries, purity, twin = simulator at 4 ms."""
    report = check_effect(
        EffectFormula, steps=(0.004,), duration=1.0, cases=[Case(("air",), False)]
    )
    assert report.scenes[0].moved > 0.05


def test_a_drag_is_recovered_with_its_error_bars() -> None:
    """Coefficients of a cubic drag come back within their standard errors, others do not help."""
    place, rng = around(), np.random.default_rng(8)
    truth = np.array([0.8, 1.0, 1.4])
    basis = basis_of("drag", {"drag_power": 3.0}, place)
    found = seen(basis @ truth, 0.3, rng)
    table = Table(found, np.concatenate([basis, basis_of("hold", {}, place)], axis=2))
    at, spread = table.solve(range(3)), np.sqrt(np.diag(table.covariance(range(3))))
    assert np.all(np.abs(at - truth) < 4.0 * spread)
    assert np.all(spread < 0.05)
    right = gain(found.before, table.held_out(range(3)), found)
    wrong = gain(found.before, table.held_out(range(3, 6)), found)
    assert right.share == pytest.approx(1.0, abs=0.05)
    assert right.sure
    assert wrong.share < 0.05
    assert not wrong.sure


def test_noise_alone_explains_nothing() -> None:
    """On pure noise no function gains on held-out blocks."""
    place, rng = around(), np.random.default_rng(9)
    found = seen(np.zeros((N, 6)), 0.3, rng)
    basis = np.concatenate([basis_of(k, SETTINGS.get(k, {}), place) for k in UNITS], axis=2)
    won = gain(found.before, Table(found, basis).held_out(range(basis.shape[2])), found)
    assert won.total < 25.0
    assert not won.sure


def test_a_line_is_found_at_its_frequency() -> None:
    """A torque that swings at 2.3 Hz in noise gives that line, with its amplitude."""
    place, rng = around(), np.random.default_rng(4)
    wrench = np.zeros((N, 6))
    wrench[:, 4] = 0.5 * np.sin(2.0 * np.pi * 2.3 * place.time + 0.4)
    lines = spectrum(seen(wrench, 0.5, rng), place)
    assert lines.sure
    assert lines.axis == "torque y"
    assert lines.peak == pytest.approx(2.3, abs=4.0 * lines.peak_sd + 0.002)
    assert lines.amplitude == pytest.approx(0.5, rel=0.25)


def test_tolerances_are_in_the_error_bars() -> None:
    """A tolerance that acts like a force widens the free force's error bars by its own size."""
    place, rng = around(), np.random.default_rng(5)
    found = seen(np.zeros((N, 6)), 0.1, rng)
    m = 6 * KNOTS
    gram = found.gram.copy()
    like = np.zeros(m)
    like[:KNOTS] = 1.0
    # the tolerance pushes along x by 0.7 N per sigma
    column = 0.7 * gram[:, :m, :m] @ like
    gram[:, :m, m] = gram[:, m, :m] = column
    gram[:, m, m] = 0.49 * np.einsum("i,wij,j->w", like, gram[:, :m, :m], like)
    gram[:, m, m + 1] = gram[:, m + 1, m] = 0.7 * gram[:, m + 1, :m] @ like
    doubtful = replace(found, gram=gram)
    spread = np.sqrt(np.einsum("wii->wi", doubtful.posterior[1])).reshape(WINDOWS, 6, KNOTS)
    assert spread[:, 0].mean() == pytest.approx(np.hypot(0.7, 0.1), rel=0.1)
    assert spread[:, 1].mean() == pytest.approx(0.1, rel=0.05)
    assert place.speed.shape == (N,)


def test_hats_share_one() -> None:
    """The hat functions of any quantity add up to one, a constant one among them."""
    rng = np.random.default_rng(1)
    for values in (rng.normal(size=50), np.ones(50)):
        np.testing.assert_allclose(hats(values).sum(axis=1), 1.0)
