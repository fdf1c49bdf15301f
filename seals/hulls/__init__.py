"""Hull geometry: what part of a body is under water, exactly, from tables and from samples."""

from seals.hulls.box import HullBox
from seals.hulls.compound import HullCompound
from seals.hulls.cylinder import HullCapsule, HullCylinder
from seals.hulls.fused import HullFused
from seals.hulls.mesh import HullMesh
from seals.hulls.meshes import LoadedHull, MeshNote, NoteKind, hull_from_mesh
from seals.hulls.samples import HullSamples
from seals.hulls.sphere import HullSphere
from seals.hulls.table import HullTable
from seals.hulls.wetted import Hull, Wetted

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
