"""Composition of a configuration in Python, as on the command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError


def compose(overrides: Sequence[str] = (), *, root: str = "run") -> Any:
    """Return the composed configuration of a root such as ``run`` or ``compare``.

    Args:
        overrides: Hydra overrides, for instance ``["robot=ball", "time.duration=0.5"]``.
        root: name of the root configuration.

    Raises:
        SealsError: an override is wrong; two lines say what and what is allowed.

    Example:
        >>> compose(["experiment=drop_test"]).robot.name
        'ball'
    """
    from hydra import compose as hydra_compose
    from hydra import initialize_config_module
    from hydra.core.global_hydra import GlobalHydra

    from seals.config.checks import refuse_growth
    from seals.config.refusal import refusals
    from seals.config.source import install

    if isinstance(overrides, str):
        raise ConfigError(
            f"overrides={overrides!r} is text, not a list.\nWrite a list: [{overrides!r}]"
        )
    if not isinstance(overrides, Sequence) or not all(isinstance(one, str) for one in overrides):
        raise ConfigError(
            f"overrides={overrides!s:.200} is not a list of texts.\n"
            "Write a list of KEY=VALUE, for instance ['robot=ball']"
        )
    install()
    GlobalHydra.instance().clear()
    with (
        refusals(overrides, root=root),
        initialize_config_module("seals.conf", version_base="1.3", job_name=root),
    ):
        config = hydra_compose(root, overrides=list(overrides))
    refuse_growth(config)
    return config


def output_folder(given: Any = None) -> Path:
    """Return the folder of a command's results: as it was given, else the one of its job."""
    from hydra.core.hydra_config import HydraConfig

    return Path(str(given or HydraConfig.get().runtime.output_dir))


def job_overrides() -> list[str]:
    """Return the overrides of a command's job, as they were given."""
    from hydra.core.hydra_config import HydraConfig

    return list(HydraConfig.get().overrides.task)
