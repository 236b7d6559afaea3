"""The search on its own: same mesh, so that what it misses is its own fault."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.learning.cost import Cost, SearchSettings
from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.replay import NotRepeatable, Replay
from defras_bt.learning.search import AttachmentSearch
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.scene import Scene

MESH = (6, 6, 1)


@pytest.fixture(scope="module")
def frames(truth: Scene, record: Callable[[int], list[Keyframe]]) -> list[Keyframe]:
    """Two frames whose clouds come from the mesh of the search."""
    asked = record(1)[2::2]
    states = Replay(truth, asked, MESH).repeat(truth.hole_stiffness_n_per_m(truth.attached))
    rng = np.random.default_rng(0)
    return [
        Keyframe(
            frame.stamp_s,
            frame.grasp_tips,
            frame.tips,
            depth_cloud_m(truth.depth_camera, state.surface, RayCaster(state.surface), rng),
        )
        for frame, state in zip(asked, states, strict=True)
    ]


def searcher(belief: Scene, frames: list[Keyframe]) -> AttachmentSearch:
    replay = Replay(belief, frames, MESH)
    replay.repeat(belief.hole_stiffness_n_per_m(belief.attached))
    clouds = [frame.cloud_m for frame in frames]
    return AttachmentSearch(belief, replay, clouds, range(len(frames)), SearchSettings())


def test_a_missing_patch_is_found_where_it_is_pulled_at(
    truth: Scene, belief_without_patch: Scene, frames: list[Keyframe]
) -> None:
    belief = belief_without_patch
    search = searcher(belief, frames)
    found = search.run(belief.attached, rounds=8)
    patch = truth.attached & ~belief.attached
    changed = found.attached != belief.attached
    pulled_side = patch & (belief.holes_xy_m[:, 0] > 0.014)
    assert np.sum(changed & pulled_side) >= 2
    assert not np.any(changed & ~patch)
    # Nothing behind the pulled side shows, so fewer changes than the truth cost less.
    assert found.cost_after < search.cost(truth.attached)
    assert found.cost_after < 0.2 * found.cost_before
    assert found.probability[changed].min() > 0.5


def test_a_right_belief_costs_least(truth: Scene, frames: list[Keyframe]) -> None:
    found = searcher(truth, frames).run(truth.attached, rounds=8)
    np.testing.assert_array_equal(found.attached, truth.attached)


def test_a_start_without_a_shape_is_refused(truth: Scene, frames: list[Keyframe]) -> None:
    away = truth.depth_camera.model_copy(
        update={"position_m": (0.17, 5.0, 0.2), "target_m": (0.17, 9.0, 0.2)}
    )
    blind = truth.model_copy(update={"depth_camera": away})
    with pytest.raises(NotRepeatable, match="no visible shape"):
        searcher(blind, frames).run(truth.attached, rounds=1)


def test_changes_are_priced_by_hole_and_by_edge() -> None:
    believed = np.zeros(16, bool)
    cost = Cost(believed, (4, 4), SearchSettings(change_price=1.0, edge_price=0.1))
    block, scattered = believed.copy(), believed.copy()
    block[[5, 6, 9, 10]] = True
    scattered[[0, 3, 12, 15]] = True
    prices = cost.price(np.stack([believed, block, scattered]))
    np.testing.assert_allclose(prices, [0.0, 4.8, 4.8])
    inner = believed.copy()
    inner[[5, 10]] = True
    np.testing.assert_allclose(cost.price(inner[None]), 2.8)


def test_errors_count_squared_and_beyond_the_limit_linearly() -> None:
    settings = SearchSettings(error_m=0.001, robust_m=0.004)
    cost = Cost(np.zeros(4, bool), (2, 2), settings)
    residuals = np.array([[0.001], [0.004], [0.010]])
    np.testing.assert_allclose(cost.of([residuals], np.zeros((3, 4), bool)), [0.5, 8.0, 32.0])
