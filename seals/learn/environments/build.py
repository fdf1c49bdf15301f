"""Construction of learning environments from a composed configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from seals.config.build import build
from seals.control.plant import layout_of
from seals.control.protocols import ControllerOptions
from seals.errors import ConfigError, suggestion
from seals.learn.batched import Batched
from seals.learn.environments.batch import Environments
from seals.learn.environments.simulator import BatchSimulator
from seals.learn.task import ActionMode, require_task
from seals.plugin_options import options_of
from seals.registry import names
from seals.robot.build import build_robot
from seals.run.assembly import build_model
from seals.run.build import build_run
from seals.run.settings import RunSettings

MANY = 1_000_000
"""Episodes of worlds of which nobody says how long they are stepped: their laws are compiled."""


def build_learning(config: Any) -> tuple[RunSettings, Any]:
    """Build the run and the task of a composed environment, the task bound to the robot.

    Args:
        config: composed configuration with the keys of ``LearnSettings``.

    Raises:
        ConfigError: there is no task, or the guide is none that takes orders.
        SealsError: a value cannot be used, or the robot cannot do the task.
    """
    if config.get("task") is None:
        raise ConfigError(
            "task is not given.\nChoose an environment: env=reach, or a task: task=NAME.  "
            f"{suggestion('', names('task'), label='Installed')}"
        )
    settings = build_run(config)
    if not hasattr(settings.guide, "tell"):
        raise ConfigError(
            "a learning environment needs a guide that accepts external references.\nSay "
            "guide=commanded"
        )
    task = build(config.task, where="task")
    task.bind(build_robot(settings.robot))
    equip(task, settings)
    return settings, task


def equip(task: Any, settings: RunSettings) -> None:
    """Tell a task the number of the robot's rotors where its actions command these.

    Raises:
        ConfigError: the controller does not take such references.
    """
    if task.actions is ActionMode.velocity:
        return
    if not options_of(settings.controller, ControllerOptions).inner:
        raise ConfigError(
            f"task.actions={task.actions.name} passes by loops of the controller, and "
            f"{type(settings.controller).__name__} takes velocities only.\n"
            "Use task.actions=velocity, or a vehicle with rotors: controller=cascade"
        )
    task.equip(layout_of(*build_model(settings)).drives)


def batched_of(
    config: Any,
    *,
    count: int,
    device: str = "cpu",
    seed: int = 0,
    values: Mapping[str, Any] | None = None,
    renew: bool = True,
    lasting: bool = False,
    coded: bool = False,
) -> Batched:
    """Build N environments: one batch with ``backend=twin``, else N worlds.

    With ``backend=mujoco_warp`` the worlds are one batch on a GPU, and MuJoCo's on a processor.

    Args:
        config: composed, with the keys of `seals.learn.settings.LearnSettings`.
        count: N.
        device: of all tensors; other worlds step on the processor whatever it is.
        seed: of the starts that are not asked for by seed.
        values: ``"effect.parameter"`` to a number or N numbers, for twins.
        renew: whether episodes that end begin anew in the same step.
        lasting: whether more episodes are to come than the configuration tells.
        coded: whether laws of twins are machine code, row by row, on a processor.

    Raises:
        SealsError: the configuration cannot be used.
    """
    if count < 1:
        raise ConfigError(f"{count} environments cannot be stepped.\nAllowed: 1 or more.")
    from seals.run.sight import sees

    settings, task = build_learning(config)
    require_task(type(task).__name__, task, build_robot(settings.robot))
    simulator: BatchSimulator
    pictures: dict[str, Any] = {}
    if hasattr(settings.backend, "interval"):
        from seals.learn.environments.twin import TwinSimulator

        simulator = TwinSimulator(
            *(settings, task),
            count=count,
            device=device,
            values=values,
            coded=coded,
        )
        if any(map(sees, settings.sensors.values())):
            from seals.learn.environments.batch_cameras import BatchCameras

            robot, ball = simulator.robot, float(config.ball)
            cameras = BatchCameras(
                settings, robot, task.posture, ball=ball, device=device, seed=seed
            )
            pictures = {"cameras": cameras, "frames": int(config.frames)}
    elif hasattr(settings.backend, "worlds") and device != "cpu":
        from seals.learn.environments.warp_worlds import DivingWorlds, WalkingWorlds

        kind = DivingWorlds if task.object else WalkingWorlds
        simulator = kind(settings, task, count=count, device=device, values=values)
    else:
        from seals.learn.environments.world import FullWorld, WorldsInTurn

        steps = config.course.steps if config.get("course") is not None else 0
        made = int(steps / (task.rate * task.duration)) + int(config.get("episodes") or 0)
        episodes = MANY if lasting else max(1, made // count)
        worlds = [FullWorld(settings, task, episodes=episodes)]
        for _ in range(count - 1):
            # a scene belongs to one backend object: each world is built from the configuration anew
            worlds.append(FullWorld(*build_learning(config), episodes=episodes))
        simulator = WorldsInTurn(worlds)
    return Environments(
        simulator, task, count=count, device=device, seed=seed, renew=renew, **pictures
    )
