"""Models led along all trajectories: each once, several side by side, the last ones remembered."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence

import numpy as np
from joblib import Parallel, delayed

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.recording_reader import UnusableRecording
from defras_bt.diagnosis.twins.tissue_correction import MeshCorrection, finer, finer_way
from defras_bt.diagnosis.twins.tissue_first_jobs import first_jobs, key_shapes
from defras_bt.diagnosis.twins.tissue_frames import (
    TissueFrames,
    before_the_camera,
    frames_of,
    led_along,
)
from defras_bt.diagnosis.twins.tissue_keyframes import keyframes
from defras_bt.diagnosis.twins.tissue_part import KeyShapes
from defras_bt.diagnosis.twins.tissue_passes import led
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.effects.effect import Effect, Extension, Values
from defras_sim.known_way import KnownWay
from defras_sim.prediction import Prediction
from defras_sim.scene import Scene

_REMEMBERED_BYTES = 500_000_000
"""Of shapes that are kept: of a default mesh along 10 s, about fifty predictions, more than any
round of full fits goes back to."""


class LedModels:
    """Models of ``scene`` along ``trajectories``, on ``jobs`` processes. Those that differ in how
    tissue is seen only, by camera and clock, are led along once.

    ``plain``: frames of every trajectory as the plain model has them, the error of its mesh put
    right. ``shapes``: its keyframes, with what ``effects`` would change there; none without
    effects.

    Raises:
        UnusableRecording: the plain model cannot follow a trajectory at all.
    """

    def __init__(
        self,
        scene: Scene,
        trajectories: Sequence[Trajectory],
        effects: Mapping[str, Effect],
        jobs: int,
    ) -> None:
        self._scene, self._trajectories, self._jobs = scene, tuple(trajectories), jobs
        self._led: OrderedDict[str, tuple[Prediction, ...] | None] = OrderedDict()
        plain, corrections, self.shapes = self._begin(effects)
        self._corrections = {frozenset[str](): corrections}
        """By the effects, beside those of the scene, of the model that they were computed for."""
        self._corrected = {frozenset[str](): self._key({})}
        """Which model that was, by the same."""
        self.plain = _applied(corrections, plain)

    def whole(self, model: Extension) -> dict[str, Values]:
        """``model`` with the effects that the scene itself adopts, or in their place."""
        return {**self._scene.model.extension, **model}

    def frames(self, model: Extension) -> tuple[TissueFrames, ...] | None:
        """What ``model`` says of the frames of every trajectory, the error of its mesh put right;
        None where it cannot."""
        found = self.uncorrected(model)
        return None if found is None else _applied(self._corrections_for(model), found)

    def uncorrected(self, model: Extension) -> tuple[TissueFrames, ...] | None:
        """As :meth:`frames`, with the error of the mesh."""
        predictions = self._led_along(model)
        if predictions is None:
            return None
        whole, both = self.whole(model), zip(predictions, self._trajectories, strict=True)
        return tuple(frames_of(one, self._scene, whole, each) for one, each in both)

    def correct_at(self, model: Extension) -> bool:
        """Compute the mesh's error anew for ``model``, and put it right so in every model that has
        at least its effects; whether there is anything new. Where the finer mesh cannot follow,
        the error stays that of a model with fewer effects. From now on models are guided by the
        way of this one."""
        fine, whole, effects = finer(self._scene), self.whole(model), self._effects_of(model)
        predicted = self._led_along(model)
        if predicted is None:
            return False
        self._guide = predicted
        if fine is None or self._corrected.get(effects) == self._key(model):
            return False
        ways = zip(self._trajectories, self.ways(model), strict=True)
        refined = Parallel(n_jobs=self._jobs, inner_max_num_threads=1)(
            delayed(led_along)(fine, whole, each, _sparse(each), finer_way(way, self._scene, fine))
            for each, way in ways
        )
        if any(other is None for other in refined):
            return False
        self._corrected[effects] = self._key(model)
        self._corrections[effects] = tuple(
            self._correction(model, one, other, each)
            for one, other, each in zip(predicted, refined, self._trajectories, strict=True)
        )
        return True

    def _effects_of(self, model: Extension) -> frozenset[str]:
        """What distinguishes ``model`` from the plain one: effects that it changes."""
        plain, whole = before_the_camera(self.whole({})), before_the_camera(self.whole(model))
        return frozenset(name for name in whole if whole[name] != plain.get(name))

    def _corrections_for(self, model: Extension) -> tuple[MeshCorrection, ...]:
        """Those of the largest part of ``model`` for which the error was computed."""
        names = self._effects_of(model)
        return self._corrections[max((k for k in self._corrections if k <= names), key=len)]

    def _led_along(self, model: Extension) -> tuple[Prediction, ...] | None:
        key = self._key(model)
        if key not in self._led:
            self._lead_along({key: model})
        self._led.move_to_end(key)
        return self._led[key]

    def ways(self, model: Extension) -> tuple[KnownWay | None, ...]:
        """Where the nodes of ``model``, or of the one that guides, went in every trajectory."""
        led = self._led.get(self._key(model)) or self._guide
        return tuple(each.way for each in led)

    def foresee(self, models: Sequence[Extension]) -> None:
        """Lead several models along at once, before they are asked for one by one."""
        wanted = {self._key(model): model for model in models if self._key(model) not in self._led}
        if self._jobs > 1 and len(wanted) * len(self._trajectories) > 1:
            self._lead_along(wanted)

    def _key(self, model: Extension) -> str:
        return key_of(before_the_camera(self.whole(model)))

    def _lead_along(self, models: Mapping[str, Extension]) -> None:
        """Predict tissue and arms of ``models`` by key, side by side, and remember them."""
        near = [each.way for each in self._guide]
        work = [
            (self.whole(model), each, way)
            for model in models.values()
            for each, way in zip(self._trajectories, near, strict=True)
        ]
        jobs = self._jobs if len(work) > 1 else 1
        found = Parallel(n_jobs=jobs, inner_max_num_threads=1)(
            delayed(led_along)(self._scene, whole, each, None, way) for whole, each, way in work
        )
        count = len(self._trajectories)
        for number, key in enumerate(models):
            self._remember(key, found[count * number : count * (number + 1)])
        self._forget(len(models))

    def _remember(self, key: str, predictions: Sequence[Prediction | None]) -> None:
        followed = tuple(p for p in predictions if p is not None)
        self._led[key] = followed if len(followed) == len(predictions) else None

    def _forget(self, newest: int) -> None:
        """Let go of models that were not asked for longest, where all take too much memory; never
        of the ``newest``, which are about to be asked for."""
        sizes = {key: sum(p.nbytes for p in led or ()) for key, led in self._led.items()}
        total = sum(sizes.values())
        for key in list(self._led)[: max(len(self._led) - newest, 0)]:
            if total <= _REMEMBERED_BYTES:
                break
            total -= sizes[key]
            del self._led[key]

    def _begin(
        self, effects: Mapping[str, Effect]
    ) -> tuple[list[TissueFrames], tuple[MeshCorrection, ...], list[KeyShapes]]:
        """The plain model's frames, what a finer mesh would change of them, and shapes.

        What the plain model says is a guide for all that comes after; of that the finer mesh takes
        longest, and begins first.
        """
        scene, whole, fine = self._scene, self.whole({}), finer(self._scene)
        predicted = list(
            Parallel(n_jobs=self._jobs, inner_max_num_threads=1)(
                delayed(led_along)(scene, whole, each) for each in self._trajectories
            )
        )
        plain = [
            _followed(one, scene, whole, each)
            for one, each in zip(predicted, self._trajectories, strict=True)
        ]
        self._remember(self._key({}), predicted)
        self._guide = tuple(each for each in predicted if each is not None)
        ways = list(zip(self._trajectories, self.ways({}), strict=True))
        refined = [
            delayed(led_along)(fine, whole, each, _sparse(each), finer_way(way, scene, fine))
            for each, way in ways
            if fine is not None
        ]
        jobs = [
            delayed(led)(job, effects)
            for each, way in ways
            for job in first_jobs(scene, whole, each, tuple(effects.values()), way)
        ]
        found = Parallel(n_jobs=self._jobs, inner_max_num_threads=1)([*refined, *jobs])
        others = found[: len(refined)] or [None] * len(self._trajectories)
        corrections = tuple(
            self._correction({}, one, other, each)
            for one, other, each in zip(predicted, others, self._trajectories, strict=True)
        )
        return plain, corrections, key_shapes(found[len(refined) :], len(self._trajectories))

    def _correction(
        self,
        model: Extension,
        coarse: Prediction,
        fine: Prediction | None,
        trajectory: Trajectory,
    ) -> MeshCorrection:
        """Of the same instants on both meshes, whatever delay the camera has."""
        unseen = before_the_camera(self.whole(model))
        one = frames_of(coarse, self._scene, unseen, trajectory)
        if fine is None:
            return MeshCorrection.none(one)
        other = frames_of(fine, self._scene, unseen, trajectory)
        return MeshCorrection.between(one, other, keyframes(trajectory))


def _applied(
    corrections: Sequence[MeshCorrection], frames: Sequence[TissueFrames]
) -> tuple[TissueFrames, ...]:
    return tuple(c.applied(each) for c, each in zip(corrections, frames, strict=True))


def _followed(
    prediction: Prediction | None, scene: Scene, whole: Extension, trajectory: Trajectory
) -> TissueFrames:
    """The frames of the plain model, which has to be able to follow."""
    if prediction is None:
        raise UnusableRecording(
            f"{trajectory.name}: the model cannot repeat a grasp that was recorded; it has no "
            "tissue there. Is the scene that of this recording, and are its frames right?"
        )
    frames = frames_of(prediction, scene, whole, trajectory)
    if all(surface is None for surface in frames.surfaces):
        raise UnusableRecording(f"{trajectory.name}: the model finds no equilibrium in any frame")
    return frames


def _sparse(trajectory: Trajectory) -> Integers:
    """The instants of the keyframes, at which a finer mesh is solved."""
    return np.asarray(trajectory.frames[keyframes(trajectory).chosen])


def key_of(model: Extension) -> str:
    """A name of ``model`` by its values."""
    return repr(sorted((name, sorted(values.items())) for name, values in model.items()))
