"""The bed under curved tissue: a potential that pushes only, and that resting tissue clears."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_sim.anatomy.anatomy import Anatomy
from defras_sim.tissue.bed import STIFFNESS_PA_PER_M
from defras_sim.tissue.curved_bed import CurvedBed, bed_under_anatomy
from defras_sim.tissue.layout import TangentLayout
from defras_sim.tissue.tetrahedral_mesh import TetrahedralMesh, tetrahedral_mesh


@pytest.fixture(scope="module")
def mesh(flap: Anatomy) -> TetrahedralMesh:
    return tetrahedral_mesh(flap.volume_mesh)


@pytest.fixture(scope="module")
def bed(flap: Anatomy, mesh: TetrahedralMesh) -> CurvedBed:
    return bed_under_anatomy(mesh, flap)


def pressed(mesh: TetrahedralMesh) -> np.ndarray:
    """Tissue pushed 0.8 mm down and shaken: some nodes are deep, some just touch, some hang."""
    noise = np.random.default_rng(1).normal(0, 3e-4, mesh.nodes_m.shape)
    return mesh.nodes_m + noise - [0, 0, 0.0008]


def test_resting_tissue_does_not_touch_it_but_nearly_does(flap, mesh, bed):
    assert bed.energy_and_gradient(mesh.nodes_m)[0] == 0.0
    gap_m = flap.lower.vertices_m[np.unique(flap.lower.triangles)]
    gap_m = gap_m[:, 2] - bed.ground.height_m(gap_m[:, :2])
    assert np.median(gap_m) < 0.0015
    assert np.all(gap_m > 0)


def test_the_gradient_is_that_of_the_energy(mesh, bed):
    x = pressed(mesh)
    way = np.random.default_rng(2).normal(0, 1, x.shape)
    step = 1e-7
    (up, _), (down, _) = (bed.energy_and_gradient(x + s * way) for s in (step, -step))
    assert np.sum(bed.energy_and_gradient(x)[1] * way) == pytest.approx(
        (up - down) / (2 * step), rel=1e-5
    )


def test_the_tangent_is_that_of_the_gradient_and_symmetric(mesh, bed):
    x = pressed(mesh)
    layout = TangentLayout.of(len(x), [bed.pairs])
    entries = np.zeros(layout.pattern.nnz)
    bed.add_tangent(x, layout.places(bed.pairs), entries)
    tangent = layout.matrix(entries)
    way = np.random.default_rng(3).normal(0, 1, x.shape)
    step = 1e-7
    up, down = (bed.energy_and_gradient(x + s * way)[1] for s in (step, -step))
    expected = ((up - down) / (2 * step)).ravel()
    found = tangent @ way.ravel()
    assert np.linalg.norm(found - expected) < 1e-4 * np.linalg.norm(expected)
    assert abs(tangent - tangent.T).max() < 1e-9 * abs(tangent).max()


def test_the_derivative_by_the_height_is_right(mesh, bed):
    x, step = pressed(mesh), 1e-7
    up, down = (replace(bed, height_m=h).energy_and_gradient(x)[1] for h in (step, -step))
    found = bed.gradient_by("height_m", x)
    np.testing.assert_allclose(found, (up - down) / (2 * step), atol=1e-4 * np.abs(found).max())
    with pytest.raises(ValueError, match="height_m"):
        bed.gradient_by("depth", x)


def test_it_only_pushes_and_goes_on_beyond_the_tissue(mesh, bed):
    push = -bed.energy_and_gradient(pressed(mesh))[1]
    assert push[:, 2].sum() > 0.1
    assert bed.deepest_m(pressed(mesh)) > 0.0008
    assert bed.deepest_m(mesh.nodes_m) == 0.0
    around = np.random.default_rng(4).uniform(-0.3, 0.3, (200, 2))
    assert np.all(np.isfinite(bed.ground.height_m(around)))
    assert np.all(np.abs(bed.ground.slope(around)) < 1.5)


def test_it_carries_what_lies_on_it_with_the_pressure_of_the_depth(mesh, bed):
    """Far below, all of the surface presses: its area is what the resultant grows with."""
    depth_m = 0.05
    down = mesh.nodes_m - [0, 0, depth_m]
    push = -bed.energy_and_gradient(down)[1].sum(axis=0)
    assert push[2] > 0
    further = -bed.energy_and_gradient(down - [0, 0, 0.001])[1].sum(axis=0)
    area_m2 = bed.boundary.areas_m2.sum()
    assert further[2] - push[2] == pytest.approx(STIFFNESS_PA_PER_M * area_m2 * 0.001, rel=1e-6)
