"""Choice of a working Mitsuba variant; compiled variants are tried in a child process."""

from __future__ import annotations

import enum
from functools import lru_cache
from pathlib import Path
from typing import Any

from seals.child_process import tried
from seals.errors import MissingExtra, PhysicsError, optional_import

SECONDS = 120.0
"""Longest time that a trial may take [s]."""
_TRIAL = Path(__file__).with_name("trial.py")


class Variant(enum.Enum):
    """Mitsuba variant; ``auto`` takes the fastest one that works here."""

    scalar_rgb = "scalar_rgb"
    llvm_ad_rgb = "llvm_ad_rgb"
    cuda_ad_rgb = "cuda_ad_rgb"
    auto = "auto"


def mitsuba(variant: Variant) -> Any:
    """Return the mitsuba module, set to a variant that runs here.

    Raises:
        MissingExtra: Mitsuba is not installed, or lacks the variant.
        PhysicsError: the variant was named and does not run here.
    """
    with optional_import(
        "renderer=mitsuba needs the package mitsuba",
        "Install it: pip install 'aam-seals[render]'; or draw without it: renderer=tiny",
    ):
        import mitsuba as mi
    chosen = _chosen(variant)
    if chosen not in mi.variants():
        raise MissingExtra(
            f"this build of mitsuba lacks the variant {chosen}.\nIt has: {', '.join(mi.variants())}"
        )
    if mi.variant() != chosen:
        mi.set_variant(chosen)
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def _chosen(variant: Variant) -> str:
    if variant is Variant.scalar_rgb:
        return str(variant.value)
    if variant is Variant.auto:
        order = (Variant.cuda_ad_rgb, Variant.llvm_ad_rgb)
        return next((v.value for v in order if not trial(v.value)), Variant.scalar_rgb.value)
    trouble = trial(variant.value)
    if trouble:
        raise PhysicsError(
            f"renderer.variant={variant.value} does not run here: {trouble}.\n"
            "Take renderer.variant=scalar_rgb, which runs everywhere; LLVM needs version 16 or "
            "later (apt-get install libllvm19, DRJIT_LIBLLVM_PATH=.../libLLVM.so.19.1)"
        )
    return str(variant.value)


@lru_cache(maxsize=8)
def trial(variant: str) -> str:
    """Return the error of a variant; empty when it works. An old LLVM ends its process."""
    code, last = tried(_TRIAL, variant, seconds=SECONDS)
    last = last.rstrip(".")[:160]
    if code is None:
        return f"a trial took longer than {SECONDS:g} s"
    if code < 0:
        return f"a trial was ended by signal {-code}" + (f" ({last})" if last else "")
    return (last or f"a trial ended with exit code {code}") if code else ""
