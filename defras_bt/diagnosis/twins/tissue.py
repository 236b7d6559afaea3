"""The tissue twin as a problem: recordings of retractions beside what the twin says of them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence

import numpy as np
from joblib import Parallel, delayed

from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Candidate, Integers, Samples, Tangent
from defras_bt.diagnosis.quality import DataQuality
from defras_bt.diagnosis.recording import RecordedRun
from defras_bt.diagnosis.recording_reader import UnusableRecording
from defras_bt.diagnosis.twins.tissue_approximation import approximation_errors
from defras_bt.diagnosis.twins.tissue_cells import AssignedCloud
from defras_bt.diagnosis.twins.tissue_correction import MeshCorrection, finer
from defras_bt.diagnosis.twins.tissue_first_jobs import first_jobs, key_shapes
from defras_bt.diagnosis.twins.tissue_frames import (
    TissueFrames,
    before_the_camera,
    frames_of,
    led_along,
)
from defras_bt.diagnosis.twins.tissue_noise import noise_sd
from defras_bt.diagnosis.twins.tissue_part import TissuePart
from defras_bt.diagnosis.twins.tissue_passes import led
from defras_bt.diagnosis.twins.tissue_phases import PHASES
from defras_bt.diagnosis.twins.tissue_signals import Layout, gone_m
from defras_bt.diagnosis.twins.tissue_systematic import systematic_errors
from defras_bt.diagnosis.twins.tissue_tangents import TissueTangents
from defras_bt.diagnosis.twins.tissue_trajectory import MOST_FRAMES, Trajectory, trajectory
from defras_sim.effects.effect import Extension, Values
from defras_sim.geometry import Floats
from defras_sim.prediction import Prediction
from defras_sim.scene import Scene

BLOCKS = 8
"""Stretches of time of a recording that are held out one at a time."""
WHOLE_FROM = 5
"""From so many recordings on, each is held out as a whole."""
_REMEMBERED = 40
"""Residuals, and models led along, that are kept: cameras and clocks are tried on known tissue."""
_MOST_LED = 12


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
        self._led: OrderedDict[str, tuple[Prediction, ...] | None] = OrderedDict()
        self._jobs = jobs
        plain, self._corrections = self._followed()
        self.assigned = tuple(
            _assigned(each, frames, scene, self.layout)
            for each, frames in zip(self.trajectories, plain, strict=True)
        )
        self._tangents: tuple[str, TissueTangents] | None = None
        self._residuals: OrderedDict[str, Floats] = OrderedDict()
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

    def foresee(self, models: Sequence[Extension]) -> None:
        """Lead several models along at once, on as many processes as there are, before their
        residuals are asked for one by one."""
        wanted = {}
        for model in models:
            key = _key(before_the_camera(self._whole(model)))
            if _key(model) not in self._residuals and key not in self._led:
                wanted[key] = model
        if self._jobs > 1 and len(wanted) * len(self.trajectories) > 1:
            self._lead_along(wanted)

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        """How predictions change with ``candidate``; what those of all share is found once."""
        key = _key(model)
        if self._tangents is None or self._tangents[0] != key:
            parts = self._parts(model)
            if parts is None:
                return ()
            found = TissueTangents(
                self.scene,
                self._whole(model),
                parts,
                self.candidates,
                tolerances(self.samples),
                self._jobs,
                () if model else self._first_shapes,
            )
            self._tangents = (key, found)
        return self._tangents[1].of(candidate)

    def derivatives(
        self, model: Extension, candidates: Sequence[Candidate]
    ) -> Mapping[tuple[str, str], Floats]:
        """Change (n,) of predictions per unit of the free parameters of ``candidates`` that
        ``model`` has, but for those that have to be measured."""
        found: dict[tuple[str, str], Floats] = {}
        parts = self._parts(model)
        if parts is not None:
            near = TissueTangents(
                self.scene,
                self._whole(model),
                parts,
                candidates,
                tolerances(self.samples),
                self._jobs,
            )
            for candidate in candidates:
                for name, column in near.derivatives(candidate).items():
                    found[candidate.key, name] = column
        return found

    def systematic(
        self,
        residual: Floats,
        candidate: Candidate,
        columns: Mapping[str, Floats],
        rng: np.random.Generator,
    ) -> Values:
        """Standard error by parameter that the twin's own approximations make."""
        return systematic_errors(self.samples, residual, candidate, columns, rng)

    def approximations(self, count: int, rng: np.random.Generator) -> Floats:
        """Draws (n, count) of what the twin itself may be off by."""
        return approximation_errors(self.samples, count, rng)

    def frames(self, model: Extension) -> tuple[TissueFrames, ...] | None:
        """What ``model`` says of the frames of every trajectory; None where it cannot."""
        whole = self._whole(model)
        key = _key(before_the_camera(whole))
        if key not in self._led:
            self._lead_along({key: model})
        self._led.move_to_end(key)
        predictions = self._led[key]
        if predictions is None:
            return None
        return tuple(
            correction.applied(frames_of(prediction, self.scene, whole, each))
            for each, correction, prediction in zip(
                self.trajectories, self._corrections, predictions, strict=True
            )
        )

    def _whole(self, model: Extension) -> dict[str, Values]:
        """``model`` with the effects that the scene itself adopts, or in their place."""
        return {**self.scene.model.extension, **model}

    def _lead_along(self, models: Mapping[str, Extension]) -> None:
        """Predict tissue and arms of ``models`` by key, side by side, and remember them."""
        work = [
            (self._whole(model), each) for model in models.values() for each in self.trajectories
        ]
        jobs = self._jobs if len(work) > 1 else 1
        found = Parallel(n_jobs=jobs, inner_max_num_threads=1)(
            delayed(led_along)(self.scene, whole, each) for whole, each in work
        )
        count = len(self.trajectories)
        for number, key in enumerate(models):
            self._remember(key, found[count * number : count * (number + 1)])

    def _remember(self, key: str, predictions: Sequence[Prediction | None]) -> None:
        followed = tuple(p for p in predictions if p is not None)
        self._led[key] = followed if len(followed) == len(predictions) else None
        while len(self._led) > _MOST_LED:
            self._led.popitem(last=False)

    def _parts(self, model: Extension) -> list[TissuePart] | None:
        """Every trajectory beside ``model``; None where it cannot be followed."""
        frames = self.frames(model)
        if frames is None:
            return None
        whole = self._whole(model)
        return [
            TissuePart(self.scene, whole, self.layout, each, assigned, its)
            for each, assigned, its in zip(self.trajectories, self.assigned, frames, strict=True)
        ]

    def _blocks(self, frames: Sequence[TissueFrames]) -> list[Floats]:
        """Residuals (rows, frames) of every trajectory."""
        return [
            self.layout.residual(each, assigned, its, self.scene.depth_camera)
            for each, assigned, its in zip(self.trajectories, self.assigned, frames, strict=True)
        ]

    def _followed(self) -> tuple[list[TissueFrames], tuple[MeshCorrection, ...]]:
        """The frames of every trajectory as the plain model has them, its mesh's error put right.

        Raises:
            UnusableRecording: the model cannot follow a trajectory at all.
        """
        whole, fine = self._whole({}), finer(self.scene)
        effects = {c.effect.name: c.effect for c in self.candidates}
        # The finer mesh takes longest: it begins first. What ranking needs comes along.
        scenes = [self.scene] if fine is None else [fine, self.scene]
        jobs = [
            job
            for each in self.trajectories
            for job in first_jobs(self.scene, whole, each, tuple(effects.values()))
        ]
        found = Parallel(n_jobs=self._jobs, inner_max_num_threads=1)(
            [
                *(delayed(led_along)(s, whole, each) for s in scenes for each in self.trajectories),
                *(delayed(led)(job, effects) for job in jobs),
            ]
        )
        count = len(self.trajectories)
        predicted = found[: count * len(scenes)]
        plain, others = predicted[-count:], predicted[:count]
        self._first_shapes = key_shapes(found[count * len(scenes) :], count)
        self._remember(_key(before_the_camera(whole)), plain)
        frames, corrections = [], []
        for each, one, other in zip(self.trajectories, plain, others, strict=True):
            if one is None:
                raise UnusableRecording(
                    f"{each.name}: the model cannot repeat a grasp that was recorded; it has no "
                    "tissue there. Is the scene that of this recording, and are its frames right?"
                )
            coarse = frames_of(one, self.scene, whole, each)
            if all(surface is None for surface in coarse.surfaces):
                raise UnusableRecording(f"{each.name}: the model finds no equilibrium in any frame")
            finest = coarse if other is None else frames_of(other, self.scene, whole, each)
            corrections.append(MeshCorrection.between(coarse, finest))
            frames.append(corrections[-1].applied(coarse))
        return frames, tuple(corrections)

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
