"""What the twin says of a whole motion: as live, and changed by effects where it should be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats, Pose
from defras_sim.prediction import MOST_LOST, Prediction, predict
from defras_sim.recorded_motion import ArmMotion, RecordedMotion
from defras_sim.scene import Attachments, Roi, Scene
from defras_sim.tissue.model import NothingToGrasp, TissueModel
from defras_sim.tissue.state import TissueState
from defras_sim.twin import Twin
from defras_sim.worlds.kinematic_tool import POINTING_DOWN
from defras_sim.worlds.protocol import PointCloud

GRASP_S, PULLED_S, RELEASE_S, END_S = 0.5, 1.5, 2.5, 3.0
LIFT_M = 0.015


@cache
def scene() -> Scene:
    """Held along the largest x; a coarse mesh keeps the tests quick."""
    plain = Scene(
        name="right side",
        attachments=Attachments(map=("..........##",) * 12),
        roi=Roi(center_x_m=0.01, center_y_m=0.0),
    )
    coarse = plain.tissue.model_copy(update={"elements_xyz": (4, 4, 1)})
    return plain.model_copy(update={"tissue": coarse})


def motion(step_s: float = 0.1) -> RecordedMotion:
    """Grasp at the free edge, lift within a second, hold, let go."""
    time_s = np.arange(0.0, END_S + step_s / 2, step_s)
    share = np.clip((time_s - GRASP_S) / (PULLED_S - GRASP_S), 0.0, 1.0)
    position = np.array([-0.05, 0.02, 0.0]) + share[:, None] * [0.0, 0.0, LIFT_M]
    rotation = np.tile(POINTING_DOWN, (len(time_s), 1, 1))
    # Sums of steps may miss a time by rounding.
    held = (time_s > GRASP_S - 1e-6) & (time_s < RELEASE_S - 1e-6)
    return RecordedMotion(time_s, {"psm1": ArmMotion(position, rotation, held)})


@cache
def predicted(*effects: tuple[str, tuple[tuple[str, float], ...]]) -> Prediction:
    extension: Extension = {name: dict(values) for name, values in effects}
    return predict(scene().extended(extension), motion())


def at(prediction: Prediction, time_s: float) -> int:
    return int(np.argmin(np.abs(prediction.time_s - time_s)))


def test_it_is_what_a_twin_says_that_runs_along() -> None:
    prediction, twin = predicted(), Twin(scene())
    told = motion()
    for row, time_s in enumerate(told.time_s):
        held = bool(told.arms["psm1"].grasped[row])
        if held and not twin.holding:
            twin.grasp("psm1", told.tips(row)["psm1"], time_s)
        if not held:
            twin.release("psm1", time_s)
        state = twin.track(told.tips(row), time_s)
        assert np.array_equal(prediction.vertices_m[row], state.surface.vertices_m)
        assert np.linalg.norm(prediction.force_n("psm1")[row]) == pytest.approx(twin.force_n)
    assert prediction.force_n("psm1")[0].tolist() == [0.0, 0.0, 0.0]


def test_some_instants_are_enough() -> None:
    every = predicted()
    some = predict(scene(), motion(), np.arange(0, 31, 4))
    assert set(every.time_s[some.rows]) >= {GRASP_S, RELEASE_S}, "grips are never left out"
    assert len(some.rows) < 12
    gap_m = np.abs(some.vertices_m - every.vertices_m[some.rows]).max()
    assert gap_m < 2e-5


def test_surfaces_between_two_instants_lie_between_them() -> None:
    prediction = predicted()
    first, then = prediction.vertices_m[at(prediction, 1.0)], prediction.vertices_m[11]
    shown = prediction.surface_shown(1.025).vertices_m
    assert np.allclose(shown, 0.75 * first + 0.25 * then)
    assert np.array_equal(prediction.surface_shown(-1.0).vertices_m, prediction.vertices_m[0])
    assert np.array_equal(prediction.surface_shown(99.0).vertices_m, prediction.vertices_m[-1])


def test_a_late_camera_shows_what_was() -> None:
    late = predicted(("camera_latency", (("delay_s", 0.3),)))
    assert np.array_equal(late.vertices_m, predicted().vertices_m)
    assert np.allclose(
        late.surface_shown(1.3).vertices_m, predicted().surface_shown(1.0).vertices_m, atol=1e-12
    )


def test_what_a_late_camera_shows_is_solved_where_it_was() -> None:
    """Between the few instants asked for, the lift is no straight line."""
    hidden: Extension = {"camera_latency": {"delay_s": 0.35}}
    few = predict(scene().extended(hidden), motion(), np.array([5, 17, 24]))
    every = predicted(("camera_latency", (("delay_s", 0.35),)))
    for stamp_s in (1.7, 2.4):
        shown = [p.surface_shown(stamp_s).vertices_m for p in (few, every)]
        assert np.abs(shown[0] - shown[1]).max() < 2e-5


def test_a_slip_lets_tissue_and_force_down_from_then_on() -> None:
    plain = predicted()
    slipped = predicted(("grasp_slip", (("distance_m", 0.006), ("time_s", 1.6))))
    before, after = at(plain, 1.5), at(plain, 2.0)
    assert np.array_equal(slipped.vertices_m[: before + 1], plain.vertices_m[: before + 1])
    lower = plain.vertices_m[after, :, 2].max() - slipped.vertices_m[after, :, 2].max()
    assert lower == pytest.approx(0.006, abs=0.001)
    force_n = np.linalg.norm(slipped.force_n("psm1")[after])
    assert force_n < 0.7 * np.linalg.norm(plain.force_n("psm1")[after])
    assert np.allclose(slipped.vertices_m[-1], plain.vertices_m[-1], atol=1e-7)


def test_a_jaw_beside_its_point_holds_the_tissue_there() -> None:
    beside = predicted(("grasp_offset", (("x_m", 0.02), ("y_m", -0.02))))
    row = at(beside, 2.0)
    rest_xy_m = beside.states[0].surface.rest_xy_m
    meant, taken = (
        int(np.argmin(np.linalg.norm(rest_xy_m - place, axis=1)))
        for place in ([-0.05, 0.02], [-0.03, 0.0])
    )
    lifted = np.array(
        [[p.vertices_m[row, v, 2] for v in (meant, taken)] for p in (predicted(), beside)]
    )
    assert np.diag(lifted) == pytest.approx([LIFT_M, LIFT_M], abs=4e-4)
    assert abs(lifted[0, 1] - LIFT_M) > 0.001


def test_a_wrong_registration_and_a_wrong_grasp_point_look_alike_for_a_pull() -> None:
    """Both displace what is held by the same; a diagnosis has to say that it cannot tell."""
    registered = predicted(("tool_offset", (("x_m", 0.02),)))
    beside = predicted(("grasp_offset", (("x_m", 0.02),)))
    assert np.abs(registered.vertices_m - beside.vertices_m).max() < 1e-6
    assert np.abs(registered.vertices_m - predicted().vertices_m).max() > 0.001


def test_an_arm_that_gives_way_rests_where_its_compliance_meets_the_tissue() -> None:
    softness = 0.02  # m/N, as much as is allowed: the tissue gives way some 0.2 m/N
    bent = predicted(("arm_compliance", (("z_m_per_n", softness),)))
    row = at(bent, 2.0)
    state, plain = bent.states[row], predicted().states[row]
    sunk_m = plain.surface.vertices_m[:, 2].max() - state.surface.vertices_m[:, 2].max()
    pull_n = bent.force_n("psm1")[row][2]
    assert sunk_m == pytest.approx(softness * pull_n, rel=0.1)


def test_encoders_see_a_lag_and_no_offset() -> None:
    lag = tuple((f"q{n}_s", 0.1) for n in range(1, 7))
    late, off = predicted(("servo_lag", lag)), predicted(("tool_offset", (("z_m", 0.002),)))
    row = at(late, 1.0)
    told_m = motion().arms["psm1"].position_m
    assert late.measured["psm1"][row].position_m == pytest.approx(told_m[row - 1], abs=5e-5)
    assert np.array_equal(off.measured["psm1"][row].position_m, told_m[row])


def test_stress_that_fades_lets_go_of_the_jaw_while_it_holds() -> None:
    fading = predicted(("stress_relaxation", (("fraction", 0.5), ("time_s", 0.4))))
    force_n = np.linalg.norm(fading.force_n("psm1"), axis=1)
    plain_n = np.linalg.norm(predicted().force_n("psm1"), axis=1)
    start, end = at(fading, PULLED_S), at(fading, RELEASE_S - 0.1)
    assert force_n[end] < 0.85 * force_n[start]
    assert plain_n[end] == pytest.approx(plain_n[start], rel=1e-3)


def test_clouds_are_led_back_through_camera_and_clock() -> None:
    extension = {"camera_registration": {"x_m": 0.003}, "camera_latency": {"delay_s": 0.1}}
    twin = Twin(scene().extended(extension))
    cloud = PointCloud(2.0, np.zeros((5, 3)))
    true = twin.corrected(cloud)
    assert true.stamp_s == pytest.approx(1.9)
    assert np.allclose(true.points_m, [-0.003, 0.0, 0.0])
    assert Twin(scene()).corrected(cloud) is cloud


def test_a_model_that_is_lost_is_not_asked_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    solve = TissueModel.solve

    def lost_when_lifted(
        model: TissueModel, tips: Mapping[str, Pose], change_m: Floats | None = None
    ) -> TissueState:
        state = solve(model, tips, change_m)
        if not any(tip.position_m[2] > 0.005 for tip in tips.values()):
            return state
        asked.append(tips["psm1"].position_m[2])
        return replace(state, converged=False)

    monkeypatch.setattr(TissueModel, "solve", lost_when_lifted)
    prediction = predict(scene(), motion())
    assert len(asked) == MOST_LOST
    unknown = np.isnan(prediction.vertices_m).any(axis=(1, 2))
    assert np.array_equal(unknown, np.isnan(prediction.force_n("psm1")).any(axis=1))
    lost = (prediction.time_s > 0.8 + 1e-6) & (prediction.time_s < RELEASE_S - 1e-6)
    assert np.array_equal(unknown, lost), "let go, the tissue is at rest again"


def test_what_cannot_be_predicted_is_refused() -> None:
    foreign = RecordedMotion(motion().time_s, {"psm3": motion().arms["psm1"]})
    with pytest.raises(ValueError, match="the scene right side has the arms psm1, psm2"):
        predict(scene(), foreign)
    with pytest.raises(NothingToGrasp):
        predict(scene().extended({"tool_offset": {"z_m": 0.02}}), motion())
