"""Whole numbers and sizes in a configuration by strangers: refused in words, nothing allocated."""

from __future__ import annotations

import dataclasses
import time
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from seals import registry
from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs.table import MOST_COLUMNS, _numbers
from seals.plugins.actuators.layout import check_first
from seals.plugins.fluids.coupling import ParticleFluid
from seals.plugins.fluids.sampling import box_walls, fewest_places
from seals.plugins.fluids.solvers.dfsph.settings import DfsphOptions
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.tank.settings import MakerSettings
from seals.schema import check_fields
from seals.sysid.report.settings import DiagnoseSettings

COUNTS: list[tuple[type, str, int]] = [
    *[(PbfSettings, "iterations", wrong) for wrong in (0, 10**9)],
    *[(DfsphOptions, "iterations", wrong) for wrong in (1, 10**12)],
    *[(MakerSettings, "components", wrong) for wrong in (0, 10**9)],
    *[(MakerSettings, "seed", wrong) for wrong in (-1, 2**64)],
    *[(ParticleFluid, "substeps", wrong) for wrong in (-1, 10**9)],
    *[(ParticleFluid, "threads", wrong) for wrong in (-5, 10**6)],
    *[(ParticleFluid, "most", wrong) for wrong in (0, 10**15)],
    *[(registry.get("wave", "sea").load(), "components", wrong) for wrong in (0, 10**9)],
    *[(registry.get("wave", "sea").load(), "seed", wrong) for wrong in (-1, 2**64)],
    *[(registry.get("fluid", "window").load(), "ring", wrong) for wrong in (0, 10**9)],
    *[(registry.get("guide", "hover").load(), "seed", wrong) for wrong in (-1, 2**64)],
    *[(DiagnoseSettings, "processes", wrong) for wrong in (-1, 10**6)],
    *[(registry.get("backend", "mujoco").load(), "solver_iterations", w) for w in (0, 10**9)],
]


@pytest.mark.parametrize(("cls", "name", "wrong"), COUNTS)
def test_a_count_has_bounds(cls: type, name: str, wrong: int) -> None:
    """A count beyond its bounds is refused before anything is built; its default is within."""
    default = next(f.default for f in dataclasses.fields(cls) if f.name == name)
    check_fields(cls, {name: default}, where="it")
    with pytest.raises(ConfigError, match=rf"it\.{name}={wrong} is not allowed.\nAllowed: a whole"):
        check_fields(cls, {name: wrong}, where="it")


RUN = ("run", "robot=ball", "initial.position=[0,0,0]", "time.duration=0.01")
LARGE: dict[str, tuple[str, ...]] = {
    "a basin": ("water=particles", "fluid.size=[1000,1000,1000]", "environment.tank_bottom=-1000"),
    "a room above": ("water=particles", "fluid.freeboard=1000", "fluid.spacing=0.001"),
    "a window": ("water=window", "fluid.size=[1000,1000,1000]"),
    "a window's room above": ("water=window", "fluid.freeboard=1000", "fluid.spacing=0.01"),
    "a count": ("water=particles", "fluid.physics.iterations=1000000000"),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", LARGE)
def test_what_is_too_large_is_refused_before_it_is_there(
    name: str, elsewhere: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """A domain of particles is counted before it is sampled."""
    tracemalloc.start()
    try:
        assert main([*RUN, *LARGE[name], "hydra.run.dir=a"]) == 2
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    said = capsys.readouterr().err
    assert "Allowed by fluid.most" in said or "a whole number from 1 to 1000" in said
    assert peak < 100e6


SCANS: list[tuple[str, dict[str, Any]]] = [
    ("sonar", {"bins": 8192}),
    ("sonar", {"beams": 4096, "rays": 1024}),
    ("sonar", {"rays": 1024, "beam_width": 1e-4, "sector": 3.1}),
    ("sonar", {"bins": 2048, "beam_width": 1e-4, "sector": 3.1}),
    ("sonar", {"beams": 2048, "beam_width": 1e-4}),
    ("lidar", {"points": 65536, "rings": 1024}),
]


@pytest.mark.parametrize(("name", "values"), SCANS)
def test_a_scan_is_counted_before_its_rays_are_there(name: str, values: dict[str, Any]) -> None:
    """Counts that are each allowed can be too many together."""
    tracemalloc.start()
    try:
        with pytest.raises(ConfigError, match=r"Allowed: (a whole number|4,194,304)"):
            registry.get("sensor", name).load()(**values)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("guide", ["waypoints", "los"])
@pytest.mark.parametrize(
    "places",
    [[[1e308, 0.0, 0.0]], [[0.0, -2e5, 0.0]], [[float("nan"), 0.0, 0.0]], [[0.0, 0.0, 1.0]] * 2000],
)
def test_places_lie_in_this_world(guide: str, places: list[list[float]]) -> None:
    """A place so far away that distances overflow is refused, and a list that takes minutes."""
    with pytest.raises(ConfigError, match=rf"{guide}.places=.* is not allowed"):
        registry.get("guide", guide).load()(places=places)


def test_walls_take_no_room_of_the_inside() -> None:
    """Samples of a large box are found plane by plane; they are as many as was foreseen."""
    tracemalloc.start()
    try:
        walls = box_walls(np.zeros(3), np.array([120.0, 120.0, 120.0]), 1.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 0.9 < fewest_places((120, 120, 120)) / len(walls.points) <= 1.0
    assert peak < 60e6  # a place takes 24 bytes; 180 planes of 180 x 180 would take 140e6


@pytest.mark.parametrize("word", ["seed=range(0,1000000000000)", "seed=range(0,5000000)"])
def test_a_sweep_is_counted_before_it_is_listed(
    word: str, elsewhere: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """A range is a few bytes in an experiment; its jobs would fill the memory."""
    tracemalloc.start()
    try:
        assert main(["run", "-m", "robot=ball", word, "hydra.sweep.dir=s"]) == 2
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert "the sweep has more than 100,000 jobs" in capsys.readouterr().err
    assert not (elsewhere / "s").exists()
    assert peak < 100e6


def test_processes_of_a_diagnosis_are_counted(
    elsewhere: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A diagnosis starts no thousands of processes."""
    monkeypatch.setattr(
        "seals.sysid.report.application.diagnose", lambda *a, **k: pytest.fail("it began")
    )
    words = ["log=hidden_effect/flight_a", "plan=false", "out=out"]
    assert main(["diagnose", *words, "processes=100000"]) == 2
    assert "processes=100000 is not allowed" in capsys.readouterr().err


@pytest.mark.parametrize("hidden", [[8] * 65, [0], [-1], [8, 10**9]], ids=len)
def test_a_network_has_layers_of_a_size(hidden: list[int]) -> None:
    """A policy's card or a configuration says how many layers there are, and how wide."""
    pytest.importorskip("torchrl")
    from seals.learn.networks import mlp

    with pytest.raises(ConfigError, match=r"hidden=.* is not allowed"):
        mlp(2, 2, hidden)
    assert sum(p.numel() for p in mlp(2, 2, [4]).parameters()) == 2 * 4 + 4 + 4 * 2 + 2


def test_a_table_of_many_columns_is_read_at_once() -> None:
    """The time grows with the number of columns, not with its square."""
    table = pa.table({f"column_{k}": [0.0, 1.0] for k in range(MOST_COLUMNS)})
    begin = time.process_time()
    assert len(_numbers(Path("a.csv"), table)) == MOST_COLUMNS
    # half a minute where every column asks for the names of all, a tenth of a second where not
    assert time.process_time() - begin < 2.5


@pytest.mark.parametrize(
    "more",
    [
        "hulls: {b: {shapes: [" + "{type: sphere, size: [1.0]}, " * 12_000 + "]}}",
        "effects: {" + "".join(f"a{k}: {{effect: gravity}}, " for k in range(501)) + "}",
    ],
)
def test_parts_of_a_robot_are_counted(
    more: str, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every part is checked before every run: some hundred kilobytes would take minutes."""
    Path("r").mkdir()
    Path("r/r.urdf").write_text('<robot name="r"><link name="b"/></robot>')
    Path("r/robot.yaml").write_text(f"urdf: r.urdf\n{more}\n")
    start = time.process_time()
    assert main(["check", "robot=r"]) == 2
    assert "effects, sensors and actuators and" in capsys.readouterr().err
    assert time.process_time() - start < 10.0


@pytest.mark.parametrize("first", [-1, 10_001, 10**300])
def test_columns_of_drives_have_a_most(first: int) -> None:
    """As many numbers are made as stand before the first drive."""
    with pytest.raises(ConfigError, match=r"rotors\.first=.* is not allowed"):
        check_first("rotors.first", first)
    check_first("rotors.first", 10_000)
