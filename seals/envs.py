"""Registration of the learning environments with Gymnasium, done on import.

Example:
    >>> import gymnasium
    >>> import seals.envs
    >>> gymnasium.spec("SEALS/Reach-v0").kwargs
    {'env': 'reach'}
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

IDS: Mapping[str, str] = {
    "SEALS/Reach-v0": "reach",
    "SEALS/Hover-v0": "hover",
    "SEALS/HoverWind-v0": "hover_wind",
    "SEALS/Oval-v0": "oval",
    "SEALS/ReachCurrent-v0": "reach_current",
    "SEALS/Pipe-v0": "pipe",
    "SEALS/Pick-v0": "pick",
    "SEALS/Place-v0": "place",
    "SEALS/Valve-v0": "valve",
    "SEALS/Station-v0": "station",
    "SEALS/Catch-v0": "catch",
    "SEALS/CrabWalk-v0": "crab_walk",
}
"""Recipe of the group ``env`` behind each id."""
GOAL_IDS: Mapping[str, str] = {"SEALS/ReachGoal-v0": "reach"}
"""Recipe behind each id of an environment with goals."""
ROOM = "seals.learn.environments.gym"


def register() -> None:
    """Register all environments with Gymnasium; may be called twice."""
    import gymnasium

    for name, env in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point=f"{ROOM}:SealsEnv",
                vector_entry_point=f"{ROOM}:SealsVectorEnv",
                kwargs={"env": env},
            )
    for name, env in GOAL_IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(id=name, entry_point=f"{ROOM}:SealsGoalEnv", kwargs={"env": env})


def vec_env(name: str, num_envs: int, **kwargs: Any) -> Any:
    """Return a batch of environments for the learners of Stable-Baselines3.

    Args:
        name: id of the environment.
        num_envs: how many of them.
        kwargs: of `seals.learn.environments.gym.SealsVectorEnv`.

    Raises:
        MissingExtra: stable-baselines3 is not installed.
    """
    import gymnasium

    from seals.learn.environments.stable_baselines import BatchVecEnv

    mode = "vector_entry_point"
    return BatchVecEnv(gymnasium.make_vec(name, num_envs, vectorization_mode=mode, **kwargs))


def torchrl_env(name: str, num_envs: int, **kwargs: Any) -> Any:
    """Return a batch of environments as one of TorchRL, its tensors where the robots are.

    Args:
        name: id of the environment.
        num_envs: how many of them.
        kwargs: of `seals.learn.environments.torchrl_env.SealsEnvBase`.

    Raises:
        MissingExtra: torchrl is not installed.
        ConfigError: there is no such environment.
    """
    from seals.errors import refuse_unlisted
    from seals.learn.environments.torchrl_env import SealsEnvBase

    refuse_unlisted(name, IDS, f"there is no environment '{name}'")
    return SealsEnvBase(IDS[name], num_envs=num_envs, **kwargs)


def parallel_env(env: str = "catch", **kwargs: Any) -> Any:
    """Return an environment of two agents by PettingZoo's parallel interface.

    Args:
        env: recipe of the group ``env``.
        kwargs: of `seals.learn.environments.parallel.SealsParallelEnv`.

    Raises:
        MissingExtra: pettingzoo is not installed.
    """
    from seals.learn.environments.parallel import SealsParallelEnv

    return SealsParallelEnv(env, **kwargs)


register()
