"""Pictures of scenes are made, and differ where scenes do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.image import imread

from defras_sim.scene_generator import draw_actual, draw_believed
from defras_sim.scene_picture import draw_scene


def test_a_picture_shows_what_differs(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    believed = draw_believed(rng, name="drawn")
    actual = draw_actual(believed, "more", rng)
    draw_scene(believed, tmp_path / "believed.png")
    draw_scene(believed, tmp_path / "both.png", actual)
    alone, both = (imread(tmp_path / name) for name in ("believed.png", "both.png"))
    assert alone.shape[0] > 700
    # Only the comparison uses the red of holes that hold although believed free.
    red = np.array([0xC1, 0x27, 0x2D]) / 255
    assert not np.any(np.all(np.abs(alone[..., :3] - red) < 0.01, axis=-1))
    assert np.sum(np.all(np.abs(both[..., :3] - red) < 0.01, axis=-1)) > 500
