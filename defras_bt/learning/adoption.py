"""Whether a proposed set of attachments is believed: what points say that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.learning.estimate import Keyframe
from defras_bt.learning.evidence import Evidence, compare
from defras_bt.learning.hold_out import Cells, Split
from defras_bt.learning.misfit import misfit
from defras_bt.learning.registration import fitted_registration
from defras_bt.learning.replay import NotRepeatable
from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.seen import seen_surface
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Camera
from defras_sim.tissue.state import TissueState

Shapes = Sequence[TissueState]


@dataclass(frozen=True)
class AdoptionRule:
    """The least that held-out points have to say.

    The gain has to be one that chance gives in fewer than ``chance`` of cases, at least
    ``relative_gain`` of the whole distance, at least ``explained`` of the part of it that is not
    the camera's noise, at least ``local_gain_m`` where anything changes, and must not make the
    worst neighbourhood of any frame worse by more than ``worse_m``. A camera that stands elsewhere,
    fitted to the same points, must not do ``rival_share`` of it. Nor must something unknown that
    pulls at one place do better, by ``pull_gain_m`` where the two differ, than chance does in fewer
    than ``pull_chance`` of cases, as far as the test can tell (where errors are smooth over 20 mm
    it is fooled in up to one case of seven); that is asked where less than ``beyond_doubt`` is
    explained.

    ``explained`` keeps other errors of the model from being blamed on attachments: set right where
    they were wrong, they explain about 80 to 90 %; bent to make up for a coarse mesh, 50 to 67 %
    (three simulated folds with the right belief). Where little tissue is concerned, that share is
    mostly one of noise, which is larger in a fold than at rest; it is enough then to explain as
    much of the error where predictions differ, if no more than ``left_m`` of the whole distance is
    neither noise nor explained.

    ``beyond_doubt``: of some 450 simulated updates, a pull seemed to do better in eight that were
    right, six of which explained 88 to 92 %; what unknown instruments and stiff spots made a
    search propose explained 67 to 87 %.
    """

    chance: float = 0.01
    relative_gain: float = 0.1
    explained: float = 0.7
    left_m: float = 0.0001
    local_gain_m: float = 0.0002
    worse_m: float = 0.0005
    rival_share: float = 0.7
    pull_chance: float = 0.02
    pull_gain_m: float = 0.0001
    beyond_doubt: float = 0.88


@dataclass(frozen=True)
class Hearing:
    """One proposal before the rule: shapes of every keyframe as believed and as proposed."""

    camera: Camera
    keyframes: Sequence[Keyframe]
    parts: Split
    before: Shapes
    after: Shapes

    def evidence(self, rng: np.random.Generator) -> Evidence:
        """What the held-out points say about both."""
        before_m, rest_xy_m = distances_m(self.camera, self.parts.judging_points_m, self.before)
        after_m, _ = distances_m(self.camera, self.parts.judging_points_m, self.after)
        return compare(before_m, after_m, rest_xy_m, rng)

    def explained(self, evidence: Evidence) -> float:
        """Share of the error that is not noise; above 1 where less is left than at rest."""
        gain_m = evidence.before_m - evidence.after_m
        return _share(gain_m, evidence.before_m - self._noise_m())

    def objection(self, rule: AdoptionRule, evidence: Evidence) -> str | None:
        """Why the proposal is not believed, in one sentence; None if it is."""
        change = (
            f"points that were not fitted go from {1e3 * evidence.before_m:.2f} to "
            f"{1e3 * evidence.after_m:.2f} mm"
        )
        if evidence.chance > rule.chance:
            return f"attachments do not explain this: {change}, which chance may do as well"
        if not (
            evidence.relative_gain >= rule.relative_gain
            and evidence.local_gain_m >= rule.local_gain_m
        ):
            return f"attachments do not explain this: {change}, too little to matter"
        noise_m, explained = self._noise_m(), self.explained(evidence)
        locally = _share(evidence.local_gain_m, evidence.local_before_m - noise_m)
        little = evidence.after_m - noise_m <= rule.left_m and locally >= rule.explained
        if not (explained >= rule.explained or little):
            return (
                f"attachments do not explain this: {change}, "
                f"{100 * explained:.0f} % of what is not noise"
            )
        worse_m = self._worst_m(self.after) - self._worst_m(self.before)
        if np.isnan(worse_m):
            return f"attachments do not explain this: {change}, but in some picture nothing is seen"
        if not worse_m <= rule.worse_m:
            return (
                f"attachments do not explain this: {change}, but the worst place gets "
                f"{1e3 * worse_m:.1f} mm worse"
            )
        moved = self._misplaced_camera()
        if moved is None:
            return None
        points = [moved.apply(points) for points in self.parts.judging_points_m]
        rival_m = float(distances_m(self.camera, points, self.before)[0].mean())
        gain_m = evidence.before_m - evidence.after_m
        if evidence.before_m - rival_m < rule.rival_share * gain_m:
            return None
        return (
            f"attachments do not explain this: {change}, but a camera that stands "
            f"{1e3 * float(np.linalg.norm(moved.position_m)):.1f} mm elsewhere brings them to "
            f"{1e3 * rival_m:.2f} mm"
        )

    def _noise_m(self) -> float:
        """What is left in the frame that is predicted best, mostly that at rest."""
        per_frame = [
            distances_m(self.camera, [frame.cloud_m], [shape])[0].mean()
            for shapes in (self.before, self.after)
            for frame, shape in zip(self.keyframes, shapes, strict=True)
            if len(frame.cloud_m)
        ]
        return float(np.min(per_frame))

    def _worst_m(self, shapes: Shapes) -> float:
        """Worst neighbourhood of all frames: what monitoring will look at. NaN if one is unknown.

        ``np.max`` keeps NaN where Python's ``max`` may not, and NaN has to count as worse.
        """
        values = [
            LocalMetric().measure(frame.cloud_m, seen_surface(shape.surface, self.camera)).value_m
            for frame, shape in zip(self.keyframes, shapes, strict=True)
        ]
        return float(np.max(values))

    def _misplaced_camera(self) -> Pose | None:
        """Where the camera would have to stand instead; None if that does not help in every frame.

        It would show in each of them, also before anything moved.
        """
        black = [Cells.of(frame.cloud_m).black for frame in self.keyframes]
        fitted = [frame.cloud_m[mine] for frame, mine in zip(self.keyframes, black, strict=True)]
        surfaces = [shape.surface for shape in self.before]
        moved = fitted_registration(fitted, surfaces, self.camera)
        if moved is None:
            return None
        for frame, mine, surface in zip(self.keyframes, black, surfaces, strict=True):
            held_out = frame.cloud_m[~mine]
            as_is = misfit(held_out, surface, self.camera)
            aligned = misfit(moved.apply(held_out), surface, self.camera)
            if as_is is None or aligned is None or aligned.mean_m >= as_is.mean_m:
                return None
        return moved


def _share(gain_m: float, excess_m: float) -> float:
    """Of an error above the noise; none where there is no such error."""
    return gain_m / excess_m if excess_m > 0 else 0.0


def distances_m(
    camera: Camera, points_m: Sequence[Floats], shapes: Shapes
) -> tuple[Floats, Floats]:
    """Distance (n,) of the points of all frames, and where on the resting tissue (n, 2) they lie.

    Raises:
        NotRepeatable: the camera sees nothing of a shape.
    """
    distances, places = [], []
    for points, shape in zip(points_m, shapes, strict=True):
        compared = misfit(points, shape.surface, camera)
        if compared is None:
            raise NotRepeatable("the model's tissue leaves the depth camera's picture")
        distances.append(np.abs(compared.residual_m))
        rest = shape.surface.rest_xy_m[compared.vertices]
        places.append(np.einsum("nk,nkd->nd", compared.weights, rest))
    return np.concatenate(distances), np.concatenate(places)
