"""Heave of a floating hemisphere of radius a: coefficients by Hulme 1982, J. Fluid Mech. 121."""

from __future__ import annotations

import numpy as np

HEAVE = np.array(
    [
        [0.05, 0.8764, 0.1036],
        [0.1, 0.8627, 0.1816],
        [0.2, 0.7938, 0.2793],
        [0.3, 0.7157, 0.3254],
        [0.4, 0.6452, 0.3410],
        [0.5, 0.5861, 0.3391],
        [0.6, 0.5381, 0.3271],
        [0.7, 0.4999, 0.3098],
        [0.8, 0.4698, 0.2899],
        [0.9, 0.4464, 0.2691],
        [1.0, 0.4284, 0.2484],
        [1.2, 0.4047, 0.2096],
        [1.4, 0.3924, 0.1756],
        [1.6, 0.3871, 0.1469],
        [1.8, 0.3864, 0.1229],
        [2.0, 0.3884, 0.1031],
        [2.5, 0.3988, 0.0674],
        [3.0, 0.4111, 0.0452],
        [4.0, 0.4322, 0.0219],
        [5.0, 0.4471, 0.0116],
        [6.0, 0.4574, 0.0066],
        [7.0, 0.4647, 0.0040],
        [8.0, 0.4700, 0.0026],
        [9.0, 0.4740, 0.0017],
        [10.0, 0.4771, 0.0012],
    ]
)
"""K a, added mass by displaced mass, damping by displaced mass and frequency [1]; K = w^2 / g."""
LIMIT, SURGE_LIMIT = 0.5, 0.2732
"""Added mass at infinite frequency by displaced mass: heave, surge [1]."""
