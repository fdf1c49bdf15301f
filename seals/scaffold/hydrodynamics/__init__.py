"""Added mass and radiation of hulls from their shape: ellipsoids, and boundary elements."""

from seals.scaffold.hydrodynamics.boundary_elements import (
    Radiation,
    deep_added_mass,
    extrapolated,
    has_boundary_elements,
    positive,
    radiation_of,
    wave_frequencies,
)
from seals.scaffold.hydrodynamics.ellipsoid import (
    Ellipsoid,
    added_mass_of_ellipsoid,
    ellipsoid_of_moments,
)
from seals.scaffold.hydrodynamics.panels import Panels, panels_of
from seals.scaffold.hydrodynamics.resonators import Resonators, fit_resonators

__all__ = [
    "Ellipsoid",
    "Panels",
    "Radiation",
    "Resonators",
    "added_mass_of_ellipsoid",
    "deep_added_mass",
    "ellipsoid_of_moments",
    "extrapolated",
    "fit_resonators",
    "has_boundary_elements",
    "panels_of",
    "positive",
    "radiation_of",
    "wave_frequencies",
]
