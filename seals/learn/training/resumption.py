"""Stop of a training between two updates, and its resumption from the checkpoint."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError, SealsError
from seals.learn.devices import alike_in_all
from seals.learn.training.checkpoint import FILE, read_checkpoint, stored
from seals.run.stopping import ending, handled
from seals.state_tree import conform

if TYPE_CHECKING:
    from seals.learn.training.loop import Training

GROWN = ("rows",)
"""Entries of a state below which arrays grow from step to step."""


def refuse_other_form(state: Mapping[str, Any], fresh: Mapping[str, Any]) -> None:
    """Refuse a state whose entries, kinds and shapes are not those of a fresh one.

    Args:
        state: that is to be restored.
        fresh: of the same settings, before the first step.

    Raises:
        ValueError: says where they differ.
    """
    conform(stored(state), stored(fresh), tables=GROWN)


def take_up(training: Training, *, device: str) -> list[str]:
    """Restore a training from the checkpoint in its folder, and return remarks.

    Args:
        training: of the settings that it was begun with, before its first step.
        device: of its tensors.

    Raises:
        ConfigError: there is none, it is of other settings, or it is damaged.
    """
    folder = training.folder
    state = read_checkpoint(folder, device=device)
    if state.get("config") != training.metadata.get("config_hash"):
        raise ConfigError(
            f"resume={folder}: the training was begun with other settings, or another version of "
            "robot and environment.\nStart it again, in a folder of its own."
        )
    try:
        if state.get("environment") is not None:
            # one that never began has nothing to compare with
            training.environment.reset()
        refuse_other_form(state, training.state())
        remarks = training.resume(state)
    except SealsError:
        raise
    except Exception as cause:  # parts restore themselves, and say in their own ways what is amiss
        text = " ".join(str(cause).split())[:300] or type(cause).__name__
        raise ConfigError(
            f"{folder / FILE} cannot be resumed: {text}.\n"
            "It is damaged, or was not written by seals train; start again without resume."
        ) from cause
    if not alike_in_all((training.step, training.updates)):
        raise ConfigError(
            f"resume={folder}: its processes were interrupted at different steps, this one at "
            f"{training.step}.\nStart it again, in folders of their own."
        )
    return remarks


@contextlib.contextmanager
def stopping(training: Training) -> Iterator[None]:
    """Let Ctrl-C, or a cluster's stop signal, end the training between two updates.

    The second signal stops at once; the checkpoint is then an older one.
    """

    def stop(number: int, frame: object) -> None:
        if training.stop:
            raise KeyboardInterrupt
        training.stop = True

    with handled(stop, (signal.SIGINT, *ending())):
        yield
