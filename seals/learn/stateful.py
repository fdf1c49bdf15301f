"""State of agents and their parts: what is kept of them in a checkpoint, by attribute."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from seals.pytree import is_tensor


class Stateful:
    """Object whose state is that of some of its attributes.

    Attributes:
        parts: names of attributes with a state of their own: modules, optimisers, tensors, random
            number generators, stateful objects, mappings of these; None is left out.
        plain: names of attributes that are numbers, text, or nested mappings and lists of tensors.
    """

    parts: tuple[str, ...] = ()
    plain: tuple[str, ...] = ()

    def state(self) -> dict[str, Any]:
        """Return the complete state, as nested plain data and tensors."""
        found = {name: getattr(self, name) for name in self.parts}
        kept = {name: copy.copy(getattr(self, name)) for name in self.plain}
        return {
            **{name: _state_of(part) for name, part in found.items() if part is not None},
            **kept,
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned."""
        for name in self.parts:
            if getattr(self, name) is not None:
                _load_into(getattr(self, name), state[name])
        for name in self.plain:
            setattr(self, name, state[name])


def _state_of(part: Any) -> Any:
    """Return the state of a part."""
    if isinstance(part, Mapping):
        return {name: _state_of(inner) for name, inner in part.items()}
    if is_tensor(part):
        return part.detach().clone()
    if hasattr(part, "get_state"):
        return part.get_state().clone()
    return part.state_dict() if hasattr(part, "state_dict") else part.state()


def _load_into(part: Any, state: Any) -> None:
    """Restore the state of a part in place."""
    import torch

    if isinstance(part, Mapping):
        for name, inner in part.items():
            _load_into(inner, state[name])
    elif is_tensor(part):
        with torch.no_grad():
            part.copy_(state)
    elif hasattr(part, "set_state"):
        part.set_state(state.cpu())
    elif hasattr(part, "load_state_dict"):
        part.load_state_dict(state)
    else:
        part.load(state)
