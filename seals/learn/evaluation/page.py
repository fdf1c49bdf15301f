"""Evaluation results: shares with intervals, quantiles, tables, sentences and a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Floats
from seals.learn.statistics.interval import Interval, wilson
from seals.logs.atomic import write_json, write_table
from seals.report import Bar, Bars, Chart, Paragraph, Section, Series, Table, write_page

if TYPE_CHECKING:
    from seals.learn.training.scoring import Scores

Rows = list[tuple[str, ...]]
FURTHER = {
    "reached_after": "time to target, median [s]",
    "cost_of_transport": "cost of transport, median",
}
"""Further columns of a table, where any episode tells them: those that reached the target."""


def _label(found: EvaluationResult) -> str:
    """Return the policy's name, for a folder its last part."""
    path = Path(found.policy)
    # training keeps its policy in a folder of that name: the run's own says more
    path = path.parent if path.name == "policy" and path.parent.name else path
    return path.as_posix() if len(path.parts) < 3 else Path(*path.parts[-2:]).as_posix()


def rows_of(judgements: Sequence[EvaluationResult]) -> tuple[tuple[str, ...], Rows]:
    """Return header and rows of a table, a row for each policy and world."""
    shares = list(judgements[0].shares())
    worlds = any(found.world for found in judgements)
    further = [name for name in FURTHER if any(_reported(found, name) for found in judgements)]
    head = (
        "policy",
        *(("world",) if worlds else ()),
        "episodes",
        *(f"{share_words(name)} (95%)" for name in shares),
        "final distance, median (90%) [m]",
        *(FURTHER[name] for name in further),
        "return, median",
    )
    rows = []
    for found in judgements:
        distance = "not told"
        if "distance" in found.columns:
            low, _, middle, _, high = found.quantiles("distance")
            distance = f"{middle:.3f} ({low:.3f} to {high:.3f})"
        rows.append(
            (
                _label(found),
                *((found.world or "its own",) if worlds else ()),
                str(found.episodes),
                *(found.share(name).text() if name in found.columns else "" for name in shares),
                distance,
                *(f"{found.quantiles(n)[2]:.2f}" if _reported(found, n) else "" for n in further),
                f"{found.quantiles('return')[2]:.4g}",
            )
        )
    return head, rows


def _reported(found: EvaluationResult, name: str) -> bool:
    """Test if any episode reports this fact."""
    return name in found.columns and bool(np.isfinite(found.columns[name]).any())


def share_words(name: str) -> str:
    """Return the words for the name of a share, as ``within 1 cm`` for ``success_1cm``."""
    return name.replace("success_", "within ").replace("cm", " cm") if "_" in name else name


def sentences(judgements: Sequence[EvaluationResult]) -> list[str]:
    """Return the claims that the intervals support about the first policy against the others."""
    first, *others = judgements
    own = first.share()
    out = []
    for other in others:
        share = other.share()
        who = _label(other) if not other.world else f"the same in the world '{other.world}'"
        if own.low > share.high:
            out.append(
                f"{_label(first)} succeeds more often than {who}: the intervals do not overlap."
            )
        elif own.high < share.low:
            out.append(
                f"{_label(first)} succeeds less often than {who}: the intervals do not overlap."
            )
        else:
            out.append(f"{_label(first)} and {who}: no difference is shown, the intervals overlap.")
    return out


NUMBERS, EPISODES, PAGE = "evaluation.json", "episodes.csv", "evaluation.html"
_HOW = (
    "All policies start from the same held-out states and act "
    "deterministically. Shares have 95% Wilson intervals: these state how precisely this policy "
    "is known, not "
    "how good its learner is. For learners, compare training runs: seals evaluate --compare."
)


def write_results(
    found: Sequence[EvaluationResult], out: Path, *, facts: Mapping[str, Any]
) -> list[Path]:
    """Write numbers, episodes and page into a folder.

    Args:
        found: judgements, the policy in question first.
        out: folder, made where it is not there.
        facts: of the evaluation, kept with the numbers.

    Returns:
        The files.
    """
    out.mkdir(parents=True, exist_ok=True)
    numbers = {
        **facts,
        "quantiles": list(QUANTILES),
        "judgements": [judged.to_dict() for judged in found],
    }
    write_json(out / NUMBERS, numbers)
    write_table(out / EPISODES, _episodes_of(found))
    words = f"{found[0].episodes} held-out starts, {facts['env']}"
    write_page(out / PAGE, f"Evaluation of {_label(found[0])}", _sections(found), subtitle=words)
    return [out / NUMBERS, out / EPISODES, out / PAGE]


def _episodes_of(found: Sequence[EvaluationResult]) -> dict[str, Any]:
    """Return a row for each episode of all results; NaN for missing columns."""
    names = list(dict.fromkeys(name for judged in found for name in judged.columns))
    columns: dict[str, Any] = {
        "policy": [judged.policy for judged in found for _ in range(judged.episodes)],
        "world": [judged.world for judged in found for _ in range(judged.episodes)],
    }
    for name in names:
        parts = [j.columns.get(name, np.full(j.episodes, np.nan)) for j in found]
        columns[name] = np.concatenate(parts)
    # seeds have ten digits: as real numbers they would be rounded by some readers
    columns["seed"] = columns["seed"].astype(np.int64)
    return columns


def _sections(found: Sequence[EvaluationResult]) -> list[Section]:
    head, rows = rows_of(found)
    bars = [
        Bar(label=_name(j), value=j.share().high, start=j.share().low, text=j.share().text())
        for j in found
    ]
    blocks = [Bars(title="Success, 95% interval", x_label="share of episodes", bars=bars)]
    lines = tuple(_distances(judged) for judged in found if "distance" in judged.columns)
    values = [Paragraph(text=text) for text in sentences(found)]
    sections = [
        Section(title="Success", blocks=[*values, *blocks]),
        Section(title="Table", blocks=[Table(head=head, rows=rows, right=range(1, len(head)))]),
    ]
    if lines:
        chart = Chart(
            title="Episodes that ended within a distance",
            y_label="share of episodes",
            x_label="final distance [m]",
            series=lines,
        )
        sections.append(Section(title="Final distance", blocks=[chart], wide=True))
    sections.append(Section(title="How it was judged", blocks=[Paragraph(text=_HOW)]))
    return sections


def _name(found: EvaluationResult) -> str:
    return f"{_label(found)}, {found.world}" if found.world else _label(found)


def _distances(found: EvaluationResult) -> Series:
    """Fraction of episodes below each distance, as a step curve."""
    ordered = np.sort(found.columns["distance"])
    share = np.arange(1, len(ordered) + 1) / len(ordered)
    return Series(
        name=_name(found), x=np.repeat(ordered, 2), y=np.stack([share - share[0], share], 1).ravel()
    )


SHARE = "success"
"""Facts of this name, or that begin with it, are truth values: shares are told of them."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_OWN = ("return", SHARE)
"""Facts that the scores hold by themselves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EvaluationResult:
    """Result of a policy in a world.

    Args:
        policy: name or folder.
        world: name of the variant, empty for the world of the configuration.
        columns: one row an episode, by name, each of shape (episodes,).
        seconds: wall time of all episodes together [s].
    """

    policy: str
    world: str
    columns: Mapping[str, Floats]
    seconds: float = 0.0

    @property
    def episodes(self) -> int:
        """Number of starts."""
        return len(self.columns[SHARE])

    def share(self, name: str = SHARE) -> Interval:
        """Return the share of episodes with a property, such as success, with Wilson's interval."""
        return wilson(int(self.columns[name].sum()), self.episodes)

    def shares(self) -> dict[str, Interval]:
        """Return the shares of all such properties by name."""
        return {n: self.share(n) for n in self.columns if n == SHARE or n.startswith(f"{SHARE}_")}

    def quantiles(self, name: str) -> list[float]:
        """Return the quantiles of a column, NaN if an episode lacks it."""
        values = self.columns[name]
        if not np.isfinite(values).any():
            return [float("nan")] * len(QUANTILES)
        return [float(q) for q in np.nanquantile(values, QUANTILES)]

    def to_dict(self) -> dict[str, Any]:
        """Return success rates and quantiles as plain data; unknown ones are None."""
        rest = [n for n in self.columns if n != "seed" and n not in self.shares()]
        return {
            "policy": self.policy,
            "world": self.world,
            "episodes": self.episodes,
            "seconds": self.seconds,
            "shares": {name: list(value) for name, value in self.shares().items()},
            "quantiles": {
                name: [q if np.isfinite(q) else None for q in self.quantiles(name)] for name in rest
            },
        }


def summarise(scores: Scores, *, policy: str, world: str, seconds: float) -> EvaluationResult:
    """Summarise the scores of some episodes."""
    columns = {
        "seed": scores.seed.astype(float),
        SHARE: scores.success.astype(float),
        "return": scores.returns,
        "length": scores.length.astype(float),
        **{name: values for name, values in scores.facts.items() if name not in _OWN},
    }
    return EvaluationResult(policy=policy, world=world, columns=columns, seconds=seconds)
