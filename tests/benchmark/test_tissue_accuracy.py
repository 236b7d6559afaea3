"""The default twin against the converged solution, which felupe holds in equilibrium."""

import numpy as np
import pytest

from defras_bt.benchmark.felupe_slab import FelupeSlab
from defras_bt.benchmark.tissue import FORCE_N, FORCE_SHARE, OWN, follow
from defras_bt.benchmark.tissue_models import OwnTissue
from defras_bt.benchmark.tissue_motions import CHECKPOINT_M, MOTIONS, PULL, surface_grid_m
from defras_bt.benchmark.tissue_reference import MATERIALS, RESIDUAL_N, reference

BY_NAME = {motion.name: motion for motion in MOTIONS}


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("name", BY_NAME)
def test_force_and_shape_of_the_default_twin_are_right_at_every_checkpoint(name, material):
    motion = BY_NAME[name]
    case = follow(
        OWN,
        lambda: OwnTissue(motion, material),
        motion,
        material,
        CHECKPOINT_M,
        motion.length_m,
    )
    assert case.fault == ""
    assert len(case.force_error) == len(reference(name, material).moved_m)
    assert case.force_error.max() <= 1.0
    assert case.shape_median_m.max() <= 0.0005
    assert case.shape_p95_m.max() <= 0.002


def test_what_is_allowed_is_what_was_promised():
    assert (FORCE_SHARE, FORCE_N) == (0.05, 0.005)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("name", BY_NAME)
def test_the_reference_is_whole_and_in_equilibrium(name, material):
    motion, right = BY_NAME[name], reference(name, material)
    ways = [tip.position_m - motion.start.position_m for tip in motion.tips(CHECKPOINT_M)]
    np.testing.assert_allclose(right.moved_m, ways, atol=1e-12)
    assert right.surfaces_m.shape == (len(ways), 625, 3)
    assert right.residuals_n.max() <= RESIDUAL_N
    # The disc at the jaw went with it.
    away = np.linalg.norm(surface_grid_m(motion.scene().tissue) - motion.start.position_m, axis=1)
    nearest = int(np.argmin(away))
    rest = surface_grid_m(motion.scene().tissue)[nearest]
    went = right.surfaces_m[:, nearest] - rest
    assert np.linalg.norm(went - right.moved_m, axis=1).max() < 0.002 + 2 * away[nearest]


@pytest.mark.parametrize("material", MATERIALS)
def test_felupe_on_a_coarse_mesh_has_a_consistent_tangent(material):
    slab = FelupeSlab(PULL.scene(), material, "hexahedron27", (3, 3, 1), np.array(PULL.grasp_xy_m))
    rng = np.random.default_rng(0)
    slab.move_tip_to(np.array([0.0, 0.001, 0.004]))
    x = slab.nodes_m + rng.normal(0, 3e-4, slab.nodes_m.shape)
    step = rng.normal(0, 1e-8, x.shape)
    slab.place(x)
    slab.residual_n()
    expected = 2 * (slab.tangent() @ step.ravel())
    found = []
    for there in (x + step, x - step):
        slab.place(there)
        found.append(slab.residual_n())
    np.testing.assert_allclose(found[0] - found[1], expected, atol=1e-6 * np.abs(expected).max())
