"""Patches stay connected whatever is done to them, and counts are kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from defras_sim.attachment_patches import LAYOUTS, draw, grow, patches, resized, shrink

SEEDS = st.integers(0, 2**32 - 1)


def lone_holes(mask: np.ndarray) -> int:
    """Holes without a neighbour along x or y."""
    padded = np.pad(mask, 1)
    beside = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
    return int(np.sum(mask & ~beside))


@given(SEEDS, st.sampled_from(LAYOUTS))
@settings(max_examples=60, deadline=None)
def test_drawn_patches_are_few_and_coherent(seed: int, layout: str) -> None:
    mask = draw(layout, (12, 12), np.random.default_rng(seed))
    assert mask.shape == (12, 12)
    assert 1 <= len(patches(mask)) <= 4
    assert lone_holes(mask) == 0
    assert np.array_equal(mask, draw(layout, (12, 12), np.random.default_rng(seed)))


@given(SEEDS, st.integers(1, 30))
@settings(max_examples=40, deadline=None)
def test_growing_adds_neighbours_only(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    mask = draw("islands", (12, 12), rng)
    grown = grow(mask, count, rng)
    assert grown.sum() == mask.sum() + count
    assert np.all(grown[mask])
    # Every patch of the grown mask holds at least one of the old ones.
    numbered, number = label(grown)
    assert set(numbered[mask]) == set(range(1, number + 1))


@given(SEEDS, st.integers(1, 8))
@settings(max_examples=40, deadline=None)
def test_shrinking_never_cuts_a_patch_in_two(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    mask = draw("line", (12, 12), rng)
    shrunk = shrink(mask, count, rng)
    assert shrunk.sum() == mask.sum() - count
    assert np.all(mask[shrunk])
    for patch in patches(mask):
        assert label(shrunk & patch)[1] <= 1


def test_the_last_hole_stays() -> None:
    mask = np.zeros((3, 3), bool)
    mask[1, 1] = True
    assert shrink(mask, 5, np.random.default_rng(0)).sum() == 1


@given(SEEDS, st.sampled_from(LAYOUTS), st.floats(0.2, 1.6))
@settings(max_examples=60, deadline=None)
def test_resizing_meets_the_count_and_leaves_no_scattered_holes(
    seed: int, layout: str, share: float
) -> None:
    rng = np.random.default_rng(seed)
    mask = draw(layout, (12, 12), rng)
    holes = max(1, round(share * mask.sum()))
    changed = resized(mask, holes, rng)
    assert changed.sum() == holes
    assert len(patches(changed)) <= len(patches(mask)) + 1


def test_unknown_layout_is_told_with_the_valid_ones() -> None:
    with pytest.raises(ValueError, match="valid: side, two_sides"):
        draw("star", (12, 12), np.random.default_rng(0))
