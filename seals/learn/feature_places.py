"""Places of what the maps of a convolution respond to: a spatial soft argmax."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import nn


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
