"""Laws of motion whose arithmetic is joined into few kernels, by PyTorch's compiler."""

from seals.fusion.fused import Fused, repeated

__all__ = ["Fused", "repeated"]
