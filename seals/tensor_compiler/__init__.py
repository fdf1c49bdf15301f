"""Compiler for functions of many small PyTorch tensors: scalar columns, then Inductor.

`compile_law` is the only name for other packages. What it gains over ``torch.compile`` stands in
docs/architecture.md; ``python benchmarks/compile_laws.py`` measures it.
"""

from seals.tensor_compiler.fused import compile_law as compile_law
