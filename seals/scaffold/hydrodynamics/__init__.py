"""Added mass and radiation of hulls from their shape: ellipsoids, and boundary elements."""

from seals.scaffold.hydrodynamics.boundary_elements import Radiation as Radiation
from seals.scaffold.hydrodynamics.boundary_elements import deep_added_mass as deep_added_mass
from seals.scaffold.hydrodynamics.boundary_elements import extrapolated as extrapolated
from seals.scaffold.hydrodynamics.boundary_elements import (
    has_boundary_elements as has_boundary_elements,
)
from seals.scaffold.hydrodynamics.boundary_elements import positive as positive
from seals.scaffold.hydrodynamics.boundary_elements import radiation_of as radiation_of
from seals.scaffold.hydrodynamics.boundary_elements import wave_frequencies as wave_frequencies
from seals.scaffold.hydrodynamics.ellipsoid import Ellipsoid as Ellipsoid
from seals.scaffold.hydrodynamics.ellipsoid import ellipsoid_of_moments as ellipsoid_of_moments
from seals.scaffold.hydrodynamics.panels import Panels as Panels
from seals.scaffold.hydrodynamics.panels import panels_of as panels_of
from seals.scaffold.hydrodynamics.resonators import Resonators as Resonators
from seals.scaffold.hydrodynamics.resonators import fit_resonators as fit_resonators
