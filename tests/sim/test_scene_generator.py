"""The generator keeps its promises about counts, connection, hiding and being solvable."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.attachment_patches import patches
from defras_sim.scene import Scene
from defras_sim.scene_generator import SHARE, Relation, draw_actual, draw_believed, generate_scene


def mask_of(scene: Scene) -> np.ndarray:
    nx, ny = scene.hole_counts
    return scene.attached.reshape(ny, nx)


@pytest.mark.parametrize("relation", ["fewer", "more", "equal"])
def test_counts_keep_to_the_range_and_patches_stay_connected(relation: Relation) -> None:
    rng = np.random.default_rng(7)
    shares = []
    for number in range(40):
        believed = draw_believed(rng, name=f"draw{number}")
        actual = draw_actual(believed, relation, rng)
        assert 1 <= len(patches(mask_of(believed))) <= 4
        assert len(patches(mask_of(actual))) <= len(patches(mask_of(believed))) + 1
        shares.append(actual.attached.sum() / believed.attached.sum())
        assert actual.roi == believed.roi
    low, high = SHARE[relation]
    assert low <= min(shares)
    assert max(shares) <= high
    # The whole range is used.
    assert max(shares) - min(shares) >= 0.7 * (high - low)


def test_regions_lie_all_over_the_tissue() -> None:
    rng = np.random.default_rng(1)
    scenes = [draw_believed(rng, name="draw") for _ in range(40)]
    for axis in ("center_x_m", "center_y_m"):
        centers = [getattr(scene.roi, axis) for scene in scenes]
        assert min(centers) < -0.03
        assert max(centers) > 0.03
        assert max(np.abs(centers)) <= 0.045


def test_the_same_seed_draws_the_same() -> None:
    one, same, other = (
        draw_believed(np.random.default_rng(seed), name="draw") for seed in (5, 5, 6)
    )
    assert one == same
    assert one != other


def test_a_kept_scene_can_be_exposed_by_somebody_who_knows() -> None:
    heard: list[str] = []
    made = generate_scene(3, "more", layout="corner", tell=heard.append)
    assert heard[0].startswith("draw 1: ")
    assert "can be exposed; looking for what is really there" in heard[-1]
    assert made.believed.scene.attached.sum() < made.actual.scene.attached.sum()
    for solved in (made.believed, made.actual):
        solution = solved.solution
        assert solution.best_visibility >= solved.scene.thresholds.roi_visibility
        assert solution.force_max_n <= 0.3
