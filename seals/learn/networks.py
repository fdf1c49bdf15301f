"""Networks built from a description in plain data, without code in policy files.

A description is what JSON holds: ``kind`` (``"mlp"`` or ``"pixels"``), sizes, and how the output
becomes an action. `actor_of` builds the deterministic policy; agents build their own networks from
the same parts, all of them TorchRL's or PyTorch's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError, refuse_unlisted

if TYPE_CHECKING:
    from torch import Tensor, nn


KINDS = ("mlp", "pixels")
"""Kinds of networks."""
POOLS = ("flat", "places")
"""How an encoder makes numbers of its last maps."""
_UNFIT = (LookupError, TypeError, ValueError, ArithmeticError, RuntimeError, AttributeError)
"""Errors of a network that is built from any description."""
_MOST_LAYERS, _WIDEST = 64, 1 << 16
"""Hidden layers of a network, and the width of each: a card of a stranger says how many."""
FARTHEST = 10.0
"""Normalised observations are cut off here, in standard deviations."""


def description(
    *,
    observation: int,
    action: int,
    hidden: Sequence[int],
    layer_norm: bool = False,
    normalise: bool = True,
    squash: str = "tanh",
    pixels: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the description of a policy.

    Args:
        observation: numbers in an observation, those of the picture not counted.
        action: numbers in an action.
        hidden: widths of the hidden layers.
        layer_norm: whether hidden layers are normalised.
        normalise: whether observations are brought to mean 0 and deviation 1.
        squash: ``"tanh"`` or ``"clip"``: how the output is kept in [-1, 1].
        pixels: what `encoder_of` takes, for a policy that sees.
    """
    found = {
        "kind": "mlp" if pixels is None else "pixels",
        "observation": observation,
        "action": action,
        "hidden": [int(width) for width in hidden],
        "layer_norm": layer_norm,
        "normalise": normalise,
        "squash": squash,
    }
    return found if pixels is None else {**found, "pixels": dict(pixels)}


def actor_of(network: Mapping[str, Any]) -> nn.Module:
    """Build the deterministic policy of a description, without its weights.

    Raises:
        ConfigError: there is no such kind, or a key is missing.
    """
    kind = network.get("kind")
    refuse_unlisted(str(kind), KINDS, f"a policy of kind '{kind}'")
    import torch

    with torch.device("cpu"):
        # its first import reads tensors, which it cannot where only shapes are made
        import torchrl.modules  # noqa: F401
    try:
        return _mlp_actor(network) if kind == "mlp" else _pixel_actor(network)
    except _UNFIT as cause:
        raise ConfigError(
            f"the description of a policy cannot be used: {cause!r}.\n"
            "Restore the card.json that the training wrote, or train again."
        ) from cause


def mlp(inputs: int, outputs: int, hidden: Sequence[int], *, layer_norm: bool = False) -> nn.Module:
    """Return a TorchRL network of dense layers with ReLU.

    Raises:
        ConfigError: a hidden layer is out of range.
    """
    # refuse layers of no width, or more of them than a network is built for
    sound = all(isinstance(width, int) and 1 <= width <= _WIDEST for width in hidden)
    if len(hidden) > _MOST_LAYERS or not sound:
        given = f"{list(hidden)!r:.60}" + (f", {len(hidden)} layers" if len(hidden) > 9 else "")
        raise ConfigError(
            f"hidden={given} is not allowed.\n"
            f"Allowed: up to {_MOST_LAYERS} layers, each from 1 to {_WIDEST} wide"
        )
    import torch
    from torchrl.modules import MLP

    norm = torch.nn.LayerNorm if layer_norm else None
    kwargs: Any = [{"normalized_shape": width} for width in hidden] if layer_norm else None
    return MLP(
        in_features=inputs,
        out_features=outputs,
        num_cells=list(hidden),
        activation_class=torch.nn.ReLU,
        norm_class=norm,
        norm_kwargs=kwargs,
    )


def normaliser_of(size: int) -> nn.Module:
    """Return a layer that normalises observations by a fixed mean and standard deviation."""
    import torch

    found: nn.Module = torch.nn.BatchNorm1d(size, affine=False, eps=1e-5)
    return found.eval()


def encoder_of(pixels: Mapping[str, Any]) -> nn.Module:
    """Return the image encoder: layers from pixels to features.

    Args:
        pixels: ``shape`` (C, H, W), ``channels`` of each layer, ``strides``, ``features``, and
            ``pool``, how maps become numbers: ``flat`` or ``places``, flat where absent; the
            policy also reads ``use_pixels``, ``use_state`` and ``columns``, which are the numbers
            that it looks at.

    Raises:
        ConfigError: nothing would be left of a picture so small.
    """
    import torch
    from torchrl.modules import ConvNet

    channels, height, width = pixels["shape"]
    strides = list(pixels["strides"])
    # refuse images too small for the 3 by 3 convolutions
    size = min(height, width)
    least = 1
    for stride in reversed(strides):
        least = (least - 1) * stride + 3
    if size < least:
        raise ConfigError(
            f"pictures of {size} pixels are too small for layers of strides {strides}.\n"
            f"Allowed: from {least} pixels on; or use fewer or smaller learner.strides."
        )
    located = pixels.get("pool", POOLS[0]) == "places"
    convolutions = ConvNet(
        in_features=channels,
        num_cells=[pixels["channels"]] * len(strides),
        kernel_sizes=3,
        strides=strides,
        activation_class=torch.nn.ReLU,
        **({"aggregator_class": feature_places, "aggregator_kwargs": {}} if located else {}),
    )
    with torch.no_grad():
        flat = convolutions(torch.zeros(1, channels, height, width)).shape[-1]
    return torch.nn.Sequential(
        convolutions,
        torch.nn.Linear(flat, pixels["features"]),
        torch.nn.LayerNorm(pixels["features"]),
        torch.nn.Tanh(),
    )


def network_inputs(
    observation: Any,
    *,
    norm: nn.Module | None,
    encoder: nn.Module | None,
    use_state: bool = True,
    columns: Any = None,
) -> Tensor:
    """Return the inputs of the dense layers: normalised state and image features.

    Args:
        observation: numbers (N, d), or a mapping of ``state`` and ``pixels``.
        norm: layer that normalises numbers, or None.
        encoder: layers of the picture, or None for a blind policy.
        use_state: whether numbers are looked at.
        columns: which of them, a list or a tensor of places; None for all.
    """
    import torch

    parts = []
    if use_state:
        numbers = observation["state"] if isinstance(observation, Mapping) else observation
        scaled = numbers if norm is None else norm(numbers).clamp(-FARTHEST, FARTHEST)
        parts.append(scaled if columns is None else scaled[:, columns])
    if encoder is not None:
        parts.append(encoder(observation["pixels"].float() / 255.0 - 0.5))
    return torch.cat(parts, -1) if len(parts) > 1 else parts[0]


def features_of(observation: int, pixels: Mapping[str, Any]) -> int:
    """Return the size of `network_inputs` of a policy, with or without images."""
    seen = int(pixels["features"]) if pixels["use_pixels"] else 0
    columns = pixels.get("columns")
    own = observation if columns is None else len(columns)
    return seen + (own if pixels["use_state"] else 0)


def _squash(network: Mapping[str, Any]) -> nn.Module:
    import torch

    if network["squash"] == "tanh":
        return torch.nn.Tanh()
    return torch.nn.Hardtanh(-1.0, 1.0)


def _mlp_actor(network: Mapping[str, Any]) -> nn.Module:
    import torch

    from seals.learn.batched import vector

    class MlpActor(torch.nn.Sequential):
        """Policy on numbers; a picture beside them is not looked at."""

        def forward(self, observation: Any) -> Any:
            return super().forward(vector(observation))

    size = int(network["observation"])
    front: list[nn.Module] = []
    if network["normalise"]:
        front = [normaliser_of(size), torch.nn.Hardtanh(-FARTHEST, FARTHEST)]
    body = mlp(size, int(network["action"]), network["hidden"], layer_norm=network["layer_norm"])
    return MlpActor(*front, body, _squash(network)).eval()


def _pixel_actor(network: Mapping[str, Any]) -> nn.Module:
    import torch

    class PixelActor(torch.nn.Module):
        """Policy that sees a picture, and numbers beside it."""

        def __init__(self) -> None:
            super().__init__()
            pixels, size = network["pixels"], int(network["observation"])
            self.use_state = bool(pixels["use_state"])
            self.columns = pixels.get("columns")
            self.norm = normaliser_of(size) if self.use_state and network["normalise"] else None
            self.encoder = encoder_of(pixels) if pixels["use_pixels"] else None
            inputs = features_of(size, pixels)
            hidden = network["hidden"]
            self.body = mlp(inputs, network["action"], hidden, layer_norm=network["layer_norm"])
            self.squash = _squash(network)

        def forward(self, observation: Any) -> Any:
            features = network_inputs(
                observation,
                norm=self.norm,
                encoder=self.encoder,
                use_state=self.use_state,
                columns=self.columns,
            )
            return self.squash(self.body(features))

    return PixelActor().eval()


def policy_of(
    network: Mapping[str, Any],
    *,
    body: nn.Module,
    norm: nn.Module | None,
    encoder: nn.Module | None = None,
) -> tuple[dict[str, Any], dict[str, Tensor]]:
    """Return the deterministic policy of networks in training: its description and its tensors.

    Args:
        network: the description.
        body: dense layers whose first outputs are the action before squashing.
        norm: layer that normalises observations.
        encoder: layers of the picture.
    """
    actor: Any = actor_of(network)
    seen = network["kind"] == "pixels"
    # keep only the means among the outputs of the last layer, without the deviations
    tensors = body.state_dict()
    count = int(network["action"])
    last = [key for key in tensors if key.endswith(".weight")][-1].removesuffix(".weight")
    found = {key: value.detach() for key, value in tensors.items()}
    for part in ("weight", "bias"):
        found[f"{last}.{part}"] = found[f"{last}.{part}"][:count]
    (actor.body if seen else actor[-2]).load_state_dict(found)
    target = actor.norm if seen else (actor[0] if network["normalise"] else None)
    if target is not None and norm is not None:
        target.load_state_dict(norm.state_dict())
    if seen and actor.encoder is not None and encoder is not None:
        actor.encoder.load_state_dict(encoder.state_dict())
    return dict(network), {key: value.clone() for key, value in actor.state_dict().items()}


def feature_places() -> nn.Module:
    """Return a layer from maps (..., C, H, W) to the places of their responses (..., 3 C).

    Equation:
        p_ij = exp(beta a_ij) / sum exp(beta a);  x = sum p_ij x_j,  y = sum p_ij y_i,  max a

    x and y go from -1 to 1 over a map; beta is learned, one for all maps.

    References:
        Levine et al. 2016, arXiv 1504.00702, section 4.2; Finn et al. 2016, arXiv 1509.06113.
    """
    import torch

    class FeaturePlaces(torch.nn.Module):
        """Soft argmax and height of each map."""

        def __init__(self) -> None:
            super().__init__()
            self.log_beta = torch.nn.Parameter(torch.ones(()))

        def forward(self, maps: Any) -> Any:
            height, width = maps.shape[-2:]
            across = torch.linspace(-1.0, 1.0, width, device=maps.device)
            down = torch.linspace(-1.0, 1.0, height, device=maps.device)
            flat = maps.flatten(-2)
            share = (flat * self.log_beta.exp()).softmax(-1).unflatten(-1, (height, width))
            places = ((share.sum(-2) * across).sum(-1), (share.sum(-1) * down).sum(-1))
            return torch.cat((*places, flat.amax(-1)), -1)

    return FeaturePlaces()
