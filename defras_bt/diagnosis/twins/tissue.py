"""The tissue twin as a problem: recordings of retractions beside what the twin says of them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np
from joblib import Parallel, delayed

from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Candidate, Integers, Samples, Tangent
from defras_bt.diagnosis.quality import DataQuality
from defras_bt.diagnosis.recording import RecordedRun
from defras_bt.diagnosis.recording_reader import UnusableRecording
from defras_bt.diagnosis.twins.tissue_cells import AssignedCloud
from defras_bt.diagnosis.twins.tissue_correction import MeshCorrection, finer
from defras_bt.diagnosis.twins.tissue_frames import TissueFrames, frames_of
from defras_bt.diagnosis.twins.tissue_part import TissuePart
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_signals import Layout, gone_m, noise_sd
from defras_bt.diagnosis.twins.tissue_systematic import systematic_errors
from defras_bt.diagnosis.twins.tissue_tangents import TissueTangents
from defras_bt.diagnosis.twins.tissue_trajectory import MOST_FRAMES, Trajectory, trajectory
from defras_sim.effects.effect import Extension, Values
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.tissue.model import NothingToGrasp

BLOCKS = 8
"""Stretches of time of a recording that are held out one at a time."""
WHOLE_FROM = 5
"""From so many recordings on, each is held out as a whole."""
_REMEMBERED = 40


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
    ) -> None:
        """``most_frames`` of a recording are compared; ``jobs`` processes work side by side.

        Raises:
            UnusableRecording: the plain model cannot follow a recording at all.
        """
        self.scene = scene
        self.candidates = tuple(candidates)
        self.quality = DataQuality.together(_named_apart(runs))
        self.trajectories = tuple(trajectory(run, scene, most_frames) for run in runs)
        self.layout = Layout.of(scene, self.trajectories)
        self._frames: OrderedDict[str, tuple[TissueFrames, ...]] = OrderedDict()
        self._jobs = jobs
        plain, self._corrections = self._followed()
        self.assigned = tuple(
            _assigned(each, frames, scene, self.layout)
            for each, frames in zip(self.trajectories, plain, strict=True)
        )
        self._tangents: tuple[str, TissueTangents] | None = None
        self._residuals: OrderedDict[str, Floats] = OrderedDict()
        self._remember_frames("[]", tuple(plain))
        self.samples = self._samples(plain)

    def residual(self, model: Extension) -> Floats:
        """Measured minus predicted (n,); see :class:`defras_bt.diagnosis.problem.Problem`."""
        key = _key(model)
        if key not in self._residuals:
            frames = self.frames(model)
            self._residuals[key] = (
                np.full(len(self.samples.time_s), np.nan)
                if frames is None
                else np.concatenate([block.ravel() for block in self._blocks(frames)])
            )
            while len(self._residuals) > _REMEMBERED:
                self._residuals.popitem(last=False)
        return self._residuals[key]

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        """How predictions change with ``candidate``; what those of all share is found once."""
        key = _key(model)
        if self._tangents is None or self._tangents[0] != key:
            frames = self.frames(model)
            if frames is None:
                return ()
            whole = {**self.scene.model.extension, **model}
            parts = [
                TissuePart(self.scene, whole, self.layout, each, assigned, its)
                for each, assigned, its in zip(
                    self.trajectories, self.assigned, frames, strict=True
                )
            ]
            found = TissueTangents(
                self.scene, whole, parts, self.candidates, tolerances(self.samples), self._jobs
            )
            self._tangents = (key, found)
        return self._tangents[1].of(candidate)

    def systematic(self, model: Extension, candidate: Candidate) -> Values:
        """Standard error by parameter that the twin's own approximations make."""
        return systematic_errors(
            self.samples, self.residual(model), candidate, self.tangents(model, candidate)
        )

    def frames(self, model: Extension) -> tuple[TissueFrames, ...] | None:
        """What ``model`` says of the frames of every trajectory; None where it cannot."""
        key = _key(model)
        if key not in self._frames:
            try:
                found = tuple(
                    correction.applied(frames_of(self.scene, model, each))
                    for each, correction in zip(self.trajectories, self._corrections, strict=True)
                )
            except (NothingToGrasp, ValueError):  # no such tissue, or none where the jaw closes
                return None
            self._remember_frames(key, found)
        return self._frames[key]

    def _blocks(self, frames: Sequence[TissueFrames]) -> list[Floats]:
        """Residuals (rows, frames) of every trajectory."""
        return [
            self.layout.residual(each, assigned, its, self.scene.depth_camera)
            for each, assigned, its in zip(self.trajectories, self.assigned, frames, strict=True)
        ]

    def _remember_frames(self, key: str, frames: tuple[TissueFrames, ...]) -> None:
        self._frames[key] = frames
        while len(self._frames) > 3:
            self._frames.popitem(last=False)

    def _followed(self) -> tuple[list[TissueFrames], tuple[MeshCorrection, ...]]:
        """The frames of every trajectory as the plain model has them, its mesh's error put right.

        Raises:
            UnusableRecording: the model cannot follow a trajectory at all.
        """
        fine = finer(self.scene)
        work = [(self.scene, each) for each in self.trajectories]
        work += [] if fine is None else [(fine, each) for each in self.trajectories]
        try:
            found = Parallel(n_jobs=self._jobs, inner_max_num_threads=1)(
                delayed(frames_of)(scene, {}, each) for scene, each in work
            )
        except NothingToGrasp as miss:
            raise UnusableRecording(
                f"the model cannot repeat a grasp that was recorded: {miss}. Is the scene that of "
                "this recording, and are its frames right?"
            ) from miss
        plain = found[: len(self.trajectories)]
        for each, frames in zip(self.trajectories, plain, strict=True):
            if all(surface is None for surface in frames.surfaces):
                raise UnusableRecording(f"{each.name}: the model finds no equilibrium in any frame")
        others = found[len(plain) :] or plain
        corrections = tuple(map(MeshCorrection.between, plain, others))
        corrected = [c.applied(f) for c, f in zip(corrections, plain, strict=True)]
        return corrected, corrections

    def _samples(self, plain: Sequence[TissueFrames]) -> Samples:
        blocks = self._blocks(plain)
        kinds = np.repeat(
            [0, 1, 2],
            [
                len(self.layout.grid),
                3 * len(self.layout.with_force),
                3 * len(self.layout.with_tip),
            ],
        )
        noise = noise_sd(blocks, [each.phase for each in self.trajectories], kinds)
        forces = [f for each in self.trajectories for f in each.forces_n.values()]
        largest = [float(np.nanmax(np.linalg.norm(f, axis=1), initial=0.0)) for f in forces]
        gone = np.max([gone_m(frames, self.layout.grid) for frames in plain], axis=0)
        whole = len(self.trajectories) >= WHOLE_FROM
        times, channels, owners, phases, folds = [], [], [], [], []
        for number, each in enumerate(self.trajectories):
            rows, count = self.layout.rows, len(each.frames)
            fold = (
                np.full(count, number)
                if whole
                else number * BLOCKS + _blocks_of(each.phase, BLOCKS)
            )
            times.append(np.tile(each.time_s, rows))
            channels.append(np.repeat(np.arange(rows), count))
            owners.append(np.full(rows * count, number))
            phases.append(np.tile(each.phase, rows))
            folds.append(np.tile(fold, rows))
        return Samples(
            self.layout.channels(noise, gone, max(largest, default=0.0)),
            tuple(each.name for each in self.trajectories),
            PHASES,
            np.concatenate(times),
            np.concatenate(channels).astype(np.int64),
            np.concatenate(owners).astype(np.int64),
            np.concatenate(phases).astype(np.int64),
            np.concatenate(folds).astype(np.int64),
        )


def _blocks_of(phase: Integers, count: int) -> Integers:
    """Contiguous blocks (f,) of frames, all with as much of the time in which something happens.

    Frames at rest are all alike: together they are worth one block.
    """
    rest = phase == PHASES.index("rest")
    weight = np.where(rest, 1.0 / max(1, int(rest.sum())), 0.0)
    moving = ~rest
    weight[moving] = (count - 1) / max(1, int(moving.sum()))
    if not rest.any():
        weight = np.full(len(phase), count / len(phase))
    done = np.cumsum(weight) - weight / 2
    return np.clip(done * (count / max(float(weight.sum()), 1e-12)), 0, count - 1e-9).astype(
        np.int64
    )


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


def _key(model: Extension) -> str:
    return repr(sorted((name, sorted(values.items())) for name, values in model.items()))
