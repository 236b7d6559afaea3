"""Random patients: tissue of many sizes, its true attachments, and where the camera stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defras_sim.attachment_patches import LAYOUTS, Mask, draw, grow
from defras_sim.scene import Attachments, Camera, Roi, Scene, Simulation, Tissue
from defras_sim.scene_parts import MaterialName

ELEMENT_M = 0.015
"""Size of the elements of a slab's twin; those of its reality are a fifth smaller."""

_FINER = 1.25
_ANATOMY_SHARE = 0.07
_MATERIALS: tuple[MaterialName, ...] = ("neo_hookean", "stable_neo_hookean", "corotational")
_FEWEST_HELD = 6
_MOST_HELD = 0.4
"""Of all holes."""


def draw_tissue(anatomies: Sequence[Scene], rng: np.random.Generator) -> Scene:
    """A scene whose tissue is a slab of some size or, in one of 14 cases, an anatomy.

    What holds it and where the camera stands are those of :func:`draw_patient`.
    """
    if len(anatomies) and rng.random() < _ANATOMY_SHARE:
        return anatomies[int(rng.integers(len(anatomies)))]
    # Half of the slabs have the paper's size.
    sides_m = (0.12, 0.12) if rng.random() < 0.5 else 0.01 * rng.integers(8, 16, size=2)
    length_m, width_m = (round(float(side), 3) for side in sides_m)
    thickness_m = 0.005 if rng.random() < 0.4 else round(1e-3 * float(rng.integers(3, 9)), 4)
    twin, real = (
        (max(4, round(length_m / size_m)), max(4, round(width_m / size_m)), 1)
        for size_m in (ELEMENT_M, ELEMENT_M / _FINER)
    )
    tissue = Tissue(
        length_x_m=length_m,
        width_y_m=width_m,
        thickness_m=thickness_m,
        young_modulus_pa=round(float(np.exp(rng.uniform(np.log(1e3), np.log(2e4))))),
        poisson_ratio=round(float(rng.uniform(0.40, 0.48)), 3),
        material=_MATERIALS[rng.choice(3, p=(0.6, 0.25, 0.15))],
        elements_xyz=twin,
    )
    nothing = Attachments(map=("." * round(length_m / 0.01),) * round(width_m / 0.01))
    return Scene(
        name="slab",
        tissue=tissue,
        attachments=nothing,
        roi=Roi(center_x_m=0.0, center_y_m=0.0),
        simulation=Simulation(elements_xyz=real),
    )


def draw_patient(tissue: Scene, rng: np.random.Generator) -> Scene:
    """``tissue`` with connected patches of holes that hold, seen by a camera somewhere above."""
    nx, ny = tissue.hole_counts
    is_hole = tissue.is_hole
    for _ in range(100):
        held = draw(str(rng.choice(LAYOUTS)), (ny, nx), rng).ravel() & is_hole
        if _FEWEST_HELD <= held.sum() <= _MOST_HELD * is_hole.sum():
            break
    else:
        held = spread(tissue, rng.choice(np.flatnonzero(is_hole)), _FEWEST_HELD, rng)
    half_m = np.array([tissue.tissue.length_x_m, tissue.tissue.width_y_m]) / 4
    x_m, y_m = rng.uniform(-half_m, half_m)
    return tissue.with_attached(held).model_copy(
        update={
            "depth_camera": _camera(tissue, rng),
            "roi": Roi(center_x_m=float(x_m), center_y_m=float(y_m), radius_m=0.012),
        }
    )


def spread(tissue: Scene, first: int, count: int, rng: np.random.Generator) -> Mask:
    """A connected patch (holes,) of about ``count`` holes around the hole ``first``."""
    nx, ny = tissue.hole_counts
    seed = np.zeros(nx * ny, bool)
    seed[first] = True
    return np.asarray(grow(seed.reshape(ny, nx), count - 1, rng).ravel() & tissue.is_hole)


def _camera(scene: Scene, rng: np.random.Generator) -> Camera:
    """In half of the cases near where scenes have it, else anywhere around at 35 to 75 degrees."""
    usual = scene.depth_camera
    offset_m = np.subtract(usual.position_m, usual.target_m)
    distance_m = float(np.linalg.norm(offset_m)) * float(rng.uniform(0.95, 1.3))
    if rng.random() < 0.5:
        azimuth, elevation = rng.normal(0.0, 0.15), np.deg2rad(50) + rng.normal(0.0, 0.08)
    else:
        azimuth, elevation = rng.uniform(-np.pi, np.pi), np.deg2rad(rng.uniform(35, 75))
    scale = max(1.0, max(scene.tissue.length_x_m, scene.tissue.width_y_m) / 0.12)
    if scene.tissue.anatomy is None:  # scenes from meshes have their camera farther away already
        distance_m *= scale
    away = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    target_m = np.array(usual.target_m) + rng.normal(0.0, 0.004, 3)
    return usual.model_copy(
        update={
            "position_m": tuple(np.round(target_m + distance_m * away, 4).tolist()),
            "target_m": tuple(np.round(target_m, 4).tolist()),
            "noise_sd_m": round(float(rng.uniform(0.0002, 0.001)), 5),
        }
    )
