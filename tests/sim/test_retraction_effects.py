"""Rehearsals have the effects of their scene, whatever was rehearsed before."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.effects.effect import Extension
from defras_sim.retraction import Rehearsal, Rehearser
from defras_sim.scene import Attachments, Roi, Scene

POINT = (1, 3)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Held along the largest x; a coarse mesh keeps the tests quick."""
    plain = Scene(
        name="right side",
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.01, center_y_m=0.0),
    )
    coarse = plain.tissue.model_copy(update={"elements_xyz": (4, 4, 1)})
    return plain.model_copy(update={"tissue": coarse})


def rehearsed(scene: Scene, effects: Extension, *ways: tuple[str, ...]) -> list[Rehearsal]:
    rehearser = Rehearser(scene.extended(effects), step_m=0.005)
    return [rehearser.run(POINT, way) for way in ways]


def test_stress_that_fades_on_the_way_takes_force(scene: Scene) -> None:
    fading: Extension = {"stress_relaxation": {"fraction": 0.6, "time_s": 1.0}}
    (plain,) = rehearsed(scene, {}, ("pull",))
    (faded,) = rehearsed(scene, fading, ("pull",))
    assert faded.finished
    assert faded.force_max_n < 0.8 * plain.force_max_n


def test_what_was_rehearsed_before_leaves_no_trace(scene: Scene) -> None:
    """A slip in the middle of the second manoeuvre, and tissue that remembers."""
    hidden: Extension = {
        "grasp_slip": {"distance_m": 0.01, "time_s": 3.5},
        "stress_relaxation": {"fraction": 0.4, "time_s": 1.0},
        "servo_lag": {"q3_s": 0.1},
    }
    *_, after = rehearsed(
        scene, hidden, ("pull", "move"), ("pull", "fold"), ("pull", "move", "fold")
    )
    (alone,) = rehearsed(scene, hidden, ("pull", "move", "fold"))
    assert after.forces_n == pytest.approx(alone.forces_n, rel=2e-3)
    assert after.visibility == pytest.approx(alone.visibility, abs=0.01)
    assert np.allclose(after.stopped_at_m, alone.stopped_at_m)


def test_an_arm_that_misses_the_tissue_finishes_nothing(scene: Scene) -> None:
    (missed,) = rehearsed(scene, {"tool_offset": {"z_m": 0.02}}, ("pull",))
    assert not missed.finished
    assert missed.force_max_n == 0.0
