"""Devices of networks and batches: CPU or NVIDIA GPU."""

from __future__ import annotations

from seals.errors import ConfigError, suggestion

DEVICES = ("cpu", "cuda")


def usable_device(name: str) -> str:
    """Return the requested device; refuse one that this machine lacks.

    Args:
        name: ``cpu`` or ``cuda``.

    Raises:
        ConfigError: it is none of these, or torch finds no card here.

    Example:
        >>> usable_device("cpu")
        'cpu'
    """
    import torch

    if name not in DEVICES:
        meant = "cuda" if "gpu" in name.lower() or name.startswith("cuda") else name
        hint = f"device={name} is not allowed.\n{suggestion(meant, DEVICES)}"
        which = "  Which card is told by the variable CUDA_VISIBLE_DEVICES." if ":" in name else ""
        raise ConfigError(hint + which)
    if name == "cuda" and not torch.cuda.is_available():
        raise ConfigError(
            "device=cuda: torch finds no CUDA device on this machine.\nWrite device=cpu"
        )
    return name
