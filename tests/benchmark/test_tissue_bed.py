"""What the benchmark says about tissue over a bed."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.benchmark.tissue_bed import FOLD, OverBed, bed_row, over_bed, tips
from defras_bt.benchmark.tissue_motions import CENTRE_LIFT, Motion


def test_a_fold_ends_upside_down_and_far_from_where_it_began():
    way = tips(FOLD)
    turned = [tip.rotation @ [0.0, 0.0, 1.0] for tip in way]
    np.testing.assert_allclose(turned[0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(turned[-1], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(
        way[-1].position_m - FOLD.start.position_m, FOLD.way_m[-1], atol=1e-12
    )
    steps_m = np.linalg.norm(np.diff([tip.position_m for tip in way], axis=0), axis=1)
    assert steps_m.max() <= 1e-3 + 1e-12


def test_tissue_pushed_down_presses_into_the_bed_and_lifted_tissue_less():
    down = Motion("down", "Down", CENTRE_LIFT.attached, (0.0, 0.0), ((0, 0, -0.001),))
    up = Motion("up", "Up", CENTRE_LIFT.attached, (0.0, 0.0), ((0, 0, 0.003),))
    pressed, lifted = over_bed(down, "neo_hookean"), over_bed(up, "neo_hookean")
    assert len(lifted.frames_s) == len(lifted.depth_m) == 3
    # The jaw holds tissue that is 5 mm thick: what it takes down goes into the bed.
    assert pressed.depth_m.max() > 3 * lifted.depth_m.max()
    assert lifted.depth_m.max() < 2e-4


def test_all_motions_together():
    runs = [
        OverBed(CENTRE_LIFT, "neo_hookean", np.full(3, t), np.full(3, t), np.full(3, d), stale)
        for t, d, stale in ((0.01, 1e-4, 0), (0.03, 2e-4, 2))
    ]
    row = bed_row(runs)
    assert (row["frames"], row["stale"]) == (6, 2)
    assert row["frame median ms"] == pytest.approx(20.0)
    assert row["deepest mm"] == pytest.approx(0.2)
