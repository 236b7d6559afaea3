"""Anatomies for the training data: curved sheets by formulas, and surfaces read from STL files.

Each becomes a scene as ``defras scene from-mesh`` makes one. Meshing takes seconds and the dents of
the holes some more, so they are made once and kept in the folder of the data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from defras_sim.anatomy.building import built
from defras_sim.anatomy.reading import read_surface
from defras_sim.anatomy.repair import sound_surface
from defras_sim.anatomy.solid import tissue_of
from defras_sim.geometry import Floats
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_file import write_scene
from defras_sim.scene_from_surface import believed_scene

_CELLS = 26
SHIPPED = ("flap",)
"""Scenes of the project that were imported from a mesh."""


@dataclass(frozen=True)
class SheetFormula:
    """The upper face of a sheet ``length_x_m`` by ``width_y_m``: its height over x and y [m].

    With ``through_file`` it is written to an STL file first and read as a patient's surface is.
    """

    length_x_m: float
    width_y_m: float
    thickness_m: float
    height_m: Callable[[Floats, Floats], Floats]
    through_file: bool = False

    def surface(self) -> trimesh.Trimesh:
        """An open surface, facing up."""
        side = np.linspace(-1.0, 1.0, _CELLS + 1)
        u, v = np.meshgrid(side, side)
        x, y = (u * self.length_x_m / 2).ravel(), (v * self.width_y_m / 2).ravel()
        first = (np.arange(_CELLS)[:, None] * (_CELLS + 1) + np.arange(_CELLS)).ravel()
        right, above = first + 1, first + _CELLS + 1
        triangles = np.concatenate(
            [np.stack([first, right, above], 1), np.stack([right, above + 1, above], 1)]
        )
        vertices = np.stack([x, y, self.height_m(x, y)], axis=1)
        return trimesh.Trimesh(vertices, triangles, process=False)


FORMULAS: Mapping[str, SheetFormula] = {
    "arch": SheetFormula(0.13, 0.11, 0.005, lambda x, y: 0.012 * np.cos(y / 0.05) + 0 * x),
    "saddle": SheetFormula(0.12, 0.12, 0.004, lambda x, y: 3.0 * (x**2 - y**2)),
    "lobe": SheetFormula(
        0.14,
        0.11,
        0.006,
        lambda x, y: 0.014 * np.exp(-(((x - 0.02) / 0.05) ** 2) - (y / 0.045) ** 2),
        through_file=True,
    ),
    "ridge": SheetFormula(
        0.11,
        0.13,
        0.005,
        lambda x, y: 0.008 * np.sin(x / 0.03) + 0.003 * np.cos(y / 0.02),
        through_file=True,
    ),
}


def anatomy_scenes(folder: Path, tell: Callable[[str], None]) -> list[Scene]:
    """The shipped anatomies and those of :data:`FORMULAS`, kept in ``folder``; what is missing
    there is made.

    Raises:
        RefusedSurface: a surface cannot be meshed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name in SHIPPED:
        if not (folder / f"{name}.yaml").exists():
            write_scene(load_scene(resource(f"sim/scenes/{name}.yaml")), folder / f"{name}.yaml")
    for name, formula in FORMULAS.items():
        if not (folder / f"{name}.yaml").exists():
            tell(f"meshing {name}")
            _make(name, formula, folder / f"{name}.yaml")
    return [load_scene(folder / f"{name}.yaml") for name in (*SHIPPED, *FORMULAS)]


def _make(name: str, formula: SheetFormula, file: Path) -> None:
    mesh = formula.surface()
    if formula.through_file:
        exported = file.with_suffix(".stl")
        mesh.export(exported)
        mesh = read_surface(exported, "m", "z")
    tissue = tissue_of(sound_surface(mesh), formula.thickness_m)
    anatomy = built(tissue, file.with_suffix(".npz"), lambda sentence: None)
    scene = believed_scene(
        anatomy,
        name=name,
        description=f"{name}, drawn by a formula.",
        thickness_m=formula.thickness_m,
        held="far",
    )
    write_scene(scene, file)
