"""The tissue twin as a problem: recordings of retractions beside what the twin says of them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence

import numpy as np

from defras_bt.diagnosis.motions import PlannedMotion, Strengths
from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Candidate, Covariate, Tangent
from defras_bt.diagnosis.quality import DataQuality
from defras_bt.diagnosis.recording import RecordedRun
from defras_bt.diagnosis.twins.tissue_approximation import approximation_errors
from defras_bt.diagnosis.twins.tissue_cells import AssignedCloud
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames, before_the_camera
from defras_bt.diagnosis.twins.tissue_models import LedModels, key_of
from defras_bt.diagnosis.twins.tissue_part import KeyShapes, TissuePart
from defras_bt.diagnosis.twins.tissue_planned import Planner
from defras_bt.diagnosis.twins.tissue_plans import plans
from defras_bt.diagnosis.twins.tissue_pressed import PRESSED_REMARK
from defras_bt.diagnosis.twins.tissue_samples import samples_of
from defras_bt.diagnosis.twins.tissue_signals import Layout
from defras_bt.diagnosis.twins.tissue_systematic import systematic_errors
from defras_bt.diagnosis.twins.tissue_tangents import TissueTangents
from defras_bt.diagnosis.twins.tissue_trajectory import MOST_FRAMES, Trajectory, trajectory
from defras_bt.diagnosis.twins.tissue_warnings import warning_states, warnings_remark
from defras_sim.effects.effect import Extension, Values
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

_REMEMBERED = 400
"""Residuals that are kept; one takes about 0.1 MB."""


class TissueProblem:
    """See :class:`defras_bt.diagnosis.problem.Problem`. Several recordings are several
    trajectories; all share the scene and what is wrong with it."""

    def __init__(
        self,
        scene: Scene,
        runs: Sequence[RecordedRun],
        candidates: Sequence[Candidate],
        *,
        most_frames: int = MOST_FRAMES,
        jobs: int = 1,
        to_score: bool = False,
    ) -> None:
        """``most_frames`` of a recording are compared; ``jobs`` processes work side by side.
        ``to_score``: models are only compared with these data, and nothing is looked for in them.

        Raises:
            UnusableRecording: the plain model cannot follow a recording at all.
        """
        self.scene = scene
        self.candidates = tuple(candidates)
        self.quality = DataQuality.together(_named_apart(runs))
        self.trajectories = tuple(trajectory(run, scene, most_frames) for run in runs)
        self.layout = Layout.of(scene, self.trajectories)
        effects = {} if to_score else {c.effect.name: c.effect for c in self.candidates}
        self._jobs, self._to_score = jobs, to_score
        self._models = LedModels(scene, self.trajectories, effects, jobs)
        plain = self._models.plain
        self.assigned = tuple(
            _assigned(each, frames, scene, self.layout)
            for each, frames in zip(self.trajectories, plain, strict=True)
        )
        self._tangents: dict[str, TissueTangents] = {}
        """Near the plain model, and near one other."""
        self._residuals: OrderedDict[str, Floats] = OrderedDict()
        left, corrected = self._blocks(plain), self._corrections({})
        self.samples = samples_of(self.layout, self.trajectories, plain, left, corrected)
        self._corrected = _joined(corrected)
        """By how much less (n,) the model at hand leaves, its mesh's error put right."""
        self._explained: Floats | None = None
        """What (n,) the causes of tissue and arms of the model at hand change."""

    def residual(self, model: Extension) -> Floats:
        """Measured minus predicted (n,); see :class:`defras_bt.diagnosis.problem.Problem`."""
        key = key_of(model)
        if key not in self._residuals:
            frames = self.frames(model)
            self._residuals[key] = (
                np.full(len(self.samples.time_s), np.nan)
                if frames is None
                else _joined(self._blocks(frames))
            )
            while len(self._residuals) > _REMEMBERED:
                self._residuals.popitem(last=False)
        return self._residuals[key]

    def foresee(self, models: Sequence[Extension]) -> None:
        """Several residuals will be asked for; see :class:`.problem.Foreseeing`."""
        self._models.foresee([m for m in models if key_of(m) not in self._residuals])

    def approach(self, model: Extension) -> bool:
        """The mesh's error anew where ``model`` stands; see :class:`.problem.Approaching`."""
        anew = self._models.correct_at(model)
        if anew:
            self._residuals.clear()
            self._tangents = {k: t for k, t in self._tangents.items() if k == key_of({}) and model}
        self._corrected = _joined(self._corrections(model))
        explained = self.residual({}) - self.residual(before_the_camera(model))
        self._explained = explained if model else None
        return anew

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        """How predictions change with ``candidate``; what those of all share is found once."""
        key = key_of(model)
        if key not in self._tangents:
            shapes = () if model or self._to_score else self._models.shapes
            found = self._near(model, self.candidates, shapes)
            if found is None:
                return ()
            plain = {k: t for k, t in self._tangents.items() if k == key_of({})}
            self._tangents = {**plain, key: found}
        return self._tangents[key].of(candidate)

    def derivatives(
        self, model: Extension, candidates: Sequence[Candidate]
    ) -> Mapping[tuple[str, str], Floats]:
        """See :class:`defras_bt.diagnosis.problem.Differentiating`."""
        near = self._near(model, candidates, ())
        if near is None:
            return {}
        return {
            (candidate.key, name): column
            for candidate in candidates
            for name, column in near.derivatives(candidate).items()
        }

    def systematic(
        self,
        residual: Floats,
        candidate: Candidate,
        columns: Mapping[str, Floats],
        rng: np.random.Generator,
    ) -> Values:
        """Standard error by parameter that the twin's own approximations make."""
        return systematic_errors(
            self.samples, residual, candidate, columns, self._corrected, self._explained, rng
        )

    def approximations(self, count: int, rng: np.random.Generator) -> Floats:
        """Draws (n, count) of what the twin itself may be off by."""
        return approximation_errors(self.samples, count, rng, self._explained, self._corrected)

    def covariates(self) -> Sequence[Covariate]:
        """How high held tissue is carried, as told."""
        height = [np.tile(each.height_m, self.layout.rows) for each in self.trajectories]
        return (Covariate("the height of the jaw", "m", np.concatenate(height)),)

    def remarks(self, model: Extension) -> Sequence[str]:
        """Forces that are left out, and what ``model`` changes of the plain one's warnings."""
        count = sum(each.pressed for each in self.trajectories)
        left_out = (PRESSED_REMARK.format(count=count),) if count else ()
        plain, extended = self.frames({}), self.frames(model)
        if not model or plain is None or extended is None:
            return left_out
        cells, phases = len(self.layout.grid), [each.phase for each in self.trajectories]
        delta_m = self.scene.thresholds.delta_m
        before, after = (
            warning_states([block[:cells] for block in self._blocks(frames)], phases, delta_m)
            for frames in (plain, extended)
        )
        return (*left_out, warnings_remark(before, after))

    @property
    def force_limit_n(self) -> float:
        """The scene's threshold; where it has none, as much as the plain model says that was
        exerted in the recordings."""
        limit = self.scene.thresholds.force_n
        return max(f.largest_force_n for f in self._models.plain) if limit is None else limit

    def planned_motions(
        self, model: Extension, strengths: Strengths, rng: np.random.Generator
    ) -> Sequence[PlannedMotion]:
        """See :class:`defras_bt.diagnosis.motions.Planning`; those that the twin can follow."""
        planner = Planner(self.scene, self.layout, self.samples, self._jobs)
        whole = self._models.whole(model)
        asked = [c for c in self.candidates if c.key in strengths]
        tried = plans(self.scene, self.trajectories)
        found = (planner.planned(plan, whole, asked, strengths, rng) for plan in tried)
        return tuple(motion for motion in found if motion is not None)

    def frames(self, model: Extension) -> tuple[TissueFrames, ...] | None:
        """What ``model`` says of the frames of every trajectory; None where it cannot."""
        return self._models.frames(model)

    def _near(
        self, model: Extension, candidates: Sequence[Candidate], shapes: Sequence[KeyShapes]
    ) -> TissueTangents | None:
        """What ``candidates`` would change near ``model``; None where it cannot be followed."""
        frames = self.frames(model)
        if frames is None:
            return None
        whole = self._models.whole(model)
        parts = [
            TissuePart(self.scene, whole, self.layout, each, assigned, its)
            for each, assigned, its in zip(self.trajectories, self.assigned, frames, strict=True)
        ]
        tolerance = tolerances(self.samples)
        ways = self._models.ways(model)
        return TissueTangents(
            self.scene, whole, parts, candidates, tolerance, self._jobs, ways, shapes
        )

    def _corrections(self, model: Extension) -> list[Floats]:
        """By how much less (rows, frames) ``model`` leaves, its mesh's error put right."""
        bare, whole = self._models.uncorrected(model), self.frames(model)
        if bare is None or whole is None:
            return [np.zeros((self.layout.rows, len(t.frames))) for t in self.trajectories]
        both = zip(self._blocks(bare), self._blocks(whole), strict=True)
        return [one - other for one, other in both]

    def _blocks(self, frames: Sequence[TissueFrames]) -> list[Floats]:
        """Residuals (rows, frames) of every trajectory."""
        return [
            self.layout.residual(each, assigned, its, self.scene.depth_camera)
            for each, assigned, its in zip(self.trajectories, self.assigned, frames, strict=True)
        ]


def _joined(blocks: Sequence[Floats]) -> Floats:
    return np.concatenate([block.ravel() for block in blocks])


def _assigned(
    each: Trajectory, frames: TissueFrames, scene: Scene, layout: Layout
) -> tuple[AssignedCloud, ...]:
    """Clouds with the patch that each point belongs to; where the plain model could not follow,
    no point belongs to any."""
    nobody = AssignedCloud(
        np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(len(layout.grid), np.int64)
    )
    return tuple(
        nobody
        if surface is None
        else AssignedCloud.to(surface, scene.depth_camera, layout.grid, cloud)
        for surface, cloud in zip(frames.surfaces, each.clouds_m, strict=True)
    )


def _named_apart(runs: Sequence[RecordedRun]) -> dict[str, DataQuality]:
    names = [run.name for run in runs]
    return {
        name if names.count(name) == 1 else f"{name} ({i})": run.quality
        for i, (name, run) in enumerate(zip(names, runs, strict=True), 1)
    }
