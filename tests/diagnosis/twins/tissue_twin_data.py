"""A short recorded retraction on a coarse mesh, made by the twin itself or by another model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from defras_bt.benchmark.hidden_noise import NoiseSpectrum
from defras_bt.benchmark.hidden_recording import reality, record
from defras_bt.benchmark.hidden_retraction import Script
from defras_bt.cli.files import find_scene
from defras_sim.effects.effect import Extension
from defras_sim.scene import Scene

SCRIPT = Script(
    "psm1",
    (2, 4),
    lift_m=0.018,
    move_m=(0.008, -0.006),
    fold_m=0.008,
    speed_m_s=0.03,
    hold_s=0.4,
    rest_s=1.0,
)


def coarse(name: str = "sim1") -> Scene:
    """A shipped scene on a mesh that is solved in milliseconds."""
    scene = find_scene(name)[1]
    tissue = scene.tissue.model_copy(update={"elements_xyz": (4, 4, 1)})
    return scene.model_copy(update={"tissue": tissue})


def recorded(
    scene: Scene, hidden: Extension, file: Path, *, seed: int = 0, with_force: bool = True
) -> Path:
    """A recording of :data:`SCRIPT` in ``file``."""
    actual = reality(scene, hidden, with_force=with_force, elements_xyz=(6, 6, 1))
    record(actual, SCRIPT, NoiseSpectrum(), np.random.default_rng(seed), file)
    return file
