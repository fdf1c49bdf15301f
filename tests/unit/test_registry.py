"""The registry names what is installed, and one bad package never breaks the host."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from seals import registry
from seals.errors import BrokenPlugin, ConfigError, UnknownPlugin

Install = Callable[[str, str, dict[str, str]], Path]

BROKEN = """
    [seals.effects]
    tidal_bore = bad_reef.effects:TidalBore
    vanished = bad_reef.nowhere:Nothing
"""


def test_unknown_name_has_the_house_form() -> None:
    """An unknown name is refused with the nearest one and the installed ones."""
    with pytest.raises(UnknownPlugin) as refusal:
        registry.get("effect", "quadratic_darg")
    first, second = str(refusal.value).split("\n")
    assert first == "effect 'quadratic_darg' is not installed."
    assert second.startswith("Did you mean 'quadratic_drag'?  Installed: accelerometer_bias, ")


def test_unknown_kind_is_refused_with_the_nearest() -> None:
    """A kind that does not exist is refused with the nearest one."""
    with pytest.raises(ConfigError, match="Did you mean 'effect'"):
        registry.plugins("efect")


def test_plugin_knows_its_package_and_summary() -> None:
    """A plug-in tells its package, version and first docstring line without being imported."""
    probe = (
        "import sys; from seals import registry; plugin = registry.get('effect', 'quadratic_drag');"
        "assert plugin.distribution == 'aam-seals' and plugin.summary.startswith('Quadratic drag');"
        "assert 'seals.plugins.effects.quadratic_drag' not in sys.modules"
    )
    subprocess.run([sys.executable, "-I", "-c", probe], check=True)


def test_view_is_read_only() -> None:
    """Nobody registers a plug-in by writing into the registry."""
    with pytest.raises(TypeError):
        registry.plugins("effect")["mine"] = registry.get("effect", "gravity")  # type: ignore[index]


def test_broken_plugin_is_refused_only_when_chosen(install: Install) -> None:
    """A plug-in whose module raises is listed, and refused with its cause when loaded."""
    install(
        "bad-reef",
        BROKEN,
        {"bad_reef/__init__.py": "", "bad_reef/effects.py": "raise RuntimeError('no tide here')"},
    )
    assert "tidal_bore" in registry.names("effect")
    assert registry.get("effect", "gravity").load().__name__ == "Gravity"
    with pytest.raises(BrokenPlugin, match="RuntimeError: no tide here") as refusal:
        registry.get("effect", "tidal_bore").load()
    assert isinstance(refusal.value.__cause__, RuntimeError)
    assert "bad-reef 1.0" in str(refusal.value)
    with pytest.raises(BrokenPlugin, match=r"bad_reef\.nowhere"):
        _ = registry.get("effect", "vanished").summary


def test_two_packages_with_one_name_are_both_named(install: Install) -> None:
    """A name that two packages declare is refused naming both, and others still work."""
    install("twin-reef", "[seals.effects]\ngravity = twin_reef:Gravity", {"twin_reef.py": ""})
    with pytest.raises(ConfigError) as refusal:
        registry.get("effect", "gravity")
    assert "aam-seals" in str(refusal.value)
    assert "twin-reef 1.0" in str(refusal.value)
    assert registry.get("effect", "buoyancy").name == "buoyancy"


def test_import_is_quick_and_light() -> None:
    """``import seals`` takes less than 0.3 s of the processor and imports nothing heavy."""
    probe = (
        "import sys, time; start = time.process_time(); import seals, seals.registry;"
        "spent = time.process_time() - start;"
        "heavy = {'torch', 'taichi', 'pybullet', 'pandas', 'hydra', 'numpy'};"
        "heavy &= set(sys.modules);"
        "assert not heavy, heavy; assert spent < 0.3, spent"
    )
    subprocess.run([sys.executable, "-I", "-c", probe], check=True)


def test_discovery_is_quick() -> None:
    """Naming every installed plug-in takes less than a second from cold."""
    registry.refresh()
    start = time.process_time()
    assert sum(len(registry.names(kind)) for kind in registry.GROUPS) > 20
    assert time.process_time() - start < 1.0
