"""PyBullet's OpenGL renderer without a display (EGL)."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from seals.child_process import command, environment
from seals.errors import MissingExtra
from seals.plugins.viewers.bullet.client import engine
from seals.plugins.viewers.bullet.drawing import Drawing, Sampling
from seals.plugins.viewers.bullet.renderer import RendererBullet
from seals.rendering.light import Light
from seals.rendering.scene import Scene

SAMPLING = Sampling("ER_BULLET_HARDWARE_OPENGL", (0.0, 0.0))
ENTRY = "_eglRendererPlugin"
"""Prefix of the plug-in's functions."""
PATIENCE = 60.0
"""How long a first picture may take [s]."""
_TRIAL = Path(__file__).with_name("egl_trial.py")


@dataclass(kw_only=True)
class RendererEgl(RendererBullet):
    """OpenGL renderer through EGL: fast on a graphics card, slow on a software driver.

    Equation:
        Pinhole projection, depth buffer; shading by PyBullet's own shader.

    Assumptions:
        A driver for EGL is installed. It is tried in a process of its own first, because one that
        is missing or broken can end the program.

    Valid range:
        Linux; one scene a process.

    Limitations:
        Best effort: colours follow PyBullet's shader and differ from the other renderers'.

    References:
        Coumans and Bai 2016-2021, PyBullet, eglRenderer plug-in.

    Example:
        >>> RendererEgl().close()
    """

    def begin(self, scene: Scene, light: Light) -> Drawing:
        """Test the driver, then load the scene.

        Raises:
            MissingExtra: the plug-in or a driver is missing, or the trial failed.
        """
        # the file of PyBullet's EGL plug-in
        engine("egl")
        found = find_spec("eglRenderer")
        if found is None or found.origin is None:
            raise MissingExtra(
                "viewer=egl needs PyBullet's plug-in eglRenderer, which this build does not have.\n"
                "Draw on the processor: viewer=tiny"
            )
        plugin = found.origin
        try_out(plugin)
        return Drawing(scene, light, SAMPLING, "egl", (plugin, ENTRY))


def try_out(plugin: str) -> None:
    """Test the driver by rendering a picture in a child process.

    Raises:
        MissingExtra: it did not work; the message says how it ended.
    """
    try:
        done = subprocess.run(
            command(_TRIAL, plugin),
            env=environment(),
            capture_output=True,
            timeout=PATIENCE,
            check=False,
        )
        ended = "" if done.returncode == 0 else f"ended with code {done.returncode}"
        words = done.stderr.decode(errors="replace") + done.stdout.decode(errors="replace")
    except subprocess.TimeoutExpired:
        ended, words = f"took more than {PATIENCE:g} s", ""
    if ended:
        last = next((x.strip() for x in reversed(words.splitlines()) if x.strip()), "no words")
        raise MissingExtra(
            f"viewer=egl: a trial picture {ended} ({last[:120]}).\n"
            "Install a driver for EGL (Debian: libegl1, libgl1-mesa-dri), or draw on the "
            "processor: viewer=tiny"
        )
