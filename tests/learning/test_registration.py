"""A camera that stands elsewhere is found from shapes alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.registration import fitted_registration
from defras_bt.learning.replay import Replay
from defras_sim.geometry import Pose
from defras_sim.scene import Scene


def test_a_shift_and_a_turn_are_undone(
    truth: Scene, record: Callable[[int], list[Keyframe]]
) -> None:
    frames = record(1)
    states = Replay(truth, frames, (6, 6, 1)).repeat(truth.hole_stiffness_n_per_m(truth.attached))
    wrong = Pose(np.zeros(3)).moved(np.array([0.001, -0.001, 0.004]), np.array([0.02, 0.0, 0.0]))
    surfaces = [state.surface for state in states]
    clouds = [wrong.apply(frame.cloud_m) for frame in frames]
    straight = fitted_registration([f.cloud_m for f in frames], surfaces, truth.depth_camera)
    found = fitted_registration(clouds, surfaces, truth.depth_camera)
    assert straight is not None
    assert found is not None
    both = found @ wrong
    np.testing.assert_allclose(both.position_m[2], straight.position_m[2], atol=2e-4)
    np.testing.assert_allclose(both.rotation, straight.rotation, atol=5e-3)


def test_nothing_in_the_picture_is_none(
    truth: Scene, record: Callable[[int], list[Keyframe]]
) -> None:
    frame = record(1)[0]
    state = Replay(truth, [frame], (4, 4, 1)).repeat(truth.hole_stiffness_n_per_m(truth.attached))[
        0
    ]
    away = truth.depth_camera.model_copy(update={"position_m": (0.17, 5.0, 0.2)})
    turned = away.model_copy(update={"target_m": (0.17, 9.0, 0.2)})
    assert fitted_registration([frame.cloud_m], [state.surface], turned) is None
