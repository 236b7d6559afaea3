import numpy as np
import pytest

from defras_sim.geometry import Pose
from defras_sim.scene import Attachments, Roi, Scene, Tissue
from defras_sim.tissue.bed import ONSET_M, Bed, bed_under
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.model import TissueModel


def test_gradient_and_tangent_are_slopes_at_every_depth():
    bed = Bed(0.0, np.full(1, 300.0))
    for depth in (-1e-3, 0.3 * ONSET_M, 0.9 * ONSET_M, 1.5 * ONSET_M, 10 * ONSET_M):
        x = np.array([[0.01, 0.02, -depth]])
        step = np.array([[0.0, 0.0, 1e-9]])
        (up, up_slope), (down, down_slope) = (bed.energy_and_gradient(x + s) for s in (step, -step))
        _, slope = bed.energy_and_gradient(x)
        assert slope[0, 2] == pytest.approx((up - down) / 2e-9, abs=1e-6)
        expected = (up_slope - down_slope)[0, 2] / 2e-9
        tangent = PotentialEnergy(1, [bed]).tangent(x).toarray()
        assert tangent[2, 2] == pytest.approx(expected, abs=1e-3)
        raised = [Bed(h, np.full(1, 300.0)).energy_and_gradient(x)[1] for h in (1e-9, -1e-9)]
        by_height = (raised[0] - raised[1]) / 2e-9
        np.testing.assert_allclose(bed.gradient_by("height_m", x), by_height, atol=1e-3)


def test_the_slab_rests_without_touching():
    mesh = slab_mesh(Tissue(), "hexahedron20", (4, 4, 1))
    energy, gradient = bed_under(mesh, Tissue()).energy_and_gradient(mesh.nodes_m)
    assert energy == 0
    assert np.all(gradient == 0)


def test_pressed_tissue_stays_near_the_bed():
    roi = Roi(center_x_m=0.0, center_y_m=0.0)
    attachments = Attachments(map=("##..........",) * 12)
    lowest = {}
    for bed in (True, False):
        scene = Scene(name="side", attachments=attachments, roi=roi, tissue=Tissue(bed=bed))
        tissue = TissueModel(scene, elements_xyz=(6, 6, 1))
        tip = Pose(np.array([0.03, 0.0, 0.0]))
        tissue.grasp("psm1", tip)
        state = tissue.solve({"psm1": tip.moved(np.array([0.0, 0.0, -0.003]))})
        assert state.converged
        lowest[bed] = state.nodes_m[:, 2].min()
    assert lowest[True] > lowest[False] + 0.0005
