"""Test program: render a small image with a Mitsuba variant; an old LLVM may crash it.

    python trial.py VARIANT

Ends with 0, or with 3 when the picture is black.
"""

import os
import sys

# no file beside this one stands for a module of the standard library
if sys.path and sys.path[0] == os.path.dirname(__file__):
    del sys.path[0]


def main(variant: str) -> int:
    """Test a variant and return the exit code."""
    import mitsuba as mi

    mi.set_variant(variant)
    ball = {
        "type": "sphere",
        "center": [0.0, 0.0, 4.0],
        "bsdf": {"type": "dielectric"},
        "interior": {"type": "homogeneous", "albedo": 0.5, "sigma_t": 0.5},
    }
    film = {"type": "hdrfilm", "width": 8, "height": 8}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpath", "max_depth": 6},
            "sensor": {"type": "perspective", "film": film},
            "light": {"type": "constant"},
            "ball": ball,
        }
    )
    total = float(mi.TensorXf(mi.render(scene, spp=4)).numpy().sum())
    return 0 if total > 0.0 else 3


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
