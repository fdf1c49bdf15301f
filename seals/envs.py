"""Registration of the learning environments with Gymnasium, done on import.

Example:
    >>> import gymnasium
    >>> import seals.envs
    >>> gymnasium.spec("SEALS/Reach-v0").kwargs
    {'env': 'reach'}
"""

from __future__ import annotations

from collections.abc import Mapping

IDS: Mapping[str, str] = {
    "SEALS/Reach-v0": "reach",
    "SEALS/Hover-v0": "hover",
    "SEALS/Oval-v0": "oval",
    "SEALS/Station-v0": "station",
    "SEALS/Catch-v0": "catch",
    "SEALS/CrabWalk-v0": "crab_walk",
}
"""Recipe of the group ``env`` behind each id."""
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


register()
