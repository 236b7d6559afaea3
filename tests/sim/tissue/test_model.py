import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_sim.geometry import Pose
from defras_sim.scene import RIGID_HOLE_N_PER_M, Attachments, Roi, Scene, Tissue
from defras_sim.tissue.grasp import NothingToGrasp
from defras_sim.tissue.model import TissueModel


def side_scene(columns: int = 2) -> Scene:
    """The outer ``columns`` of holes at the smallest x hold; no bed shares the load."""
    row = "#" * columns + "." * (12 - columns)
    roi = Roi(center_x_m=0.0, center_y_m=0.0)
    return Scene(
        name="side",
        attachments=Attachments(map=(row,) * 12),
        roi=roi,
        tissue=Tissue(bed=False),
    )


def at(x: float, y: float, z: float, turn=(0.0, 0.0, 0.0)) -> Pose:
    return Pose(np.array([x, y, z]), Rotation.from_rotvec(turn).as_matrix())


def model(**options) -> TissueModel:
    return TissueModel(side_scene(), **{"elements_xyz": (6, 6, 1), **options})


def retract(tissue: TissueModel, *tips: Pose):
    """Grasp at the first pose and go through all of them; the last state."""
    tissue.grasp("psm1", tips[0])
    for tip in tips:
        state = tissue.solve({"psm1": tip})
        assert state.converged
    return state


GRASP = at(0.045, 0.01, 0.0)
LIFTED = at(0.045, 0.01, 0.03)
FOLDED = at(0.005, 0.01, 0.04)


def test_untouched_tissue_is_at_rest():
    state = model().solve({})
    assert state.converged
    assert state.strain_energy_j == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(state.attachment_forces_n, 0, atol=1e-12)


@pytest.mark.parametrize(
    ("element", "material"),
    [
        ("hexahedron20", "neo_hookean"),
        ("hexahedron20", "corotational"),
        ("tetrahedron4", "stable_neo_hookean"),
    ],
)
def test_grasp_balances_the_attachments_in_force_and_moment(element, material):
    tissue = model(element=element, material=material, residual_share=1e-8)
    state = retract(tissue, GRASP, LIFTED, FOLDED)
    force, moment = state.grasp_forces_n["psm1"], state.grasp_moments_nm["psm1"]
    assert np.linalg.norm(force) > 0.005
    np.testing.assert_allclose(force, -state.attachment_forces_n.sum(axis=0), atol=1e-8)
    about_origin = moment + np.cross(FOLDED.position_m, force)
    # The solver stops at a residual of some 1e-7 N, which acts over a few centimetres.
    at_holes = state.wrenches["attachments"].moment_nm
    np.testing.assert_allclose(about_origin, -at_holes, atol=3e-8)
    np.testing.assert_allclose(about_origin, state.wrenches["grasp of psm1"].moment_nm, atol=1e-12)


def test_the_grasped_patch_moves_rigidly_with_the_tip():
    tissue = model()
    turned = at(0.05, 0.0, 0.03, turn=(0.2, -0.6, 0.3))
    retract(tissue, GRASP, LIFTED, turned)
    grasp = tissue.snapshot().grasps["psm1"]
    held = grasp.term("psm1").pulls(tissue.snapshot().positions_m).held_m
    np.testing.assert_allclose(held, grasp.targets_m, atol=5e-5)
    at_rest = grasp.springs.rows @ tissue.mesh.nodes_m
    relative = turned.rotation @ GRASP.rotation.T
    np.testing.assert_allclose(held[1:], at_rest[1:] @ relative.T, atol=5e-5)


def test_no_force_at_the_moment_of_grasping():
    state = retract(model(), at(0.045, 0.01, 0.004))
    np.testing.assert_allclose(state.grasp_forces_n["psm1"], 0, atol=1e-9)


def test_the_nearest_patch_is_taken_in_the_deformed_state():
    tissue = model()
    retract(tissue, GRASP, LIFTED, FOLDED)
    surface = tissue.solve({"psm1": FOLDED}).surface
    target = surface.vertices_m[surface.upper][25 * 18 + 10]
    tissue.grasp("psm2", Pose(target + [0.0, 0.0, 0.001]))
    held = tissue.snapshot().grasps["psm2"].springs.rows @ tissue.snapshot().positions_m
    assert np.linalg.norm(held[0] - target) < 0.002


def test_a_tip_away_from_the_tissue_grasps_nothing():
    with pytest.raises(NothingToGrasp, match=r"12\.0 mm"):
        model().grasp("psm1", at(0.0, 0.0, 0.012))


def test_release_returns_to_rest():
    tissue = model()
    retract(tissue, GRASP, LIFTED, FOLDED)
    tissue.release("psm1")
    state = tissue.solve({})
    np.testing.assert_allclose(state.nodes_m, tissue.mesh.nodes_m, atol=1e-9)
    assert tissue.grasped_arms == ()


def test_two_arms_hold_and_one_lets_go():
    tissue = model(residual_share=1e-8)
    first, second = at(0.045, 0.03, 0.0), at(0.045, -0.03, 0.0)
    tissue.grasp("psm1", first)
    tissue.grasp("psm2", second)
    lift = np.array([-0.01, 0.0, 0.03])
    both = tissue.solve({"psm1": first.moved(lift), "psm2": second.moved(lift)})
    assert both.converged
    total = sum(both.grasp_forces_n.values())
    np.testing.assert_allclose(total, -both.attachment_forces_n.sum(axis=0), atol=1e-8)
    tissue.release("psm2")
    one = tissue.solve({"psm1": first.moved(lift)})
    assert one.converged
    alone = model()
    alone.grasp("psm1", first)
    expected = alone.solve({"psm1": first.moved(lift)})
    np.testing.assert_allclose(one.nodes_m, expected.nodes_m, atol=5e-4)


def test_snapshot_and_restore_go_back_exactly():
    tissue = model()
    before = retract(tissue, GRASP, LIFTED)
    kept = tissue.snapshot()
    tissue.solve({"psm1": FOLDED})
    tissue.release("psm1")
    tissue.restore(kept)
    again = tissue.solve({"psm1": LIFTED})
    assert tissue.grasped_arms == ("psm1",)
    np.testing.assert_allclose(again.nodes_m, before.nodes_m, atol=1e-6)


def test_reset_gives_the_rest_shape():
    tissue = model()
    retract(tissue, GRASP, LIFTED)
    tissue.reset()
    np.testing.assert_array_equal(tissue.solve({}).nodes_m, tissue.mesh.nodes_m)


def test_the_way_does_not_matter_while_there_is_one_equilibrium():
    direct = retract(model(residual_share=1e-6), GRASP, LIFTED)
    around = retract(
        model(residual_share=1e-6), GRASP, at(0.05, -0.005, 0.02), at(0.04, 0.0, 0.035), LIFTED
    )
    np.testing.assert_allclose(direct.nodes_m, around.nodes_m, atol=1e-5)


def test_fold_over_by_sixty_millimetres():
    tissue = model()
    lifted = at(0.05, 0.0, 0.04)
    state = retract(tissue, at(0.05, 0.0, 0.0), lifted, at(-0.01, 0.0, 0.04))
    uppermost = state.surface.vertices_m[state.surface.upper]
    assert uppermost[:, 2].max() > 0.035
    # The free edge hangs behind the tip: the surface there faces down.
    assert state.strain_energy_j > 0


def test_refining_the_mesh_changes_neither_attachments_nor_patch():
    """Shape and force of a lift converge: what is held does not depend on where nodes lie."""
    states = [
        retract(model(elements_xyz=cells), GRASP, LIFTED)
        for cells in ((6, 6, 1), (8, 8, 1), (11, 11, 1))
    ]
    coarse, middle, fine = (state.surface.vertices_m for state in states)
    distances = [np.linalg.norm(shape - fine, axis=1) for shape in (coarse, middle)]
    assert distances[1].mean() < distances[0].mean() < 1e-3
    assert distances[1].max() < 2e-3
    forces = [np.linalg.norm(state.grasp_forces_n["psm1"]) for state in states]
    np.testing.assert_allclose(forces[:2], forces[2], rtol=0.15)


def test_softer_holes_give_way():
    tissue = model()
    rigid = retract(tissue, GRASP, LIFTED)
    stiffness = tissue.hole_stiffness_n_per_m
    np.testing.assert_array_equal(stiffness > 0, tissue.scene.attached)
    assert stiffness.max() == RIGID_HOLE_N_PER_M
    tissue.set_hole_stiffness(stiffness * 1e-4)
    soft = tissue.solve({"psm1": LIFTED})
    assert soft.converged
    assert np.linalg.norm(soft.grasp_forces_n["psm1"]) < np.linalg.norm(
        rigid.grasp_forces_n["psm1"]
    )


def test_a_scene_says_how_firmly_its_holes_hold():
    scene = side_scene()
    soft = scene.attachments.model_copy(update={"stiffness_n_per_m": 25.0})
    scene = scene.model_copy(update={"attachments": soft})
    tissue = TissueModel(scene, elements_xyz=(6, 6, 1))
    expected = np.where(scene.attached, 25.0, 0.0)
    np.testing.assert_array_equal(tissue.hole_stiffness_n_per_m, expected)
    np.testing.assert_array_equal(scene.hole_stiffness_n_per_m(~scene.attached), 25.0 - expected)
    state = retract(tissue, GRASP, LIFTED)
    # Each hole pulls with its stiffness times how far the tissue over it was pulled away.
    holes = tissue.terms["attachments"]
    moved = (holes.pulls(state.nodes_m).held_m - holes.targets_m)[::3]
    np.testing.assert_allclose(state.attachment_forces_n, -expected[:, None] * moved, atol=1e-12)
    assert np.abs(moved[scene.attached]).max() > 1e-4


def test_a_hole_that_suddenly_holds_lifted_tissue_is_solved_from_rest():
    tissue = model()
    retract(tissue, GRASP, LIFTED)
    stiffness = tissue.hole_stiffness_n_per_m
    stiffness[12 * 5 + 7] = RIGID_HOLE_N_PER_M  # now 15 mm below the tissue it shall hold
    tissue.set_hole_stiffness(stiffness)
    state = tissue.solve({"psm1": LIFTED})
    assert state.converged
    other = model()
    other.set_hole_stiffness(stiffness)
    expected = retract(other, GRASP, LIFTED)
    np.testing.assert_allclose(state.nodes_m, expected.nodes_m, atol=2e-4)


def test_a_patch_taken_while_deformed_knows_where_it_rests():
    tissue = model()
    retract(tissue, GRASP, LIFTED, FOLDED)
    surface = tissue.solve({"psm1": FOLDED}).surface
    taken = Pose(surface.vertices_m[surface.upper][25 * 18 + 10])
    tissue.grasp("psm2", taken)
    rest_tip = tissue.snapshot().grasps["psm2"].unloaded_tip(tissue.rest_m)
    np.testing.assert_allclose(rest_tip.position_m, [-0.01, 0.03, 0.0], atol=1e-3)


def test_response_to_hole_forces_predicts_what_stiffer_holes_do():
    """A hole that holds a little more firmly pulls a little more where it is stretched."""
    tissue = model(residual_share=1e-10)
    stiffness = np.where(tissue.scene.attached, 60.0, 0.0)
    tissue.set_hole_stiffness(stiffness)
    retract(tissue, GRASP, LIFTED)
    holes = np.array([1, 13, 62, 66])  # two attached, two free
    response = tissue.response_to_hole_forces(holes)
    for place, hole in enumerate(holes):
        slope = -response.surface_m_per_n[:, :, place] @ response.stretch_m[place]
        moved = []
        for change in (0.0, 0.005):
            changed = stiffness.copy()
            changed[hole] += change
            tissue.set_hole_stiffness(changed)
            moved.append(tissue.solve({"psm1": LIFTED}).surface.vertices_m)
        difference = (moved[1] - moved[0]) / 0.005
        assert np.linalg.norm(slope - difference) < 0.01 * np.linalg.norm(difference), hole


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("material", ["neo_hookean", "corotational", "stable_neo_hookean"])
def test_random_tool_paths_never_give_nan(seed, material):
    rng = np.random.default_rng(seed)
    tissue = TissueModel(side_scene(1 + seed), elements_xyz=(4, 4, 1), material=material)
    tip = at(*rng.uniform(-0.05, 0.05, 2), 0.0)
    tissue.grasp("psm1", tip)
    for _ in range(5):
        turn = rng.normal(0, 0.25, 3)
        goal = np.array([*rng.uniform(-0.06, 0.06, 2), rng.uniform(-0.01, 0.06)])
        tip = Pose(goal, Rotation.from_rotvec(turn).as_matrix() @ tip.rotation)
        state = tissue.solve({"psm1": tip})
        assert np.all(np.isfinite(state.nodes_m))
        assert np.all(np.isfinite(state.grasp_forces_n["psm1"]))
        assert np.isfinite(state.largest_principal_stress_pa)
    tissue.release("psm1")
    np.testing.assert_allclose(tissue.solve({}).nodes_m, tissue.mesh.nodes_m, atol=1e-9)


def test_an_impossible_pull_returns_the_last_good_state():
    tissue = model()
    good = retract(tissue, GRASP, LIFTED)
    stale = tissue.solve({"psm1": at(1e4, 0.0, 0.0)})
    assert not stale.converged
    assert np.all(np.isfinite(stale.nodes_m))
    assert np.abs(stale.nodes_m).max() < 1e4
    assert good.converged


def test_misuse_is_told():
    tissue = model()
    with pytest.raises(ValueError, match="held by"):
        tissue.solve({"psm1": GRASP})
    with pytest.raises(ValueError, match="holds no tissue"):
        tissue.release("psm1")
    with pytest.raises(ValueError, match="144 holes"):
        tissue.set_hole_stiffness(np.ones(3))
    with pytest.raises(ValueError, match="at least 0"):
        tissue.set_hole_stiffness(np.full(144, -1.0))
    tissue.grasp("psm1", GRASP)
    with pytest.raises(ValueError, match="already"):
        tissue.grasp("psm1", GRASP)
    with pytest.raises(ValueError, match="not finite"):
        tissue.solve({"psm1": at(np.nan, 0.0, 0.0)})
