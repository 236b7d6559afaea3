"""What every candidate would change in the recordings, near one model.

Each layer of the twin has its own way. Effects of the camera move points, of the clock whole
frames, both known at once for every frame. Effects of arm and grasp move the held patch, effects
of the tissue its equilibrium: those are differentiated at a few keyframes and interpolated between
them. What cannot be differentiated is led along once with the effect and once without.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from defras_bt.diagnosis.problem import Candidate, Tangent
from defras_bt.diagnosis.twins.tissue_beginnings import (
    FINE_ONSETS,
    LATE_STEPS,
    ONSET,
    ONSETS,
    SLACK,
    inwards,
    is_there,
    standing,
)
from defras_bt.diagnosis.twins.tissue_first_jobs import first_jobs, key_shapes
from defras_bt.diagnosis.twins.tissue_gains import Gains
from defras_bt.diagnosis.twins.tissue_onsets import Onsets
from defras_bt.diagnosis.twins.tissue_part import KeyShapes, TissuePart, with_values
from defras_bt.diagnosis.twins.tissue_passes import run_passes
from defras_bt.diagnosis.twins.tissue_repeats import Wanted, repeats, wanted_of
from defras_sim.effects.effect import Extension
from defras_sim.effects.tissue_effect import TissueEffect
from defras_sim.geometry import Floats
from defras_sim.known_way import KnownWay
from defras_sim.scene import Scene


class TissueTangents:
    """Tangents of all candidates at ``model``, the effects that the scene has included."""

    def __init__(
        self,
        scene: Scene,
        model: Extension,
        parts: Sequence[TissuePart],
        candidates: Sequence[Candidate],
        tolerance: Floats,
        jobs: int,
        ways: Sequence[KnownWay | None],
        shapes: Sequence[KeyShapes] = (),
        wanted: Sequence[Wanted] | None = None,
    ) -> None:
        """``tolerance`` (rows,): what is small in each row. ``jobs`` processes work at once.
        ``ways``: where the model's nodes, or those of a similar one, went in every part.
        ``shapes`` of every trajectory, where the model was led along already. ``wanted``: what is
        led along in full; where not given, what derivatives do not tell enough of."""
        self._scene, self._model, self._parts = scene, model, tuple(parts)
        self._effects = {c.effect.name: c.effect for c in candidates}
        self._shapes = list(shapes) or self._led_along(ways, jobs)
        gains = Gains(self._parts, tolerance)
        self._onsets = Onsets(self._parts, gains)
        if wanted is None:
            wanted = [
                one
                for candidate in candidates
                if isinstance(candidate.effect, TissueEffect)
                for one in wanted_of(
                    candidate, model, tuple(self._differentiated(candidate)), gains
                )
            ]
        self._repeats = repeats(scene, model, self._parts, candidates, wanted, ways, jobs)

    @property
    def largest_force_n(self) -> float:
        """Of any jaw at a keyframe, with any effect that was led along in full."""
        led = [shapes.plain for shapes in self._shapes]
        led += [shapes for repeat in self._repeats for shapes in repeat.shapes]
        solved = [shape for shapes in led for shape in shapes if shape is not None]
        forces = [float(np.linalg.norm(f)) for shape in solved for f in shape.forces_n.values()]
        return max(forces, default=0.0)

    def of(self, candidate: Candidate) -> tuple[Tangent, ...]:
        """All ways in which ``candidate`` could begin, or go on where the model has it."""
        layer = candidate.effect.layer
        if layer == "camera":
            return (self._smooth(candidate, self._camera),)
        if layer == "clock":
            return tuple(self._late(candidate))
        if layer in ("arm", "grasp"):
            return tuple(self._carried(candidate))
        return (*self._differentiated(candidate), *self._repeated(candidate))

    def _camera(self, effect: str, values: Mapping[str, float]) -> Floats:
        changed = with_values(self._model, effect, values)
        return self._over_parts(lambda part, _: part.camera(changed))

    def _carry(self, effect: str, values: Mapping[str, float]) -> Floats:
        changed = with_values(self._model, effect, values)
        return self._over_parts(lambda part, shapes: part.carried(changed, shapes))

    def _smooth(
        self, candidate: Candidate, change: Callable[[str, Mapping[str, float]], Floats]
    ) -> Tangent:
        """One column for each free parameter, a step of it away from where it stands."""
        at = standing(self._model, candidate)
        steps, columns = [], []
        for p in candidate.free:
            if not p.strength and not is_there(self._model, candidate):
                continue
            step = inwards(p, at[p.name])
            columns.append(change(candidate.effect.name, {**at, p.name: at[p.name] + step}))
            steps.append({p.name: step})
        return Tangent(at, tuple(steps), np.stack(columns, axis=1))

    def _late(self, candidate: Candidate) -> Iterator[Tangent]:
        at = standing(self._model, candidate)
        effect = candidate.effect.name
        for p in candidate.free:
            for times in LATE_STEPS:
                step = times * inwards(p, at[p.name])
                column = self._over_parts(lambda part, _, late_s=step: part.late(late_s))
                yield Tangent(at, ({p.name: step},), column[:, None])
        if not candidate.free:
            raise ValueError(f"{effect} has no free parameter")

    def _carried(self, candidate: Candidate) -> Iterator[Tangent]:
        name, at = candidate.effect.name, standing(self._model, candidate)
        onset = ONSET.get(name)
        if is_there(self._model, candidate) or (onset is None and name not in SLACK):
            yield self._smooth(candidate, self._carry)
            return
        (p, *_) = [p for p in candidate.free if p.strength]
        for times in SLACK.get(name, (1.0,)):
            step = times * p.step
            there = {**at, p.name: at[p.name] + step}
            if onset is None:
                yield Tangent(at, ({p.name: step},), self._carry(name, there)[:, None])
                continue

            def carried(
                start: float, onset: str = onset, there: dict[str, float] = there
            ) -> Floats:
                return self._carry(name, {**there, onset: start})

            for start, column in self._onsets.columns(ONSETS, carried):
                yield Tangent({**at, onset: start}, ({p.name: step},), column[:, None])

    def _differentiated(self, candidate: Candidate) -> Iterator[Tangent]:
        """One tangent for each place at which the effect could begin."""
        effect = candidate.effect
        begun_at = standing(self._model, candidate)
        free = {p.name: p for p in candidate.free}
        per_part = [
            part.differentiated(shapes, effect.name)
            for part, shapes in zip(self._parts, self._shapes, strict=True)
        ]
        everywhere: dict[tuple[tuple[str, float], ...], dict[str, None]] = {}
        for found in per_part:
            for _, parameter, where in found:
                if parameter in free:
                    everywhere.setdefault(where, {})[parameter] = None
        for where, parameters in everywhere.items():
            at = {**begun_at, **{n: v for n, v in where if n in free}}
            blocks = {
                parameter: self._joined(
                    [found.get((effect.name, parameter, where)) for found in per_part]
                )
                for parameter in parameters
            }
            steps = tuple({name: inwards(free[name], at[name])} for name in parameters)
            columns = np.stack(
                [blocks[name] * step[name] for name, step in zip(parameters, steps, strict=True)],
                axis=1,
            )
            onset = ONSET.get(effect.name)
            if onset is None or is_there(self._model, candidate):
                yield Tangent(at, steps, columns)
                continue
            for start in self._onsets.spread(ONSETS):
                yield Tangent({**at, onset: start}, steps, self._from(start)[:, None] * columns)

    def _repeated(self, candidate: Candidate) -> Iterator[Tangent]:
        for repeat in self._repeats:
            if repeat.wanted.key != candidate.key:
                continue
            blocks = [
                part.repeated(shapes.plain, other).ravel()
                for part, shapes, other in zip(
                    self._parts, self._shapes, repeat.shapes, strict=True
                )
            ]
            at, step, whole = repeat.wanted.at, repeat.wanted.step, np.concatenate(blocks)
            onset = ONSET.get(candidate.effect.name)
            if onset is None or is_there(self._model, candidate):
                yield Tangent(at, (step,), whole[:, None])
                continue

            def begun(start: float, whole: Floats = whole) -> Floats:
                return self._from(start) * whole

            for start, column in self._onsets.columns(FINE_ONSETS, begun):
                yield Tangent({**at, onset: start}, (step,), column[:, None])

    def _from(self, start_s: float) -> Floats:
        """1 in rows (n,) from ``start_s`` on, 0 before."""
        begun = [
            np.broadcast_to(part.trajectory.time_s >= start_s, part.shape).ravel()
            for part in self._parts
        ]
        return np.concatenate(begun).astype(float)

    def _led_along(self, ways: Sequence[KnownWay | None], jobs: int) -> list[KeyShapes]:
        """The model led along every trajectory: with derivatives, and with grips aside."""
        work = [
            job
            for part, way in zip(self._parts, ways, strict=True)
            for job in first_jobs(
                self._scene, self._model, part.trajectory, tuple(self._effects.values()), way
            )
        ]
        return key_shapes(run_passes(work, self._effects, jobs), len(self._parts))

    def derivatives(self, candidate: Candidate) -> dict[str, Floats]:
        """Change (n,) per unit of those free parameters of a candidate that the model has, of which
        it is known without leading anything along again."""
        found: dict[str, Floats] = {}
        if not is_there(self._model, candidate):
            return found
        for tangent in self.of(candidate):
            for step, column in zip(tangent.steps, tangent.columns.T, strict=True):
                ((name, size),) = step.items()
                found[name] = column / size
        return found

    def _over_parts(self, change: Callable[..., Floats]) -> Floats:
        blocks = [
            change(part, shapes) for part, shapes in zip(self._parts, self._shapes, strict=True)
        ]
        return np.concatenate([block.ravel() for block in blocks])

    def _joined(self, blocks: Sequence[Floats | None]) -> Floats:
        return np.concatenate(
            [
                np.zeros(int(np.prod(part.shape))) if block is None else block.ravel()
                for part, block in zip(self._parts, blocks, strict=True)
            ]
        )
