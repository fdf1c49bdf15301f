"""Tasks of the experiment: a real world with hidden effects, its flight, and four arms."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from seals.experiments.learning_study.arms import Training
from seals.file_names import DIAGNOSIS
from seals.learn.environments.posterior import Estimate
from seals.logs.atomic import write_json

NORMAL90 = 1.6449
"""Half of a 90 % interval in standard deviations."""
ARMS = ("nominal", "tolerances", "posterior", "oracle")
"""What a training knows of the real world, from nothing to all."""
LEARNER = (
    "learner=sac_many",
    "count=8192",
    "course.steps=5500000",
    "learner.settle=5500000",
    # four fifths of the updates that the recipe has
    "learner.ratio=0.005",
    "course.look_every=1375000",
    "course.log_every=200000",
    "course.episodes=50",
    "course.checkpoint=0",
    "course.keep=true",
    "course.best=false",
)
"""Of every training: half the steps of the recipe ``reach_many``."""
REAL = ("backend=mujoco", "backend.compiled=true")
"""Engine of the real world; trainings use batch dynamics."""
Values = Mapping[str, Mapping[str, Estimate]]
"""Mean and deviation by the instance of an effect and its parameter."""


class RealTask(NamedTuple):
    """Task in a world that hides effects.

    Args:
        task: words of environment and task, without the hidden effects.
        kinds: hidden effects by the name of their instance.
        truth: their values.
        tolerances: what may be said of them without a log: mean and deviation.
        flight: words of ``seals run`` for the log of the real world.
    """

    task: tuple[str, ...]
    kinds: Mapping[str, str]
    truth: Mapping[str, Mapping[str, float]]
    tolerances: Values
    flight: tuple[str, ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """Overrides that add the effects to a world, at zero strength."""
        return tuple(f"+effect@effects.{name}={kind}" for name, kind in self.kinds.items())

    @property
    def real(self) -> tuple[str, ...]:
        """Overrides that make the real world."""
        values = (
            f"effects.{name}.{field}={value}"
            for name, fields in self.truth.items()
            for field, value in fields.items()
        )
        return (*REAL, *self.effects, *values)


_OVAL = (
    "experiment=oval_crossing",
    "guide.laps=1",
    "guide.start_time=3",
    "initial.joint_position=[0,0,0,-0.6,-0.6,-0.6]",
    "time.step=0.004",
)
TASKS = {
    "current": RealTask(
        task=("env=reach", "task.target_low=[-0.7,-0.7,-1.0]", "task.target_high=[0.7,0.7,-0.3]"),
        kinds={"stream": "current", "load": "payload"},
        truth={"stream": {"velocity_x": 0.25, "velocity_y": -0.15}, "load": {"mass": 0.25}},
        tolerances={
            "stream": {f"velocity_{axis}": Estimate(0.0, 0.3) for axis in "xyz"},
            "load": {"mass": Estimate(0.26, 0.13)},
        },
        flight=(*_OVAL, "guide.period=16", "guide.centre=[0,0,-0.2]", "time.duration=22"),
    ),
    "wind": RealTask(
        task=(
            "env=reach",
            "task.target_low=[-0.7,-0.7,0.4]",
            "task.target_high=[0.7,0.7,1.4]",
            "task.success_distance=0.03",
        ),
        kinds={"breeze": "wind"},
        truth={"breeze": {"velocity_x": 14.0, "velocity_y": -7.0}},
        tolerances={"breeze": {f"velocity_{axis}": Estimate(0.0, 8.0) for axis in "xyz"}},
        flight=(
            *_OVAL,
            "guide.period=12",
            "guide.centre=[0,0,1.6]",
            "guide.height=1.2",
            "initial.position=[0,0,2.2]",
            "time.duration=18",
        ),
    ),
}
"""The tasks by name."""


def write_stated(task: RealTask, values: Values, folder: Path) -> None:
    """Write effects that are stated, not diagnosed, as a training takes them.

    Args:
        task: with the kinds of the effects.
        values: mean and standard deviation of their parameters.
        folder: to write into, made where it is not there.
    """
    entries = [
        {
            "name": task.kinds[name],
            "confidence": 1.0,
            "parameters": {
                field: {
                    "value": mean,
                    "low90": mean - NORMAL90 * sd,
                    "high90": mean + NORMAL90 * sd,
                }
                for field, (mean, sd) in fields.items()
            },
        }
        for name, fields in values.items()
    ]
    folder.mkdir(parents=True, exist_ok=True)
    said = "stated, not diagnosed"
    content = {"verdict": "named", "effects": entries, "nominal": {}, "reasons": [said]}
    write_json(folder / DIAGNOSIS, content)


def stated_of(task: RealTask) -> dict[str, Values]:
    """Return the effects known to the arms that use no log, by arm."""
    truth = {
        name: {field: Estimate(value, 0.0) for field, value in fields.items()}
        for name, fields in task.truth.items()
    }
    return {"tolerances": task.tolerances, "oracle": truth}


def trainings(
    out: Path, task: RealTask, answers: Path, *, seeds: int, device: str, more: tuple[str, ...] = ()
) -> list[Training]:
    """Return all trainings, seed by seed: an interrupted study then has complete pairs.

    Args:
        out: folder; trainings go to ``out/ARM/SEED``.
        task: to be learned.
        answers: folder with what each arm but ``nominal`` knows.
        seeds: of each arm, the same ones.
        device: ``cpu`` or ``cuda``.
        more: further words of every training.

    Example:
        >>> one = trainings(Path("o"), TASKS["wind"], Path("a"), seeds=1, device="cpu")[2]
        >>> one.folder.as_posix(), one.words[-1]
        ('o/posterior/0', 'hydra.run.dir=o/posterior/0')
    """
    found = []
    for seed in range(seeds):
        for arm in ARMS:
            knows = (*task.effects, f"varied_from={answers / arm}", "varied=1")
            told = () if arm == "nominal" else knows
            folder = out / arm / str(seed)
            own = (f"device={device}", f"seed={seed}", *more, f"hydra.run.dir={folder}")
            found.append(Training(folder, ("train", *task.task, *told, *LEARNER, *own)))
    return found
