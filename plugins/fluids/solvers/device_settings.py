"""Options that all particle solvers on a device share; kernel functions and neighbour searches."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from seals.environment.seawater import FRESH_WATER
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.plugins.fluids.solver import Domain
from seals.schema import check_tree, count, param, setting

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.device_solver import DeviceSolver


class Kernel(Enum):
    """Shapes of the smoothing kernel."""

    spline = "spline"
    wendland = "wendland"


class Search(Enum):
    """Kind of neighbour search: stored list per substep, or cell search in each pass."""

    auto = "auto"
    list = "list"
    cells = "cells"


@roles(data="deterministic outflow")
@dataclass(kw_only=True)
class DeviceSettings(ABC):
    """Physics and numerics that all particle solvers on a device share.

    Args:
        density: rest density [kg/m^3].
        gravity: acceleration of free fall, acting against world z [m/s^2].
        sound_speed: speed of sound of the constraint's compliance [m/s]; 0 takes ten times the
            fastest long wave of the filled depth, so that water at rest is compressed by less
            than one per cent. A substep should not exceed three spacings over this speed.
        solid_scale: weight s of boundary volumes in the density [1].
        stress_correction: isotropic stress correction: fraction of the spurious shear stress that
            is removed [1], see `device.isotropy`; 0 switches it off: a quarter faster, but water
            at rest then has a yield stress.
        viscosity: rate of XSPH velocity smoothing [1/s]; a kinematic viscosity of about
            0.3 rate spacing^2.
        artificial_viscosity: viscosity of fourth order (biharmonic), rate at particle scale [1/s]:
            the XSPH operator applied twice, so that flow which is smooth over ten spacings is not
            damped. It removes the noise of ``stress_correction``; waves lose half as much as with a
            second-order viscosity of the same effect on noise.
        wall_friction: skin friction coefficient of walls that stand still [1]: a stress of half of
            it times density times speed squared on the layer at the wall. A smooth plate has
            1.33 / sqrt(Re) while its boundary layer is laminar, 0.074 / Re^(1/5) then
            (Schlichting); walls slide without it. With stored lists only.
        body_friction: the same of bodies [1]; what it takes from the water pulls the body along.
        suction: largest tension of water that is enclosed by water, walls and bodies [Pa]: flow
            stays attached where its pressure falls below that of the air. 0 lets it tear off
            there.
        cohesion: surface tension by attraction after Akinci et al. 2013 [N/m], 0.072 for water;
            0 switches it off. Set ``sound_speed`` to sqrt(60 cohesion / (density spacing)) [m/s] or
            more: then it compresses the water by two per cent or less.
        adhesion: work of adhesion between water and all boundaries [N/m]: a drop then has the
            contact angle theta of cohesion (1 + cos theta) = adhesion; 0 wets nothing. With stored
            lists only.
        vorticity: strength of vorticity confinement [1]; 0 switches it off.
        kernel: smoothing kernel. The cubic spline holds submerged spheres, boxes and cylinders
            best; Wendland's is a tenth faster and holds the pressure of a still column best.
        support: reach of the kernel [1 spacing]. 2 has 26 neighbours on the lattice and is the
            fastest; 2.3 has 56 and carries waves better.
        search: neighbour search; ``auto`` takes the list, which wins on CPU and CUDA.
        neighbours: longest list of neighbours, fluid and boundary together.
        deterministic: particles of a cell keep the order of their numbers, so that a run repeats
            bit for bit on any number of threads.
        outflow: particles that leave the domain are taken out and counted, not refused.
    """

    density: float = param(
        FRESH_WATER, "kg/m^3", bounds=(1.0, 2e4), tolerance=0.003, relative=True, source="fresh"
    )
    gravity: float = setting(9.81, "m/s^2", bounds=(0.0, 30.0), source="standard")
    sound_speed: float = setting(0.0, "m/s", bounds=(0.0, 2000.0), source="chosen")
    solid_scale: float = setting(1.0, "1", bounds=(0.1, 4.0), source="Macklin et al. 2014")
    stress_correction: float = setting(0.95, "1", bounds=(0.0, 1.0), source="measured on waves")
    viscosity: float = param(0.0, "1/s", bounds=(0.0, 1e4), tolerance=1.0, source="off")
    artificial_viscosity: float = setting(
        400.0, "1/s", bounds=(0.0, 1e4), source="measured on waves"
    )
    wall_friction: float = param(
        0.0, "1", bounds=(0.0, 1.0), tolerance=0.002, source="off; flat plate about 0.004"
    )
    body_friction: float = param(
        0.0, "1", bounds=(0.0, 10.0), tolerance=0.002, source="off; flat plate about 0.004"
    )
    suction: float = setting(0.0, "Pa", bounds=(0.0, 1e6), source="chosen; cavitation at 1e5")
    cohesion: float = param(0.0, "N/m", bounds=(0.0, 10.0), tolerance=0.0, source="off")
    adhesion: float = param(0.0, "N/m", bounds=(0.0, 20.0), tolerance=0.0, source="off")
    vorticity: float = param(0.0, "1", bounds=(0.0, 10.0), tolerance=0.0, source="off")
    kernel: Kernel = Kernel.spline
    support: float = setting(2.0, "1", bounds=(1.8, 3.5), source="chosen")
    search: Search = Search.auto
    neighbours: int = count(80, bounds=(32, 255))
    deterministic: bool = False
    outflow: bool = False

    def __post_init__(self) -> None:
        """Check that what needs stored lists has them."""
        check_tree(self, where="physics")
        asked = [n for n in ("wall_friction", "body_friction", "adhesion") if getattr(self, n) > 0]
        if asked and self.search is Search.cells:
            raise ConfigError(
                f"search=cells stores no lists of neighbours, which {', '.join(asked)} needs.\n"
                "Use search=list, or leave it out."
            )

    @abstractmethod
    def build(self, domain: Domain, *, device: str, threads: int) -> DeviceSolver:
        """Allocate the solver, see `SolverSettings.build`; Taichi starts with the first one."""
