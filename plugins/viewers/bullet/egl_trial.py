"""Test program: load PyBullet's EGL plug-in and render; a missing driver may crash it.

    python egl_trial.py PLUGIN_FILE

Ends with 0, or with 3 when the plug-in cannot be loaded.
"""

import os
import sys

# no file beside this one stands for a module of the standard library
if sys.path and sys.path[0] == os.path.dirname(__file__):
    del sys.path[0]


def main(plugin: str) -> int:
    """Test the EGL plug-in in a file and return the exit code."""
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    if pybullet.loadPlugin(plugin, "_eglRendererPlugin") < 0:
        return 3
    pybullet.getCameraImage(8, 8, renderer=pybullet.ER_BULLET_HARDWARE_OPENGL)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
