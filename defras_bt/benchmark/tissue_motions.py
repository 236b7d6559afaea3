"""The motions on which models of tissue are compared: what is held, where it is grasped, the way.

No bed lies under the tissue, and no gravity acts: then every motion has one smooth branch of
equilibria, and what is compared is the tissue alone. (A bed is a law of contact, which every model
has its own of; a folded flap would press on it.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue

TWO_EDGES = ("#..........#",) * 12
ONE_SIDE = ("##..........",) * 12

CHECKPOINT_M = 0.005
"""Models are compared wherever the tip has gone this much farther."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Motion:
    """``way_m``: where the tip goes, one straight line after the other, from where it grasped.

    ``attached`` is the map of the holes. The jaw keeps its orientation.
    """

    name: str
    title: str
    attached: tuple[str, ...]
    grasp_xy_m: tuple[float, float]
    way_m: tuple[Vector, ...]

    def scene(self) -> Scene:
        """The default slab, held as this motion needs it."""
        return Scene(
            name=self.name,
            attachments=Attachments(map=self.attached),
            roi=Roi(center_x_m=0.0, center_y_m=0.0),
            tissue=Tissue(bed=False),
        )

    @property
    def start(self) -> Pose:
        """The tip when it grasps."""
        return Pose(np.array([*self.grasp_xy_m, 0.0]))

    def tips(self, step_m: float) -> list[Pose]:
        """Poses of the tip (tissue frame), at most ``step_m`` apart, the start not among them."""
        here, tips = np.zeros(3), []
        for goal in self.way_m:
            way = np.array(goal) - here
            count = int(np.ceil(np.linalg.norm(way) / step_m - 1e-9))
            tips += [self.start.moved(here + way * n / count) for n in range(1, count + 1)]
            here = np.array(goal)
        return tips

    @property
    def length_m(self) -> float:
        """Length of the whole way."""
        corners = np.array([(0.0, 0.0, 0.0), *self.way_m])
        return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())


CENTRE_LIFT = Motion("centre_lift", "Centre lift", TWO_EDGES, (0.0, 0.0), ((0, 0, 0.04),))
OFF_CENTRE_LIFT = Motion(
    "off_centre_lift", "Off-centre lift", TWO_EDGES, (0.025, 0.025), ((0, 0, 0.04),)
)
CORNER_FOLD = Motion(
    "corner_fold", "Corner fold", ONE_SIDE, (0.05, 0.05), ((0, 0, 0.04), (-0.05, 0, 0.04))
)
PLANAR_MOVE = Motion(
    "planar_move", "Planar move", TWO_EDGES, (0.0, -0.025), ((0, 0, 0.03), (0, 0.03, 0.03))
)
PULL = Motion("pull_60", "Pull of 60 mm", ONE_SIDE, (0.05, 0.0), ((0, 0, 0.06),))

MOTIONS = (CENTRE_LIFT, OFF_CENTRE_LIFT, CORNER_FOLD, PLANAR_MOVE, PULL)


def surface_grid_m(tissue: Tissue, count: int = 25) -> Floats:
    """Rest places (count^2, 3) on the upper face where shapes are compared, x fastest."""
    x = np.linspace(-tissue.length_x_m / 2, tissue.length_x_m / 2, count)
    y = np.linspace(-tissue.width_y_m / 2, tissue.width_y_m / 2, count)
    return np.stack([np.tile(x, count), np.repeat(y, count), np.zeros(count**2)], axis=1)
