import numpy as np
from scipy.spatial.transform import Rotation

from defras_sim.scene import Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.curvature import Curvature
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import slab_mesh
from defras_sim.tissue.turning import node_rotations, turned


def energy(cells=(4, 4, 1)):
    mesh = slab_mesh(Tissue(), "hexahedron20", cells)
    body = ElasticBody(mesh, "neo_hookean", *lame_parameters("neo_hookean", 3000.0, 0.45))
    return PotentialEnergy(len(mesh.nodes_m), [body]), mesh.nodes_m


TURN = Rotation.from_rotvec([0.3, -1.1, 0.4]).as_matrix()


def test_a_fresh_factor_gives_newtons_step():
    total, x = energy()
    tangent = total.tangent(x)
    curvature = Curvature(x)
    curvature.factorise(tangent, x, 0.5)
    gradient = np.random.default_rng(0).normal(size=x.shape)
    step = curvature.newton_step(gradient)
    expected = (tangent @ step.ravel() + 0.5 * step.ravel()).reshape(x.shape)
    np.testing.assert_allclose(expected, -gradient, atol=1e-9)


def test_tissue_that_only_turned_keeps_its_factor():
    """The step from a turned shape is the turned step, as if factorised there."""
    total, x = energy()
    curvature = Curvature(x)
    curvature.factorise(total.tangent(x), x, 0.5)
    there = x @ TURN.T + [0.1, 0.0, -0.2]
    curvature.look_from(there)
    gradient = np.random.default_rng(0).normal(size=x.shape)
    step = curvature.newton_step(gradient)
    anew = Curvature(x)
    anew.factorise(total.tangent(there), there, 0.5)
    np.testing.assert_allclose(step, anew.newton_step(gradient), rtol=1e-6, atol=1e-9)


def test_what_gradients_show_corrects_the_factor():
    """The secant equation: H applied to the last change of the gradient is the last step."""
    total, x = energy()
    curvature = Curvature(x)
    curvature.factorise(total.tangent(x), x, 2.0)
    rng = np.random.default_rng(0)
    for _ in range(3):
        step = 1e-3 * rng.normal(size=x.shape)
        change = (total.tangent(x) @ step.ravel()).reshape(x.shape) * 1.3
        curvature.learn(step, change)
        np.testing.assert_allclose(-curvature.newton_step(change), step, atol=1e-12)


def test_a_step_along_which_the_energy_bends_down_teaches_nothing():
    total, x = energy()
    curvature = Curvature(x)
    curvature.factorise(total.tangent(x), x, 2.0)
    gradient = np.random.default_rng(0).normal(size=x.shape)
    before = curvature.newton_step(gradient)
    curvature.learn(gradient, -gradient)
    np.testing.assert_array_equal(curvature.newton_step(gradient), before)


def test_rotations_are_found_node_by_node():
    _, x = energy()
    starts = np.arange(len(x) + 1) * len(x)
    everyone = np.tile(np.arange(len(x)), len(x))
    rotations = node_rotations(starts, everyone, x, x @ TURN.T + 0.3)
    np.testing.assert_allclose(rotations, np.tile(TURN, (len(x), 1, 1)), atol=1e-10)
    np.testing.assert_allclose(turned(rotations, x, False), x @ TURN.T, atol=1e-12)
    np.testing.assert_allclose(turned(rotations, turned(rotations, x, False), True), x, atol=1e-12)
