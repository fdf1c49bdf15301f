"""Hull geometry: the submerged part of a body, exactly, from tables or from samples."""

from seals.hydrostatics.box import HullBox
from seals.hydrostatics.compound import HullCompound
from seals.hydrostatics.cylinder import HullCapsule, HullCylinder
from seals.hydrostatics.fused import HullFused
from seals.hydrostatics.mesh import HullMesh
from seals.hydrostatics.meshes import LoadedHull, MeshNote, NoteKind, hull_from_mesh
from seals.hydrostatics.samples import HullSamples
from seals.hydrostatics.sphere import HullSphere
from seals.hydrostatics.table import HullTable
from seals.hydrostatics.wetted import Hull, Wetted

__all__ = [
    "Hull",
    "HullBox",
    "HullCapsule",
    "HullCompound",
    "HullCylinder",
    "HullFused",
    "HullMesh",
    "HullSamples",
    "HullSphere",
    "HullTable",
    "LoadedHull",
    "MeshNote",
    "NoteKind",
    "Wetted",
    "hull_from_mesh",
]
