"""Hull geometry: the submerged part of a body, exactly, from tables or from samples."""

from seals.hydrostatics.box import HullBox as HullBox
from seals.hydrostatics.compound import HullCompound as HullCompound
from seals.hydrostatics.cylinder import HullCapsule as HullCapsule
from seals.hydrostatics.cylinder import HullCylinder as HullCylinder
from seals.hydrostatics.fused import HullFused as HullFused
from seals.hydrostatics.mesh import HullMesh as HullMesh
from seals.hydrostatics.meshes import LoadedHull as LoadedHull
from seals.hydrostatics.meshes import MeshNote as MeshNote
from seals.hydrostatics.meshes import NoteKind as NoteKind
from seals.hydrostatics.meshes import hull_from_mesh as hull_from_mesh
from seals.hydrostatics.samples import HullSamples as HullSamples
from seals.hydrostatics.sphere import HullSphere as HullSphere
from seals.hydrostatics.table import HullTable as HullTable
from seals.hydrostatics.wetted import Hull as Hull
from seals.hydrostatics.wetted import Wetted as Wetted
