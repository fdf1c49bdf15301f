"""Laws of motion whose arithmetic is joined into few kernels, by PyTorch's compiler."""

from seals.tensor_compiler.fused import Fused, repeated

__all__ = ["Fused", "repeated"]
