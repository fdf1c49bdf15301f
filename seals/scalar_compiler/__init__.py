"""Compiler of laws: scalar tracing for one robot, then machine code by LLVM, or C for a device.

A robot is so small that a call of NumPy costs more than its arithmetic. A law on the array API runs
once on `Traced` arrays, whose entries are nodes of a graph; LLVM makes one function of the graph,
or a kernel of an accelerator is written, a thread a robot (`device_rows`).
"""

from seals.scalar_compiler import functions as functions
from seals.scalar_compiler.clike import statements_of as statements_of
from seals.scalar_compiler.kernel import REFUSED as REFUSED
from seals.scalar_compiler.kernel import CannotCompile as CannotCompile
from seals.scalar_compiler.kernel import Kernel as Kernel
from seals.scalar_compiler.kernel import View as View
from seals.scalar_compiler.kernel import compiled as compiled
from seals.scalar_compiler.kernel import followed as followed
from seals.scalar_compiler.program import Place as Place
from seals.scalar_compiler.program import Program as Program
from seals.scalar_compiler.traced import Traced as Traced
from seals.scalar_compiler.traced import constant as constant
