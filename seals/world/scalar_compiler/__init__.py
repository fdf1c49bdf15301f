"""Compiler for the effects of one robot: scalar tracing, then LLVM machine code.

A robot is so small that a call of NumPy costs more than its arithmetic. A law on the array API runs
once on `Traced` arrays, whose entries are nodes of a graph; LLVM makes one function of the graph.
"""

from seals.world.scalar_compiler import functions as functions
from seals.world.scalar_compiler.kernel import REFUSED, CannotCompile, Kernel, compiled
from seals.world.scalar_compiler.traced import Traced, constant

__all__ = ["REFUSED", "CannotCompile", "Kernel", "Traced", "compiled", "constant"]
