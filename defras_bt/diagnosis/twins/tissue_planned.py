"""A retraction that nobody has made yet, as the engine compares motions.

Nothing is measured in it: the camera is taken to see the tissue as the model has it. What a cause
would change is then as well known as for a recording, and exactly so for the strength in question,
since the tissue is led along with it in full.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.motions import Strengths
from defras_bt.diagnosis.noise import tolerances
from defras_bt.diagnosis.problem import Candidate, Channel, Samples, Tangent
from defras_bt.diagnosis.twins.tissue_beginnings import standing
from defras_bt.diagnosis.twins.tissue_cells import AssignedCloud
from defras_bt.diagnosis.twins.tissue_frames import frames_of, led_along
from defras_bt.diagnosis.twins.tissue_part import TissuePart
from defras_bt.diagnosis.twins.tissue_phases import PHASES, phases
from defras_bt.diagnosis.twins.tissue_plans import Plan
from defras_bt.diagnosis.twins.tissue_repeats import Wanted
from defras_bt.diagnosis.twins.tissue_signals import Layout
from defras_bt.diagnosis.twins.tissue_tangents import TissueTangents
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.camera.depth import depth_cloud_m
from defras_sim.camera.ray_caster import RayCaster
from defras_sim.effects.effect import Extension
from defras_sim.effects.tissue_effect import TissueEffect
from defras_sim.scene import Scene
from defras_sim.surface import Surface

_STRIDE = 2
"""Of a plan's instants, one in so many is a frame: neighbours say nearly the same."""


@dataclass(frozen=True)
class PlannedRetraction:
    """See :class:`defras_bt.diagnosis.motions.PlannedMotion`; tangents are known at the model that
    it was planned with."""

    sentence: str
    peak_force_n: float
    samples: Samples
    candidates: tuple[Candidate, ...]
    known: TissueTangents

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        return self.known.of(candidate)


@dataclass(frozen=True)
class Planner:
    """What plans are compared with: ``scene``, the rows of the recordings (``layout``, with their
    ``samples``), and ``jobs`` processes."""

    scene: Scene
    layout: Layout
    samples: Samples
    jobs: int

    def planned(
        self,
        plan: Plan,
        model: Extension,
        candidates: Sequence[Candidate],
        strengths: Strengths,
        rng: np.random.Generator,
    ) -> PlannedRetraction | None:
        """``plan`` beside ``model`` (all effects, the scene's included) with ``candidates`` in
        question at ``strengths``; None where the model cannot follow it."""
        way = _trajectory(plan, self.scene)
        predicted = led_along(self.scene, model, way)
        if predicted is None:
            return None
        frames = frames_of(predicted, self.scene, model, way)
        if any(surface is None for surface in frames.surfaces):
            return None
        assigned = tuple(self._seen(s, rng) for s in frames.surfaces if s is not None)
        part = TissuePart(self.scene, model, self.layout, way, assigned, frames)
        tolerance = tolerances(self.samples)
        wanted = [
            Wanted(c.key, standing(model, c), _step(c, model, strengths[c.key]))
            for c in candidates
            if isinstance(c.effect, TissueEffect)
        ]
        ways = [predicted.way]
        known = TissueTangents(
            self.scene, model, [part], candidates, tolerance, self.jobs, ways, wanted=wanted
        )
        peak = max(frames.largest_force_n, known.largest_force_n)
        samples = _samples(self.samples.channels, way)
        return PlannedRetraction(plan.sentence, peak, samples, tuple(candidates), known)

    def _seen(self, surface: Surface, rng: np.random.Generator) -> AssignedCloud:
        """What the camera would see, without its noise."""
        exact = self.scene.depth_camera.model_copy(update={"noise_sd_m": 0.0})
        points_m = depth_cloud_m(exact, surface, RayCaster(surface), rng)
        return AssignedCloud.to(surface, exact, self.layout.grid, points_m)


def _step(candidate: Candidate, model: Extension, values: Mapping[str, float]) -> dict[str, float]:
    at = standing(model, candidate)
    return {name: value - at[name] for name, value in values.items() if name in at}


def _trajectory(plan: Plan, scene: Scene) -> Trajectory:
    frames = np.arange(0, len(plan.motion), _STRIDE)
    nothing = tuple(np.zeros((0, 3)) for _ in frames)
    phase = phases(plan.motion, scene)[frames]
    return Trajectory(plan.sentence, plan.motion, frames, phase, nothing, {}, {})


def _samples(channels: tuple[Channel, ...], way: Trajectory) -> Samples:
    """Labels of the same channels in a motion that is one trajectory and one fold."""
    count, rows = len(way.frames), len(channels)
    alone = np.zeros(rows * count, np.int64)
    return Samples(
        channels,
        (way.name,),
        PHASES,
        np.tile(way.time_s, rows),
        np.repeat(np.arange(rows), count).astype(np.int64),
        alone,
        np.tile(way.phase, rows).astype(np.int64),
        alone,
    )
