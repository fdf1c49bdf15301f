"""Policy folder: metadata in ``card.json``, weights in ``policy.safetensors``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from seals.arrays import Array
from seals.errors import ConfigError
from seals.learn.learner import need_torch
from seals.learn.metadata import CARD, read_metadata
from seals.learn.tensor_file import read_tensors, write_tensors
from seals.logs.atomic import atomic_folder, write_json
from seals.schema import read

FORM = "seals-policy"
WEIGHTS = "policy.safetensors"
_MOST_BYTES = 2**31
"""Of the weights: more than any network here, less than would hurt."""


class Policy(Protocol):
    """Deterministic policy."""

    def begin(self, seeds: Sequence[int]) -> None:
        """Begin an episode with a seed in each environment."""

    def act(self, observation: Array) -> Array:
        """Return actions in -1 to 1, shape (count, action_size).

        Args:
            observation: tensor of shape (count, observation_size), or tensors by name.
        """


class NetworkPolicy:
    """A network that maps observations to actions.

    Args:
        network: module that returns the action of an observation, without chance.
        metadata: what the folder says of it.
    """

    def __init__(self, network: Any, metadata: Mapping[str, Any]) -> None:
        self.network = network.eval()
        self.metadata = metadata

    def begin(self, seeds: Sequence[int]) -> None:
        """Do nothing: the network has no memory."""

    def act(self, observation: Array) -> Array:
        """Return the network's actions, without gradients."""
        import torch

        with torch.no_grad():
            return self.network(observation)


def save_policy(
    folder: str | Path,
    *,
    network: Mapping[str, Any],
    tensors: Mapping[str, Any],
    metadata: Mapping[str, Any],
    replace: bool = True,
) -> Path:
    """Write a policy as a folder, atomically.

    Args:
        folder: to be made.
        network: plain values from which ``seals.learn.networks.actor_of`` builds the module.
        tensors: its state by name, buffers included.
        metadata: who made it of what: ``env``, ``config_hash``, ``learner``, ``seed``, ...
        replace: whether a folder of that name is replaced.

    Raises:
        SealsError: the folder exists and must stay, or a value of the metadata is not plain.
    """
    whole = {key: value.detach().cpu().contiguous().clone() for key, value in tensors.items()}
    with atomic_folder(folder, replace=replace) as beside:
        write_tensors(beside / WEIGHTS, whole, framework="torch")
        write_json(
            beside / CARD, {"format": FORM, "version": 1, **metadata, "network": dict(network)}
        )
    return Path(folder)


def read_policy_metadata(folder: str | Path) -> dict[str, Any]:
    """Read the metadata of a policy's folder.

    Raises:
        ConfigError: there is no such metadata.
    """
    metadata = read_metadata(Path(folder), form=FORM, key="policy")
    read(dict[str, Any], metadata.get("network"), where=f"{Path(folder) / CARD}: network")
    return metadata


def load_policy(folder: str | Path, *, device: str = "cpu") -> NetworkPolicy:
    """Read a policy from its folder; nothing in it is executed.

    Args:
        folder: that :func:`save_policy` wrote.
        device: where the network computes.

    Raises:
        ConfigError: metadata or weights are missing, broken, or do not belong together.
        MissingExtra: the packages for learning are not installed.
    """
    metadata = read_policy_metadata(folder)
    need_torch()
    import torch

    from seals.learn.networks import actor_of

    tensors = read_tensors(Path(folder) / WEIGHTS, most=_MOST_BYTES, framework="torch")
    # without memory until the weights fill it: metadata may ask for any width
    with torch.device("meta"):
        network = actor_of(metadata["network"])
    try:
        network.load_state_dict(tensors, strict=True, assign=True)
    except RuntimeError as cause:
        words = " ".join(str(cause).split())
        raise ConfigError(
            f"policy={folder}: weights and metadata do not match: {words[:300]}\n"
            "Use the folder as written by the training."
        ) from cause
    return NetworkPolicy(network.to(device), metadata)
