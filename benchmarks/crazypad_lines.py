"""Acceptance criteria of the answers about the CrazyPAD flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from benchmarks.real_data import Line
from seals.errors import LogError, suggestion
from seals.sysid.healthy_flights.comparison import COMMON, Changed

_SET = "crazypad"
_COLUMNS = ("file", "reference")
"""What a table must hold; labels are free."""
_DOUBTFUL = "?"
"""In a level: its label is doubtful, as the source says, and the flights stay out of the lines."""
_TWO_UNCUT = "0.5/0"
"""Level of the series without uncut flights that stands for its healthy state."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """Labels of a flight.

    Args:
        file: its table.
        group: vehicle and condition.
        vehicle: the healthy state to compare with.
        kind: normal, cut, cut_two, weight, string, tape.
        motors: numbers joined by ``+``.
        level: of the change, as the source states it.
        cut: millimetres cut off each of the first three motors' propellers.
    """

    file: str
    group: str
    vehicle: str
    kind: str
    motors: str
    level: str
    cut: tuple[float, float, float]

    @classmethod
    def of(cls, raw: Mapping[str, str], place: Path) -> Row:
        """Return the labels of a line of ``flights.csv``.

        Raises:
            LogError: a column is missing.
        """
        for name in _COLUMNS:
            if raw.get(name) is None:
                raise LogError(f"'{place}' has no column '{name}'.\n" + suggestion(name, raw))
        one, two, three = (float(raw.get(f"cut_{k}_mm") or "nan") for k in (1, 2, 3))
        return cls(
            file=raw["file"],
            group=raw.get("group") or raw["file"],
            vehicle=raw["reference"],
            kind=raw.get("class") or "",
            motors=raw.get("motors") or "",
            level=raw.get("level") or "",
            cut=(one, two, three),
        )

    @property
    def healthy(self) -> bool:
        """Whether other flights may be compared with this one."""
        return self.kind == "normal" or self.level == _TWO_UNCUT

    @property
    def most_cut(self) -> float:
        """Millimetres cut off the propeller that lost most."""
        return float(np.nanmax(self.cut)) if self.kind.startswith("cut") else 0.0

    @property
    def right(self) -> tuple[str, ...]:
        """Explanations that are right."""
        of = {
            "cut": ("weak_rotor",),
            "cut_two": ("weak_rotor",),
            "tape": ("weak_rotor", "rotor_imbalance"),
            "weight": ("payload", "centre_of_gravity"),
            "string": ("slung_load", "payload"),
        }
        return tuple(f"{effect}@{self.motors}" for effect in of.get(self.kind, ()))


Pair = tuple[Row, Changed]


def alarms(answer: Changed) -> bool:
    """Return whether a change other than a common change of thrust is claimed."""
    return bool(set(answer.names) - set(COMMON))


def hit(pair: Pair) -> bool:
    """Return whether a right explanation is in the answer."""
    return bool(set(pair[0].right) & set(pair[1].names))


def lines_of(rows: Sequence[Row], found: Sequence[Changed | None]) -> list[Line]:
    """Return every criterion that applies to these flights; empty without labels."""
    pairs = [
        (row, one)
        for row, one in zip(rows, found, strict=True)
        if one is not None and row.kind and _DOUBTFUL not in row.level
    ]
    if not pairs:
        return []
    sick = [p for p in pairs if not p[0].healthy]
    cut = [p for p in sick if p[0].kind == "cut"]
    two = [p for p in sick if p[0].kind == "cut_two"]
    medium = [p for p in cut + two if 2.0 <= p[0].most_cut < 4.0]
    weights = [p for p in sick if p[0].kind == "weight"]
    strings = [p for p in sick if p[0].kind == "string"]
    heaviest = [p for p in strings if p[0].level == max(q[0].level for q in strings)]
    heavy = [p for p in weights if p[0].level == max(q[0].level for q in weights)]
    lightly = [p for p in cut + two if p[0].most_cut < 2.0]
    weak = [
        *lightly,
        *(p for p in sick if p[0].kind == "tape"),
        *(p for p in weights + strings if p not in heaviest and p[0].level < "W3"),
    ]
    wholly = [p for p in two if min(p[0].cut[:2]) >= 4.0]
    return [
        false_alarms("of other sessions", *zip(*pairs, strict=True)),
        *_long_cuts([p for p in cut if p[0].most_cut >= 4.0]),
        _at_least("3 two cuts of 4 mm and more", [hit(p) for p in wholly], 0.95),
        _at_least("4 medium cuts named or in the set", [hit(p) for p in medium], 0.6),
        _at_least("4 weak cases: nothing wrong", [not alarms(p[1]) or hit(p) for p in weak], 0.95),
        *(_ranked(k, two if k < 2 else cut) for k in range(3)),
        _at_least("6 heaviest string: slung load", [_slung(p) for p in heaviest], 0.8),
        _at_most(
            "6 slung load elsewhere", [_slung(p) for p in pairs if p[0].kind != "string"], 0.05
        ),
        _at_least(f"7 heaviest weight here ({_level(heavy)})", [hit(p) for p in heavy], 0.5),
    ]


def false_alarms(beside: str, rows: Sequence[Row], found: Sequence[Changed | None]) -> Line:
    """Return the criterion of healthy flights, each compared with other healthy ones."""
    are = [
        alarms(one) for row, one in zip(rows, found, strict=True) if row.healthy and one is not None
    ]
    return _at_most(f"1 false alarms beside healthy flights {beside}", are, 0.05)


def _level(pairs: Sequence[Pair]) -> str:
    return pairs[0][0].level if pairs else "none"


def _long_cuts(pairs: Sequence[Pair]) -> list[Line]:
    groups = sorted({row.group for row, _ in pairs})
    seen = {g: any(hit(p) for p in pairs if p[0].group == g) for g in groups}
    claims = [p for p in pairs if alarms(p[1])]
    first = [next(n for n in p[1].names if n not in COMMON) for p in claims]
    motor = [n.endswith(f"@{p[0].motors}") for p, n in zip(claims, first, strict=True)]
    return [
        _at_least("2 cuts of 4 mm and more", [hit(p) for p in pairs], 0.85),
        _at_least("2 groups of such cuts", list(seen.values()), 1.0),
        _at_least("2 motor right where one is named", motor, 0.95),
    ]


def _slung(pair: Pair) -> bool:
    return any(name.startswith("slung_load") for name in pair[1].names)


def _ranked(motor: int, pairs: Sequence[Pair]) -> Line:
    """Rank correlation of estimated loss and millimetres."""
    known = [p for p in pairs if np.isfinite(p[0].cut[motor])]
    what = f"5 rank correlation of loss and cut, motor {motor + 1} >= 0.9"
    if len(known) < 3:
        return Line(of=_SET, what=what, figure="no flights", reached=False)
    rank = float(
        spearmanr(
            [p[1].lost_shares[motor] for p in known], [p[0].cut[motor] for p in known]
        ).statistic
    )
    return Line(of=_SET, what=what, figure=f"{rank:.4f}", reached=rank >= 0.9)


def _at_least(what: str, are: Sequence[bool], share: float) -> Line:
    figure, reached = f"{sum(are)} of {len(are)}", bool(are) and np.mean(are) >= share
    return Line(of=_SET, what=f"{what} >= {100 * share:g} %", figure=figure, reached=bool(reached))


def _at_most(what: str, are: Sequence[bool], share: float) -> Line:
    figure, reached = f"{sum(are)} of {len(are)}", bool(are) and np.mean(are) <= share
    return Line(of=_SET, what=f"{what} <= {100 * share:g} %", figure=figure, reached=bool(reached))
