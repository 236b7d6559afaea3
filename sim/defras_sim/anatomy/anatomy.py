"""A patient's anatomy: the resting tissue's surface and its volume meshes, kept in a file.

The file (NumPy's npz, without pickles) lies beside the scene that names it:

    surface_vertices_m (n, 3), surface_triangles (m, 3) outward, surface_side (m,): 1 upper face,
    -1 lower face, 0 neither; for each mesh NAME its NAME_nodes_m (k, 3) and NAME_tetrahedra (t, 4).
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from defras_sim.anatomy.curved_face import CurvedFace
from defras_sim.anatomy.topology import Topology, length_m
from defras_sim.geometry import Floats
from defras_sim.surface import Surface

MeshName = Literal["twin", "actual"]
MESHES: tuple[MeshName, ...] = ("twin", "actual")


@dataclass(frozen=True)
class VolumeMesh:
    """``nodes_m`` (k, 3), and ``tetrahedra`` (t, 4) of positive volume."""

    nodes_m: Floats
    tetrahedra: NDArray[np.int64]


class AnatomyReference(BaseModel):
    """How a scene names its anatomy: a file beside it, and the SHA-256 (hex) of what is in it."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    file: str
    sha256: str


@dataclass(frozen=True, eq=False)
class Anatomy:
    """The shape of a patient's resting tissue in the tissue frame.

    ``vertices_m`` (n, 3), ``triangles`` (m, 3) and ``side`` (m,) are its closed surface; ``mesh``
    names the one of ``meshes`` that a model of the tissue takes. Equal if read from equal files.
    """

    vertices_m: Floats
    triangles: NDArray[np.int64]
    side: NDArray[np.int64]
    meshes: Mapping[MeshName, VolumeMesh]
    file: Path
    sha256: str
    mesh: MeshName = "twin"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Anatomy) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[str, str]:
        return self.sha256, self.mesh

    def taking(self, mesh: MeshName) -> Anatomy:
        """The same anatomy with another mesh."""
        return replace(self, mesh=mesh)

    @cached_property
    def surface(self) -> Surface:
        """The resting tissue's surface."""
        upper = np.zeros(len(self.vertices_m), dtype=bool)
        upper[self.triangles[self.side == 1]] = True
        return Surface(self.vertices_m, self.triangles, upper, self.vertices_m[:, :2].copy())

    @property
    def volume_mesh(self) -> VolumeMesh:
        return self.meshes[self.mesh]

    @cached_property
    def upper(self) -> CurvedFace:
        return CurvedFace(self.vertices_m, self.triangles[self.side == 1], 1)

    @cached_property
    def lower(self) -> CurvedFace:
        return CurvedFace(self.vertices_m, self.triangles[self.side == -1], -1)

    @cached_property
    def low_m(self) -> Floats:
        return np.asarray(self.vertices_m.min(axis=0))

    @cached_property
    def high_m(self) -> Floats:
        return np.asarray(self.vertices_m.max(axis=0))

    @cached_property
    def outline_m(self) -> Floats:
        """The outline (k, 2) of the upper face seen from above, once around."""
        rims = Topology(self.upper.triangles).rims()
        longest = max(rims, key=lambda rim: length_m(rim, self.vertices_m))
        return np.asarray(self.vertices_m[longest][:, :2])

    def covers(self, xy_m: Floats) -> NDArray[np.bool_]:
        """At which of ``xy_m`` (n, 2) there is tissue."""
        return self.upper.covers(xy_m) & self.lower.covers(xy_m)

    def room_m(self, xy_m: Floats) -> Floats:
        """How far (n,) each place is from the rim; 0 where there is no tissue."""
        return np.where(self.covers(xy_m), self.upper.rim_distance_m(xy_m), 0.0)

    @classmethod
    def __get_pydantic_core_schema__(cls, _: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """In a scene file: a reference, read relative to ``context["folder"]``."""
        read = core_schema.with_info_after_validator_function(_referred, handler(AnatomyReference))
        return core_schema.union_schema(
            [core_schema.is_instance_schema(cls), read],
            mode="left_to_right",
            serialization=core_schema.plain_serializer_function_ser_schema(_reference),
        )


def write_anatomy(
    file: Path,
    surface: tuple[Floats, NDArray[np.int64], NDArray[np.int64]],
    meshes: Mapping[MeshName, VolumeMesh],
) -> Anatomy:
    """Write an anatomy whose ``surface`` is (vertices, triangles, side); give it as read again."""
    vertices_m, triangles, side = surface
    arrays: dict[str, NDArray[Any]] = {
        "surface_vertices_m": vertices_m,
        "surface_triangles": triangles.astype(np.int32),
        "surface_side": side.astype(np.int8),
    }
    for name, mesh in meshes.items():
        arrays[f"{name}_nodes_m"] = mesh.nodes_m
        arrays[f"{name}_tetrahedra"] = mesh.tetrahedra.astype(np.int32)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays, allow_pickle=False)
    file.write_bytes(buffer.getvalue())
    return read_anatomy(file)


def read_anatomy(file: Path) -> Anatomy:
    """Read an anatomy file.

    Raises:
        ValueError: it cannot be read, or lacks something.
    """
    try:
        content = file.read_bytes()
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(
            f"{file.name} cannot be read: {error}; defras scene from-mesh makes such files"
        ) from error
    needed = ["surface_vertices_m", "surface_triangles", "surface_side"]
    needed += [f"{name}_{part}" for name in MESHES for part in ("nodes_m", "tetrahedra")]
    if missing := [name for name in needed if name not in arrays]:
        raise ValueError(f"{file.name} is no anatomy: it lacks {', '.join(missing)}")
    meshes: dict[MeshName, VolumeMesh] = {
        name: VolumeMesh(
            arrays[f"{name}_nodes_m"].astype(float),
            arrays[f"{name}_tetrahedra"].astype(np.int64),
        )
        for name in MESHES
    }
    return Anatomy(
        vertices_m=arrays["surface_vertices_m"].astype(float),
        triangles=arrays["surface_triangles"].astype(np.int64),
        side=arrays["surface_side"].astype(np.int64),
        meshes=meshes,
        file=file,
        sha256=hashlib.sha256(content).hexdigest(),
    )


def _referred(reference: AnatomyReference, info: ValidationInfo) -> Anatomy:
    folder = (info.context or {}).get("folder", Path())
    anatomy = read_anatomy(folder / reference.file)
    if anatomy.sha256 != reference.sha256:
        raise ValueError(
            f"{reference.file} is not the file that this scene was made for; its SHA-256 is "
            f"{anatomy.sha256}"
        )
    return anatomy


def _reference(anatomy: Anatomy | None) -> dict[str, str] | None:
    return None if anatomy is None else {"file": anatomy.file.name, "sha256": anatomy.sha256}
