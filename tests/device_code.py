"""Kernels of an accelerator compiled for the processor, one thread after the other."""

from __future__ import annotations

import ctypes
import hashlib
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

HEAD = """#include <cmath>
#include <cstddef>
struct Place { int x; };
static thread_local Place blockIdx, blockDim, threadIdx;
#define __global__
#define __launch_bounds__(threads, blocks)
"""


def use_host_compiler(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Let kernels be compiled by the C++ compiler of this machine; skip without one."""
    compiler = shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        pytest.skip("there is no C++ compiler: apt-get install g++")

    def compiled(text: str) -> Any:
        begin = text.index("rows(") + 5
        given = text[begin : text.index(") {", begin)]
        names = ", ".join(part.split()[-1].lstrip("*") for part in given.split(","))
        each = f"for (int k = 0; k < n; ++k) {{ threadIdx.x = k; rows({names}); }}"
        whole = f'{HEAD}{text}extern "C" void all({given}) {{ blockDim.x = 1; {each} }}\n'
        place = folder / hashlib.sha256(whole.encode()).hexdigest()[:16]
        source, library = place.with_suffix(".cpp"), place.with_suffix(".so")
        source.write_text(whole, encoding="utf-8")
        options = ["-O0", "-ffp-contract=off", "-w", "-shared", "-fPIC"]
        subprocess.run([compiler, *options, "-o", str(library), str(source)], check=True)
        law = ctypes.CDLL(str(library)).all

        def launch(*, grid: tuple[int, ...], block: tuple[int, ...], args: list[Any]) -> None:
            assert grid[0] * block[0] >= args[-1]
            law(*(ctypes.c_void_p(x.data_ptr()) for x in args[:-1]), ctypes.c_int(args[-1]))

        return launch

    monkeypatch.setattr("seals.scalar_compiler.device_rows._compiled", compiled)
