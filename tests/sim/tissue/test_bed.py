from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.bed import ONSET_M, STIFFNESS_PA_PER_M, Bed, bed_under
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.model import TissueModel

MOST_DEPTH_M = 2e-4


def slab(element="hexahedron20", cells=(3, 2, 1)):
    return slab_mesh(Tissue(), element, cells)


@pytest.mark.parametrize("depth_m", [-1e-3, 0.3 * ONSET_M, 1.2 * ONSET_M, 10 * ONSET_M])
@pytest.mark.parametrize("element", ["hexahedron20", "tetrahedron4"])
def test_gradient_and_tangent_are_slopes_at_every_depth(depth_m, element):
    mesh = slab(element)
    bed = bed_under(mesh, Tissue())
    rng = np.random.default_rng(0)
    x = mesh.nodes_m - [0, 0, bed.height_m - mesh.nodes_m[:, 2].min() + depth_m]
    x = x + rng.normal(0, 0.2 * ONSET_M, x.shape)
    step = rng.normal(size=x.shape)
    energy = PotentialEnergy(len(x), [bed])
    (up, up_slope), (down, down_slope) = (
        energy.energy_and_gradient(x + 1e-8 * sign * step) for sign in (1, -1)
    )
    _, slope = energy.energy_and_gradient(x)
    scale = max(np.abs(slope).max(), 1e-6)
    assert np.sum(slope * step) == pytest.approx((up - down) / 2e-8, abs=1e-5 * scale)
    expected = (up_slope - down_slope).ravel() / 2e-8
    tangent = energy.tangent(x)
    assert abs(tangent - tangent.T).max() <= 1e-12 * abs(tangent).max()
    stiffest = max(np.abs(expected).max(), 1.0)
    np.testing.assert_allclose(tangent @ step.ravel(), expected, atol=1e-3 * stiffest)
    by_height = bed.gradient_by("height_m", x)
    raised, lowered = (
        replace(bed, height_m=bed.height_m + 1e-8 * sign).energy_and_gradient(x)[1]
        for sign in (1, -1)
    )
    np.testing.assert_allclose(by_height, (raised - lowered) / 2e-8, atol=1e-3 * stiffest)


@pytest.mark.parametrize(
    ("element", "cells"),
    [
        ("hexahedron20", (2, 2, 1)),
        ("hexahedron20", (5, 7, 2)),
        ("tetrahedron4", (4, 4, 1)),
        ("tetrahedron4", (9, 6, 2)),
    ],
)
def test_force_of_a_pressed_slab_does_not_depend_on_the_mesh(element, cells):
    mesh = slab(element, cells)
    bed = bed_under(mesh, Tissue())
    depth_m = 3 * ONSET_M
    lowered = mesh.nodes_m - [0, 0, depth_m + mesh.nodes_m[:, 2].min() - bed.height_m]
    _, gradient = bed.energy_and_gradient(lowered)
    face_m2 = Tissue().length_x_m * Tissue().width_y_m
    expected_n = STIFFNESS_PA_PER_M * face_m2 * (depth_m - ONSET_M / 2)
    # The narrow sides dip in, too, with their lowest points.
    assert -gradient[:, 2].sum() == pytest.approx(expected_n, rel=0.05)
    moment = np.cross(lowered, gradient).sum(axis=0)[:2]
    np.testing.assert_allclose(moment, 0, atol=1e-3 * expected_n * Tissue().length_x_m)


def test_the_slab_rests_without_touching():
    mesh = slab()
    bed = bed_under(mesh, Tissue())
    energy, gradient = bed.energy_and_gradient(mesh.nodes_m)
    assert energy == 0
    assert np.all(gradient == 0)
    assert bed.deepest_m(mesh.nodes_m) == 0


def test_a_bed_that_moves_couples_the_same_pairs():
    bed = bed_under(slab(), Tissue())
    assert replace(bed, height_m=-0.004).pairs is bed.pairs


ROI = Roi(center_x_m=0.0, center_y_m=0.0)


def side_scene() -> Scene:
    """The holes of the two columns at the smallest x hold."""
    return Scene(name="side", attachments=Attachments(map=("##..........",) * 12), roi=ROI)


def over() -> list[Pose]:
    """A half turn about the y axis through the origin, from x = 45 mm to -45 mm."""
    return [
        Pose(
            0.045 * np.array([np.cos(a), 0.0, np.sin(a)]),
            Rotation.from_rotvec([0, -a, 0]).as_matrix(),
        )
        for a in np.linspace(0, np.pi, 19)[1:]
    ]


def straight(*goals: tuple[float, float, float]) -> list[Pose]:
    return [Pose(np.array(goal)) for goal in goals]


@pytest.mark.parametrize(
    ("material", "ways"),
    [
        ("neo_hookean", over()),
        ("corotational", over()),
        ("neo_hookean", straight((0.045, 0, 0.02), (0.045, 0.03, 0.02), (0, 0, 0.02))),
        ("neo_hookean", straight((0.045, 0, -0.001))),
        ("corotational", straight((0.045, 0, 0.04), (0, 0, 0.04), (0, 0, 0.01), (0, 0, 0.002))),
    ],
)
def test_tissue_stays_off_the_bed_between_its_nodes_too(material, ways):
    """Looked at on a grid that is finer than what the bed feels, on both faces.

    Not over attached holes: they hold a disc by its mean, whatever the disc's middle does.
    """
    tissue = TissueModel(side_scene(), elements_xyz=(8, 8, 1), material=material)
    grid = np.linspace(-0.06, 0.06, 65)
    xy = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    free = xy[xy[:, 0] > -0.035]
    faces = [
        tissue.mesh.interpolation(np.column_stack([part, np.full(len(part), z)]))
        for part, z in ((free, -0.005), (xy, 0.0))
    ]
    bed = tissue.terms["bed"]
    assert isinstance(bed, Bed)
    tissue.grasp("psm1", Pose(np.array([0.045, 0.0, 0.0])))
    for tip in ways:
        state = tissue.solve({"psm1": tip})
        assert state.converged
        for face in faces:
            assert (face @ state.nodes_m)[:, 2].min() > bed.height_m - MOST_DEPTH_M


@pytest.mark.parametrize("bulge_m", [1e-3, 4e-3, 0.02])
def test_a_face_that_bulges_deep_below_its_nodes_touches_without_a_jump(bulge_m):
    """Strongly stretched elements do; contact that set in late would have no equilibrium."""
    mesh = slab("hexahedron20", (1, 1, 1))
    bed = bed_under(mesh, Tissue())
    x = mesh.nodes_m.copy()
    lower = np.isclose(x[:, 2], x[:, 2].min())
    corners = lower & (np.abs(x[:, :2]).min(axis=1) > 0.01)
    # In the middle the mid-side nodes count half each, the corners a quarter, negatively.
    x[corners, 2] += 4 * bulge_m
    x[lower & ~corners, 2] += bulge_m
    heights_m = np.linspace(bed.height_m - bulge_m, bed.height_m + 2 * bulge_m, 4000)
    forces_n = np.array(
        [replace(bed, height_m=z).energy_and_gradient(x)[1][:, 2].sum() for z in heights_m]
    )
    stiffest = STIFFNESS_PA_PER_M * bed.boundary.areas_m2.sum()
    assert np.abs(np.diff(forces_n)).max() <= 1.01 * stiffest * (heights_m[1] - heights_m[0])
    assert np.ptp(forces_n) > 0
