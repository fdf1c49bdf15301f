"""Training of the detector's network on labelled pictures."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.errors import ConfigError
from seals.experiments.visual_catch.pictures import PRESENT, UNSURE, Pictures, metres
from seals.learn.starts import first_weights, generator_of
from seals.plugins.tasks.sighting.detector import (
    STRIDE,
    cell_depths,
    inputs_of,
    network_of,
    peaks_of,
    save_detector,
)

REACH = 1.5
"""Distance from the origin at which a cell learns the place within it [cell]."""
WIDTH = 0.8
"""Width of the peak that the first map is to have [cell]."""
SPREAD = 0.95
"""Share of the validation's places whose deviations make the noise that the filter is told [1]."""
SCALE = 10.0
"""Weight of a metre of depth against a cell of place [1/m]."""
FEWEST = 20
"""Pictures that can be learned from and validated."""
KEPT = 0.1
"""Share of the flights' pictures, the last ones, that validate [1]."""


@dataclass(frozen=True, kw_only=True)
class Course:
    """Settings of a training.

    Args:
        seed: of weights and draws.
        updates: gradient steps.
        batch: pictures in one of them.
        rate: largest learning rate of Adam [1].
        threshold: least probability of a peak that counts [1].
        device: where it is computed.
    """

    seed: int = 0
    updates: int = 6000
    batch: int = 256
    rate: float = 2e-3
    threshold: float = 0.5
    device: str = "cpu"


def train(pictures: Pictures, folder: Path, course: Course) -> str:
    """Train a detector and write its folder; return what was found, in words.

    Args:
        pictures: with labels; the last tenth validates and is not learned from.
        folder: to be written.
        course: of the training.

    Raises:
        ConfigError: there are too few pictures.
    """
    import torch

    if len(pictures.label) < FEWEST:
        raise ConfigError(
            f"{len(pictures.label)} pictures are too few.\nAllowed: {FEWEST} or more."
        )

    began = time.perf_counter()
    chance = generator_of(course.seed, course.device)
    with first_weights(course.seed):
        network = network_of().to(course.device)
    rows = _tensors(pictures, course.device)
    end = int((1.0 - KEPT) * len(pictures.label))
    optimiser = torch.optim.AdamW(network.parameters(), lr=course.rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, max_lr=course.rate, total_steps=course.updates
    )
    for number in range(course.updates):
        index = torch.randint(end, (course.batch,), generator=chance, device=course.device)
        colour, depth, label, place = (column[index] for column in rows)
        seen = _varied(inputs_of(colour, metres(depth)), chance)
        loss = loss_of(network(seen), seen, label, place)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        schedule.step()
        if number % 500 == 0:
            print(f"update {number}: loss {loss.item():.4f}", flush=True)
    pixel, deep, found = _noise([column[end:] for column in rows], network.eval(), course)
    took = time.perf_counter() - began
    facts = {"pixel": pixel, "depth": deep, "threshold": course.threshold, "seed": course.seed}
    more = {"updates": course.updates, "pictures": end, "seconds": round(took, 1)}
    save_detector(folder, network, {**facts, **more})
    return f"{folder}: {took:.0f} s, found {found:.1%}, {pixel:.2f} pixel, {1e3 * deep:.1f} mm deep"


def _tensors(pictures: Pictures, device: str) -> list[Any]:
    import torch

    depth = pictures.depth.astype(np.int32)
    columns = pictures.colour, depth, pictures.label, pictures.place.astype(np.float32)
    return [torch.as_tensor(column, device=device) for column in columns]


def _varied(seen: Any, chance: Any) -> Any:
    """Vary gain and offset of the colours of each picture."""
    import torch

    size = (len(seen), 3, 1, 1)
    gain = 1.0 + 0.15 * torch.randn(size, generator=chance, device=seen.device)
    shift = 0.05 * torch.randn(size, generator=chance, device=seen.device)
    return torch.cat((seen[:, :3] * gain + shift, seen[:, 3:]), dim=1)


def loss_of(maps: Any, seen: Any, label: Any, place: Any) -> Any:
    """Return the loss of maps: focal on the odds, smooth L1 on place and depth near the origin.

    Equation:
        y = exp(-r^2 / (2 w^2)) of the distance r of a cell from the origin; where r < 0.71 cell,
        -(1 - p)^2 log p, elsewhere -(1 - y)^4 p^2 log(1 - p)

    Args:
        maps: of the network, shape (N, 4, h, w).
        seen: what it read.
        label: shape (N,).
        place: column, row [pixel] and depth [m], shape (N, 3).

    References:
        Zhou, Wang and Krähenbühl 2019, arXiv 1904.07850, eq. 1.
    """
    import torch
    from torch.nn.functional import logsigmoid, smooth_l1_loss

    there = (label == PRESENT)[:, None, None]
    height, width = maps.shape[2:]
    rows = torch.arange(height, device=maps.device)[:, None] + 0.5
    columns = torch.arange(width, device=maps.device)[None, :] + 0.5
    across = (place[:, 0, None, None] / STRIDE - columns).expand(-1, height, -1)
    down = (place[:, 1, None, None] / STRIDE - rows).expand(-1, -1, width)
    square = across.square() + down.square()
    peak = torch.exp(-0.5 * square / WIDTH**2) * there
    odds = maps[:, 0]
    share = odds.sigmoid()
    top = there & (square < 0.5)
    hit = -(1.0 - share).square() * logsigmoid(odds) * top
    miss = -(1.0 - peak).pow(4) * share.square() * logsigmoid(-odds) * ~top
    sure = (label != UNSURE)[:, None, None]
    heat = ((hit + miss) * sure).sum() / there.sum().clamp(min=1)
    close = (there & (square < REACH**2)).float()
    deeper = place[:, 2, None, None] - cell_depths(seen)
    wanted = torch.stack((across, down, SCALE * deeper), 1)
    given = torch.cat((maps[:, 1:3], SCALE * maps[:, 3:4]), 1)
    off = smooth_l1_loss(given, wanted, reduction="none", beta=0.1).sum(1) * close
    return heat + off.sum() / close.sum().clamp(min=1.0)


def _noise(rows: list[Any], network: Any, course: Course) -> tuple[float, float, float]:
    """Return deviations of column and row [pixel] and of depth [m], and the share found."""
    import torch

    found = []
    with torch.no_grad():
        for first in range(0, len(rows[2]), 512):
            colour, depth = (column[first : first + 512] for column in rows[:2])
            seen = inputs_of(colour, metres(depth))
            found.append(peaks_of(network(seen), seen))
    peaks = torch.cat(found)
    there = rows[2] == PRESENT
    sure = there & (peaks[:, 0] > course.threshold)
    off = (peaks[sure, 1:] - rows[3][sure]).abs().cpu().numpy()
    if not len(off):
        return 1.0, 0.01, 0.0

    def deviation(values: Any) -> float:
        kept = np.sort(values)[: max(1, int(SPREAD * len(values)))]
        return float(np.sqrt(np.mean(kept**2)))

    return deviation(off[:, :2].ravel()), deviation(off[:, 2]), float(sure.sum() / there.sum())
