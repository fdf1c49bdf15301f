"""Description of a residual force in sentences with figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.sysid.residual_force.dependence import (
    DRIVE,
    DRIVE_RATE,
    EVEN,
    MOTION,
    ODD,
    ROTATION,
    Dependence,
)
from seals.sysid.residual_force.exponents import Exponent
from seals.sysid.residual_force.lagged import Following
from seals.sysid.residual_force.place import Pull
from seals.sysid.residual_force.regimes import Regime
from seals.sysid.residual_force.residual import Residual
from seals.sysid.residual_force.spectrum import Spectrum
from seals.sysid.residual_force.spot import Spot

_SENSOR = 0.5
"""Share that any force could explain below which a sensor is suspected."""
_AT_THE_FLOOR = "The misfit is that of noise: no share of it can be attributed to a force."
_PART = 0.15
"""Share from which on a dependence is worth a sentence."""
_MORE = 0.05
"""Share by which a further dependence must explain more than those told already."""
_KNOWN = 0.6
"""Standard error below which an exponent is told."""
_AXIS = 0.6
"""Share of the power from which on a force lies along an axis."""


@dataclass(frozen=True, kw_only=True)
class Signature:
    """Description of a residual force: sentences and figures.

    Args:
        sentences: in plain words, the most telling first.
        frame: body, world, or neither: where the force is constant.
        along: axis of the body or the world that holds most of its power; empty for none.
        media: media in which it acts: air, entry, water.
        facts: further figures by name.
    """

    sentences: tuple[str, ...]
    frame: str = "neither"
    along: str = ""
    media: tuple[str, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return sentences and figures."""
        return {
            "sentences": list(self.sentences),
            "frame": self.frame,
            "along": self.along,
            "media": list(self.media),
            "facts": dict(self.facts),
        }

    def __str__(self) -> str:
        """The sentences, one a line."""
        return "\n".join(self.sentences)


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Results from which the sentences of a signature are made."""

    residual: Residual
    regimes: Sequence[Regime]
    dependences: Sequence[Dependence]
    exponents: Sequence[Exponent]
    spectrum: Spectrum
    following: Following | None
    places: Sequence[Pull | Spot | None]
    jointed: bool = False


def signature(given: Findings) -> Signature:
    """Describe results in sentences."""
    left = given.residual
    if not left.missing:
        words = (
            "No force exceeds gusts, noise and tolerances: misfit "
            f"{left.before:.2f} x the noise floor."
        )
        return Signature(sentences=(words,))
    first = [_size(given)]
    if left.ceiling_sd >= 1.0:
        return Signature(sentences=(first[0], _AT_THE_FLOOR))
    if left.ceiling < _SENSOR:
        return Signature(sentences=(first[0], _sensor(left, given.jointed)), facts={"sensor": True})
    frame, steady = _frame(given)
    along, axis = _along(left, frame)
    media, where = _media(given.regimes)
    found: list[tuple[float, str]] = []
    found += [*steady, *_motion(given), *_actuators(given), *_places(given), *_line(given)]
    found += _others(given, max((share for share, _ in found), default=0.0))
    found.sort(key=lambda t: -t[0])
    sentences = [*first, axis, where, *(s for _, s in found)]
    if not found:
        sentences.append("No single quantity explains it on blocks that were held out.")
    return Signature(
        sentences=tuple(s for s in sentences if s),
        frame=frame,
        along=along,
        media=media,
        facts={
            "ceiling": given.residual.ceiling,
            "force": given.regimes[0].force,
            "torque": given.regimes[0].torque,
            "exponents": {e.law: [e.value, e.sd] for e in given.exponents if e.sure},
        },
    )


def _size(given: Findings) -> str:
    left, whole = given.residual, given.regimes[0]
    parts = []
    if whole.force > 0.0:
        parts.append(f"a force of about {whole.force:.2g} N ({whole.force_ratio:.1f} x its error)")
    if whole.torque > 0.0:
        parts.append(
            f"a torque of about {whole.torque:.2g} N m ({whole.torque_ratio:.1f} x its error)"
        )
    what = " and ".join(parts) or "no significant force over the whole log"
    return (
        f"Left over: {what}. Misfit {left.before:.2f} x the noise floor; "
        f"with a free force {left.after:.2f} x."
    )


def _sensor(left: Residual, jointed: bool) -> str:
    words = (
        f"No force on the base explains it: a free force explains at most "
        f"{_percent(left.ceiling, left.ceiling_sd)} of the misfit. "
    )
    if jointed:
        return words + "Check the joints and the links of the arm, or look for a sensor fault."
    return words + (
        "The sensors disagree with each other: look for a bias, a scale, a misalignment or a delay."
    )


def _frame(given: Findings) -> tuple[str, list[tuple[float, str]]]:
    """Return the frame in which the force is constant, with its sentence."""
    share = {d.frame: d.whole for d in given.dependences if d.variable == "constant"}
    body, world = share["body"], share["world"]
    best = "body" if body.share >= world.share else "world"
    own, other = (body, world) if best == "body" else (world, body)
    if not own.sure or own.share < _PART:
        return "neither", []
    left = given.residual
    values, spread = (
        (left.force, left.force_sd) if best == "body" else (left.force_world, left.force_world_sd)
    )
    mean = np.average(values, axis=0, weights=1.0 / (spread**2 + left.gust[0] ** 2))
    words = f"Constant in the {best}: about {_vector(mean)} N"
    if best == "body":
        twist = np.average(
            left.torque, axis=0, weights=1.0 / (left.torque_sd**2 + left.gust[1] ** 2)
        )
        words += f" and {_vector(twist)} N m"
    other_name = "world" if best == "body" else "body"
    words += (
        f"; that explains {_percent(own.share, own.share_sd)} "
        f"(constant in the {other_name}: {_percent(other.share, other.share_sd)})."
    )
    return best, [(own.share, words)]


def _along(left: Residual, frame: str) -> tuple[str, str]:
    """Axis with most of the force's power."""
    best = (0.0, "", "")
    for name in ("body", "world"):
        values = left.force if name == "body" else left.force_world
        spread = left.force_sd if name == "body" else left.force_world_sd
        power = np.maximum(np.mean(values**2 - spread**2 - left.gust[0] ** 2, axis=0), 0.0)
        if power.sum() <= 0.0:
            continue
        share = power / power.sum()
        k = int(np.argmax(share))
        prefer = 0.02 if name == frame else 0.0
        if share[k] + prefer > best[0]:
            words = f"Along {name} {'xyz'[k]}: {100 * share[k]:.0f} % of the force's power."
            best = float(share[k] + prefer), f"{name} {'xyz'[k]}", words
    return (best[1], best[2]) if best[0] > _AXIS else ("", "")


def _media(table: Sequence[Regime]) -> tuple[tuple[str, ...], str]:
    """Media in which the force acts."""
    seen = {r.name: r for r in table if r.name in ("air", "entry", "water")}
    if len(seen) < 2:
        return tuple(seen), ""
    active = tuple(n for n, r in seen.items() if max(r.force_ratio, r.torque_ratio) > 1.5)
    sizes = ", ".join(f"{n} {r.force:.2g} N ({r.force_ratio:.1f} x)" for n, r in seen.items())
    names = {"air": "in air", "entry": "at the surface", "water": "under water"}
    if not active:
        return tuple(seen), f"No medium dominates: {sizes}."
    only = "Only " if len(active) < len(seen) else ""
    where = " and ".join(names[n] for n in active)
    words = f"{only}{where}: {sizes}."
    return active, words[0].upper() + words[1:]


def _motion(given: Findings) -> list[tuple[float, str]]:
    """Dependence on speed and rotation."""
    table = {d.variable: d.whole for d in given.dependences}
    out = []
    power = next((e for e in given.exponents if e.law == "speed"), None)
    along = table.get(MOTION)
    if power is not None and along is not None and along.sure and along.share > _PART:
        way = "Opposes" if np.sum(power.coefficients) > 0.0 else "Goes with"
        grows = f" and grows as speed^{power.value:.1f} +- {max(power.sd, 0.05):.1f}"
        words = f"{way} the motion{grows if power.sd < _KNOWN else ''}; a function of speed along "
        words += f"the motion explains {_percent(along.share, along.share_sd)}"
        if ODD in table and EVEN in table:
            odd, even = (100 * float(np.clip(table[k].share, 0.0, 1.0)) for k in (ODD, EVEN))
            words += f" (odd in velocity {odd:.0f} %, even {even:.0f} %)"
        out.append((along.share, words + "."))
    turning = table[ROTATION]
    if turning.sure and turning.share > _PART:
        words = f"A torque along the rotation explains {_percent(turning.share, turning.share_sd)}."
        out.append((turning.share, words))
    return out


def _actuators(given: Findings) -> list[tuple[float, str]]:
    """Dependence on commands."""
    with_drive = given.following
    out: list[tuple[float, str]] = []
    if with_drive is None:
        return out
    table = {d.variable: d.whole for d in given.dependences}
    if DRIVE in table and table[DRIVE].sure and table[DRIVE].share > _PART:
        won = table[DRIVE]
        words = (
            f"Proportional to the wrench of the actuators: {100 * with_drive.scale:+.1f} +- "
            f"{100 * with_drive.scale_sd:.1f} % of it explains {_percent(won.share, won.share_sd)}."
        )
        out.append((won.share, words))
    late = table.get(DRIVE_RATE)
    if late is not None and late.sure and late.share > _PART and with_drive.delay > 0.0:
        words = (
            f"Proportional to the rate of the commanded wrench, like a response delayed by "
            f"{1e3 * with_drive.delay:.0f} +- {1e3 * with_drive.delay_sd:.1f} ms would: "
            f"explains {_percent(late.share, late.share_sd)}; a controller that responds to the "
            "force gives a similar result."
        )
        out.append((late.share, words))
    if abs(with_drive.peak) > 1.5 * with_drive.band:
        words = (
            f"Correlates with the command on {with_drive.axis}: {with_drive.peak:.2f} at "
            f"{with_drive.peak_lag:+.2f} s (99 % band {with_drive.band:.2f})."
        )
        out.append((0.01, words))
    return out


def _places(given: Findings) -> list[tuple[float, str]]:
    """Local or central force, whichever explains more."""
    found = [p for p in given.places if p is not None and p.sure and p.share > _PART]
    steady = max((d.whole.share for d in given.dependences if d.variable == "constant"), default=0)
    found = [p for p in found if p.share > steady + 0.1]
    if not found:
        return []
    best = max(found, key=lambda p: p.share)
    spread = max(best.place_sd)
    where = f"{_vector(np.array(best.place))} +- {spread:.2f} m"
    if isinstance(best, Spot):
        words = (
            f"Acts within about {best.spread:.2f} m of the position {where}, with "
            f"{_vector(np.array(best.force))} N in the world"
        )
    else:
        way = "toward" if best.strength > 0.0 else "away from"
        words = (
            f"Points {way} the position {where}; its size is proportional to "
            f"distance^{-best.power:.1f} "
            f"+- {best.power_sd:.1f}"
        )
    return [(best.share, f"{words}; explains {_percent(best.share, best.share_sd)}.")]


def _line(given: Findings) -> list[tuple[float, str]]:
    lines = given.spectrum
    if not lines.sure:
        return []
    unit = "N" if lines.axis.startswith("force") else "N m"
    words = (
        f"Oscillates at {lines.peak:.2f} +- {max(lines.peak_sd, 0.005):.2f} Hz on {lines.axis}, "
        f"amplitude {lines.amplitude:.2g} {unit} (chance {lines.chance:.1g}); explains "
        f"{100 * float(np.clip(lines.share, 0.0, 1.0)):.0f} %."
    )
    return [(max(lines.share, _PART), words)]


def _others(given: Findings, share: float) -> list[tuple[float, str]]:
    """Other quantities that explain more than those described, each in the better frame."""
    best: dict[str, Dependence] = {}
    special = {"constant", MOTION, ODD, EVEN, ROTATION, DRIVE, DRIVE_RATE}
    for d in given.dependences:
        known = best.get(d.variable)
        more = d.beyond.sure and d.beyond.share > _PART and d.whole.share > share + _MORE
        better = known is None or d.beyond.share > known.beyond.share
        if d.variable not in special and more and better:
            best[d.variable] = d
    out = []
    for d in sorted(best.values(), key=lambda d: -d.beyond.share)[:3]:
        unit = "" if d.unit == "1" else f" {d.unit}"
        words = (
            f"Changes with {d.variable} ({d.low:.2f} to {d.high:.2f}{unit}), in the {d.frame}: "
            f"explains {_percent(d.beyond.share, d.beyond.share_sd)} beyond a constant."
        )
        out.append((0.5 * d.beyond.share, words))
    return out


def _vector(values: Floats) -> str:
    return "(" + ", ".join(f"{x:.2g}" for x in values) + ")"


def _percent(share: float, spread: float) -> str:
    return f"{100 * float(np.clip(share, 0.0, 1.0)):.0f} +- {100 * min(spread, 1.0):.0f} %"
