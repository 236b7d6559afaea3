"""Rehearsals of retractions."""

from __future__ import annotations

import numpy as np
import pytest

from defras_sim.motion import manoeuvre_target_m
from defras_sim.retraction import Rehearser, arm_for, rehearse
from defras_sim.scene import Attachments, Roi, Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Held along the largest x, so that the side of the endoscope opens like a lid."""
    plain = Scene(
        name="right side",
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.0, center_y_m=0.01),
    )
    coarse = plain.tissue.model_copy(update={"elements_xyz": (5, 5, 1)})
    return plain.model_copy(update={"tissue": coarse})


def test_each_side_has_its_arm_and_the_middle_goes_to_the_first(scene: Scene) -> None:
    assert [arm_for(scene, (2, row)) for row in range(1, 6)] == [
        "psm2", "psm2", "psm1", "psm1", "psm1"
    ]  # fmt: skip
    one_armed = scene.model_copy(update={"arms": {"psm2": scene.arms["psm2"]}})
    assert arm_for(one_armed, (2, 3)) == "psm2"
    with pytest.raises(ValueError, match="no arm works on the side"):
        arm_for(one_armed, (2, 5))


def test_pull_and_fold_open_the_lid(scene: Scene) -> None:
    result = rehearse(scene, (1, 4), ("pull", "fold"), step_m=0.006)
    assert result.finished
    assert result.manoeuvres == ("pull", "fold")
    assert len(result.visibility) == len(result.forces_n) == 2
    assert result.best_visibility >= 0.8
    assert result.best_visibility >= max(result.visibility)
    assert 0.02 < result.force_max_n < 0.3
    top = manoeuvre_target_m(scene, "pull", np.array([*scene.grasp_xy_m(1, 4), 0.0]))
    assert np.allclose(result.stopped_at_m, manoeuvre_target_m(scene, "fold", top))


def test_it_can_stop_as_soon_as_the_region_is_exposed(scene: Scene) -> None:
    result = rehearse(scene, (1, 4), ("pull", "fold"), step_m=0.006, stop_when_exposed=True)
    assert result.best_visibility >= 0.8
    assert np.array_equal(result.best_at_m, result.stopped_at_m)
    end = np.array([*scene.grasp_xy_m(1, 4), 0.04]) + [scene.motion.fold_distance_m, 0, 0]
    assert np.linalg.norm(result.stopped_at_m - end) > 0.006


def test_a_point_above_the_attachments_pulls_hard(scene: Scene) -> None:
    result = rehearse(scene, (5, 3), ("pull",), step_m=0.01)
    assert result.force_max_n > 1.0


def test_shared_beginnings_change_nothing(scene: Scene) -> None:
    rehearser = Rehearser(scene, step_m=0.008)
    shared = [rehearser.run((1, 4), manoeuvres) for manoeuvres in (("pull",), ("pull", "move"))]
    rehearser.run((1, 2), ("pull",))
    again = rehearser.run((1, 4), ("pull", "move"))
    alone = rehearse(scene, (1, 4), ("pull", "move"), step_m=0.008)
    for result in (shared[1], again):
        assert result.forces_n == pytest.approx(alone.forces_n, rel=0.01)
        assert result.visibility == pytest.approx(alone.visibility, abs=0.02)
    assert shared[0].visibility[0] == shared[1].visibility[0]


def test_unknown_manoeuvres_are_told(scene: Scene) -> None:
    with pytest.raises(ValueError, match="valid: pull, move, fold"):
        rehearse(scene, (1, 4), ("push",))


def test_a_retraction_ends_with_the_step_that_is_too_forceful(scene):
    free = Rehearser(scene, step_m=0.008).run((1, 4), ("pull", "move"))
    limit_n = 0.5 * free.forces_n[0]
    stopped = Rehearser(scene, step_m=0.008).run((1, 4), ("pull", "move"), most_force_n=limit_n)
    assert stopped.finished
    assert len(stopped.forces_n) == 1
    assert limit_n < stopped.force_max_n <= free.forces_n[0]
    assert stopped.stopped_at_m[2] < free.stopped_at_m[2]
