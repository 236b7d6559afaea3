"""What is compared of a recording and a model: one row per channel, one column per frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Channel
from defras_bt.diagnosis.twins.tissue_cells import AssignedCloud, CellGrid
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Scene

CLOUD_FLOOR_M = 0.0003
CLOUD_FLOOR_SHARE = 0.02
"""Of the largest way that a patch of tissue goes. Models of one and the same tissue on different
fine meshes differ by so much: 0.4 mm on patches that go 20 mm, 0.5 mm on those that go 80."""
FORCE_FLOOR_N = 0.005
FORCE_FLOOR_SHARE = 0.05
"""Of the largest force measured: the twin's force is as good as that."""
TIP_FLOOR_M = 0.0001
_AXES = "xyz"


@dataclass(frozen=True)
class Layout:
    """Which rows there are: the patches of ``grid``, then force and tip of each arm along x, y, z.

    ``with_force``, ``with_tip``: arms of which that was measured in some recording.
    """

    grid: CellGrid
    with_force: tuple[str, ...]
    with_tip: tuple[str, ...]

    @staticmethod
    def of(scene: Scene, trajectories: Sequence[Trajectory]) -> Layout:
        arms = tuple(scene.arms)
        return Layout(
            CellGrid.over(scene.tissue),
            tuple(a for a in arms if any(a in each.forces_n for each in trajectories)),
            tuple(a for a in arms if any(a in each.tips_m for each in trajectories)),
        )

    @property
    def rows(self) -> int:
        return len(self.grid) + 3 * len(self.with_force) + 3 * len(self.with_tip)

    @property
    def first_tip_row(self) -> int:
        return len(self.grid) + 3 * len(self.with_force)

    @property
    def names(self) -> tuple[str, ...]:
        forces = [f"{arm} force {axis}" for arm in self.with_force for axis in _AXES]
        tips = [f"{arm} tip {axis}" for arm in self.with_tip for axis in _AXES]
        return (*self.grid.names, *forces, *tips)

    def residual(
        self,
        trajectory: Trajectory,
        assigned: Sequence[AssignedCloud],
        frames: TissueFrames,
        camera: Camera,
    ) -> Floats:
        """Measured minus predicted (rows, frames); distances are positive where tissue was seen
        outside of the model's. NaN where nothing can be compared."""
        return np.concatenate(
            [
                cloud_residual_m(assigned, frames, camera, len(self.grid)),
                *(self._beside(trajectory.forces_n, frames.forces_n, a) for a in self.with_force),
                *(self._beside(trajectory.tips_m, frames.tips_m, a) for a in self.with_tip),
            ]
        )

    @staticmethod
    def _beside(
        measured: Mapping[str, Floats], predicted: Mapping[str, Floats], arm: str
    ) -> Floats:
        """Measured minus predicted (3, frames) of one arm."""
        count = len(next(iter(predicted.values())))
        return np.asarray((measured.get(arm, np.full((count, 3), np.nan)) - predicted[arm]).T)

    def channels(
        self, noise_sd: Floats, gone_m: Floats, largest_force_n: float, mesh_error: Floats
    ) -> tuple[Channel, ...]:
        """Every row with what its sensor scatters (rows,). ``gone_m`` (cells,): how far each patch
        goes at most; ``mesh_error`` (rows,): what this twin's mesh is known to get wrong."""
        cells, force_floor_n = (
            len(self.grid),
            max(FORCE_FLOOR_N, FORCE_FLOOR_SHARE * largest_force_n),
        )
        found = []
        for row, name in enumerate(self.names):
            if row < cells:
                x, y = self.grid.places_m[row]
                sd = float(noise_sd[row])
                floor_m = max(
                    CLOUD_FLOOR_M, CLOUD_FLOOR_SHARE * float(gone_m[row]), float(mesh_error[row])
                )
                found.append(Channel(name, "cloud", "m", sd, floor_m, (float(x), float(y))))
            elif row < cells + 3 * len(self.with_force):
                floor_n = max(force_floor_n, float(mesh_error[row]))
                found.append(Channel(name, "force", "N", float(noise_sd[row]), floor_n))
            else:
                found.append(Channel(name, "tip", "m", float(noise_sd[row]), TIP_FLOOR_M))
        return tuple(found)


def cloud_residual_m(
    assigned: Sequence[AssignedCloud], frames: TissueFrames, camera: Camera, cells: int
) -> Floats:
    """Mean distance (cells, frames) of each patch's points off the model's visible surface."""
    found = np.full((cells, len(assigned)), np.nan)
    for frame, (cloud, surface) in enumerate(zip(assigned, frames.surfaces, strict=True)):
        if surface is not None:
            found[:, frame] = cloud.residual_m(frames.corrected(cloud.points_m), surface, camera)
    return found


def gone_m(frames: TissueFrames, grid: CellGrid) -> Floats:
    """How far each patch (cells,) lies, at most, from where it lay first."""
    surfaces = [surface for surface in frames.surfaces if surface is not None]
    first = surfaces[0]
    cell = grid.cells(first.rest_xy_m, first.upper)
    count = np.maximum(np.bincount(cell, minlength=len(grid)), 1)
    most = np.zeros(len(grid))
    for surface in surfaces:
        way = np.linalg.norm(surface.vertices_m - first.vertices_m, axis=1)
        most = np.maximum(most, np.bincount(cell, way, minlength=len(grid)) / count)
    return most
