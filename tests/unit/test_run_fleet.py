"""Several robots in one run, each with a controller, a guide, sensors and a log of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.config.foreign_values import refuse_values
from seals.errors import ConfigError, SealsError
from seals.logs.native import read_native
from seals.logs.table import read_parquet
from seals.run.application import run_into
from seals.run.assembly import build_twin
from seals.run.build import run_settings
from seals.run.recorder import Moment, Recorder
from seals.run.simulation import Ending, simulate
from seals.view.forces import Forces
from seals.view.replay import open_replay

SHARED = ["water=fossen", "+effect@effects.drift=current", "effects.drift.velocity_x=0.1"]
SCOUT = (
    "robots.scout={robot: crazyflie, controller: cascade, guide: hover, "
    "initial: {position: [0, 0, 2], drives: carrying}}"
)
ROV = "robots.rov={robot: rov, guide: hover, initial: {position: [40, 0, -2]}}"


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_robots_far_apart_move_and_measure_as_each_does_alone(engine: str) -> None:
    """Neither the motion nor the noise of a robot's sensors depends on who else is in the run."""
    words = [*SHARED, f"backend={engine}", "time.duration=0.4", "backend.compiled=false"]
    both = simulate(run_settings([*words, SCOUT, ROV])).fleet
    for name, own in (("scout", SCOUT), ("rov", ROV)):
        alone = simulate(run_settings([*words, own])).log
        assert list(alone.columns) == list(both[name].log.columns)
        for column, values in alone.columns.items():
            np.testing.assert_allclose(
                both[name].log.columns[column], values, rtol=0, atol=1e-12, err_msg=column
            )
    noise = {n: r.log.channel("specific_force") for n, r in both.items()}
    assert np.isfinite(noise["scout"][1:]).any()
    assert np.isfinite(noise["rov"][1:]).any()


def test_equal_robots_draw_different_noise() -> None:
    """Two of one kind do not share the errors of their sensors."""
    words = ["robots.a={robot: ball, sensors: {gps: gps}}", "time.duration=0.5"]
    other = "robots.b={robot: ball, sensors: {gps: gps}, initial: {position: [0, 5, 0]}}"
    fleet = simulate(run_settings([*words, other])).fleet
    first, second = (fleet[name].log.columns["gps_position_x"] for name in "ab")
    read = np.isfinite(first) & np.isfinite(second)
    assert read.any()
    assert np.all(first[read] != second[read])


def test_robot_is_one_of_the_fleet() -> None:
    """``robot=`` is the robot named robot: it is simulated as it is without the others."""
    words = ["robot=ball", "initial.position=[0, 0, 3]", "time.duration=0.2"]
    alone = simulate(run_settings(words))
    more = simulate(
        run_settings([*words, "robots.low={robot: cube, initial: {position: [9, 0, 0]}}"])
    )
    assert list(more.fleet) == ["robot", "low"]
    for column, values in alone.log.columns.items():
        np.testing.assert_allclose(more.log.columns[column], values, rtol=0, atol=1e-12)


def test_robots_meet() -> None:
    """The engine lets two robots collide: momentum along the line of centres is exchanged."""
    words = ["environment.gravity=0", "time.duration=0.5", "time.step=0.001"]
    left = "robots.left={robot: cube, initial: {position: [0, 0, 0], velocity: [1, 0, 0]}}"
    right = "robots.right={robot: cube, initial: {position: [0.2, 0, 0]}}"
    fleet = simulate(run_settings([*words, left, right])).fleet
    ends = {name: record.log.channel("velocity")[-1, 0] for name, record in fleet.items()}
    assert ends["right"] > 0.1
    # air drag takes less than a hundredth meanwhile
    assert ends["left"] + ends["right"] == pytest.approx(1.0, abs=0.02)
    assert fleet["left"].log.meta["contacts"][0][0] == pytest.approx(0.15, abs=0.02)


def test_a_run_of_several_is_written_repeated_and_shown(tmp_path: Path) -> None:
    """Each has a log folder and a report; a repeat is the same, and a replay holds them all."""
    words = [SCOUT, ROV, *SHARED, "objects.cube.robot=cube", "time.duration=0.1"]
    first, second = tmp_path / "first", tmp_path / "second"
    assert main(["run", *words, f"hydra.run.dir={first}"]) == 0
    assert main(["run", f"repeat={first}", f"hydra.run.dir={second}"]) == 0
    for name in ("scout", "rov"):
        one, other = (read_parquet(at / "fleet" / name / "log.parquet") for at in (first, second))
        assert list(one) == list(other)
        assert all(np.array_equal(one[c], other[c], equal_nan=True) for c in one)
        assert (first / "fleet" / name / "report.html").is_file()
    assert read_native(first / "fleet" / "rov").meta["robot"]["name"] == "rov"
    for place in (first, first / "fleet" / "rov"):
        replay = open_replay(place)
        assert list(replay.tracks) == ["scout", "rov", "cube"]
        np.testing.assert_allclose(replay.tracks["rov"].position[0], [40, 0, -2])
    assert {"gravity", "buoyancy", "drift"} & set(Forces(replay.stage, first).effects)


class Stop(Recorder):
    """Interruption after thirty steps."""

    def record(self, moment: Moment) -> None:
        """Interrupt the run."""
        if moment.row == 30:
            raise KeyboardInterrupt


def test_a_run_of_several_is_taken_up(tmp_path: Path) -> None:
    """A checkpoint holds every robot: the rest of the run is the same as in one piece."""
    words = [SCOUT, ROV, *SHARED, "time.duration=0.2", "checkpoint=1e-9"]
    whole = run_into(tmp_path / "whole", run_settings(words))
    cut = run_into(tmp_path / "cut", run_settings(words), recorders=[Stop()])
    assert cut.ending is Ending.interrupted
    on = run_into(tmp_path / "on", run_settings(words), cut=tmp_path / "cut")
    assert whole.ending is on.ending is Ending.done
    for name in ("scout", "rov"):
        assert cut.fleet[name].log.rows < whole.fleet[name].log.rows
        for column, values in whole.fleet[name].log.columns.items():
            np.testing.assert_array_equal(on.fleet[name].log.columns[column], values, column)


def test_a_run_ends_when_every_guide_has() -> None:
    """One that is done waits for the other; one without a guide is not waited for."""
    one = "robots.{}={{robot: rov, guide: {{guide: march, delay: 0, duration: {}}}, initial: {}}}"
    brief = one.format("brief", 0.1, "{position: [0, 0, -2]}")
    long = one.format("long", 0.3, "{position: [9, 0, -2]}")
    idle = "robots.idle={robot: ball, initial: {position: [0, 9, -2]}}"
    ends = {"one": [brief], "both": [brief, long], "and idle": [brief, idle]}
    words = ["water=fossen", "time.duration=1"]
    found = {k: simulate(run_settings([*words, *v])).log.time[-1] for k, v in ends.items()}
    # the guide is asked ten times a second
    assert 0.1 <= found["one"] < 0.25
    assert 0.3 <= found["both"] < 0.45
    assert found["and idle"] == found["one"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["robots.a=bal"], "robots.a: robot 'bal'"),
        (["robots.a=ball", "robots.b=ball"], "robots.b starts where a does"),
        (["robots.a=ball", "guide=hover"], "guide belongs to the robot of robot="),
        (["robots.a=ball", "initial.position=[1,0,0]"], "initial belongs"),
        (["robots.a=ball", "+effect@effects.load=payload"], "effects.load belongs"),
        (["robots.a-b=ball"], "cannot name one of the robots"),
        (["robots.robot=ball"], "cannot name one of the robots"),
        ([f"robots.{'a' * 61}=ball"], "cannot name one of the robots"),
        (["robots.a.robt=ball"], "Did you mean 'robot'"),
        (["robots.a.guide=hover"], "robots.a.robot has no value"),
        (["robots.a={robot: ball, guide: hover}"], "robots.a: guide is given without"),
        (["robots.a={robot: rov, guide: hovr}"], "robots.a: guide 'hovr'"),
        (["robots.a={robot: rov, sensors: {fix: {sensor: gpss}}}"], "robots.a: sensor 'gpss'"),
        (["robots.a={robot: rov, sensors: {fix: {rate: 2}}}"], "has no sensor 'fix'"),
        (["robots.a={robot: rov, effects: {drag: {x: 2}}}"], "has no effect 'drag'"),
        (["robots.a={robot: rov, hide: [wnd]}"], "robots.a: hide=wnd"),
        (["robots.a.robot=ball", "robots.a.initial.position=[0,0,nan]"], r"position\[2\]=nan"),
        (["robots.a=cube", "objects.a=cube"], "a names a robot and an object"),
        (["robots.a=ball", "live=foxglove"], "live tells of the robot of robot="),
        ([f"robots={{{', '.join(f'v{k}: ball' for k in range(257))}}}"], "up to 256"),
    ],
)
def test_a_wrong_robot_is_refused_in_words(words: list[str], said: str) -> None:
    """Every refusal names the robot and has two lines."""
    with pytest.raises(SealsError, match=said) as refusal:
        run_settings(words)
    assert len(str(refusal.value).splitlines()) == 2


def test_only_runs_hold_several() -> None:
    """A person steers one robot, and a batch is of one."""
    assert main(["teleop", "robots.a=rov", "script=keys.csv"]) == 2
    with pytest.raises(ConfigError, match="many of one robot"):
        build_twin(run_settings(["robots.a=ball"]))


def test_a_file_of_a_stranger_names_no_robot_folder(tmp_path: Path) -> None:
    """Neither a text alone nor a mapping lets the path of a robot in from a file."""
    for entry in ("robots.a={robot: rov}", "robots.a=ball"):
        refuse_values(compose([entry]), root="run", words=[], where="card")
    for entry in (f"robots.a={tmp_path}", f"robots.a.robot={tmp_path}", f"objects.a={tmp_path}"):
        with pytest.raises(ConfigError, match="path to read"):
            refuse_values(compose([entry]), root="run", words=[], where="card")
    policy = "robots.a={robot: rov, guide: {guide: learned, policy: /tmp/policy}}"
    with pytest.raises(ConfigError, match="path to read"):
        refuse_values(compose([policy]), root="run", words=[], where="card")
