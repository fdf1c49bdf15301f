"""Compiler for the effects of one robot: scalar tracing, then LLVM machine code.

A robot is so small that a call of NumPy costs more than its arithmetic. A law on the array API runs
once on `Traced` arrays, whose entries are nodes of a graph; LLVM makes one function of the graph.
"""

from seals.world.scalar_compiler import functions as functions
from seals.world.scalar_compiler.clike import statements_of as statements_of
from seals.world.scalar_compiler.kernel import REFUSED as REFUSED
from seals.world.scalar_compiler.kernel import CannotCompile as CannotCompile
from seals.world.scalar_compiler.kernel import Kernel as Kernel
from seals.world.scalar_compiler.kernel import View as View
from seals.world.scalar_compiler.kernel import compiled as compiled
from seals.world.scalar_compiler.kernel import followed as followed
from seals.world.scalar_compiler.kernel import refuse_asking as refuse_asking
from seals.world.scalar_compiler.program import Place as Place
from seals.world.scalar_compiler.program import Program as Program
from seals.world.scalar_compiler.traced import Traced as Traced
from seals.world.scalar_compiler.traced import constant as constant
