"""One way of a model along the keyframes of a trajectory, with derivatives of all it shows there.

Effects of the tissue go along at their null values, so that those with a memory know at every
keyframe what they would have done by then; implicit differentiation then gives what each of them
changes, and how a shifted grip would show, for the price of one solved tissue.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_bt.diagnosis.problem import Integers
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.effects.effect import Effect, Extension, Values
from defras_sim.effects.extended_tissue import ExtendedTissue
from defras_sim.effects.layers import Layers
from defras_sim.effects.tissue_effect import Direction, TissueEffect
from defras_sim.geometry import Floats, Pose
from defras_sim.held_motion import HeldMotion
from defras_sim.known_way import KnownWay
from defras_sim.scene import Scene
from defras_sim.tissue.parameters import Parameter, TipMotion
from defras_sim.tissue.sensitivity import Sensitivities
from defras_sim.tissue.state import TissueState

_GIVING_ROUNDS = 3

Place = tuple[str, str, tuple[tuple[str, float], ...]]
"""An effect, one of its parameters, and where its other parameters stand."""


@dataclass(frozen=True)
class KeyShape:
    """One solved keyframe; derivatives are per unit of a parameter, in tissue coordinates.

    ``vertices_m`` (vertices, 3), ``forces_n`` by arm (3,). ``shift_by`` by holding arm
    (vertices, 3, 6): a translation and a turn of the held patch. ``effects_by`` (vertices, 3, p)
    for the p ``places``; the same for forces: by holding arm (3, 6) and (3, p), of the jaw named
    first when the patch of the one named second moves. None where the model could not follow.
    """

    vertices_m: Floats
    forces_n: Mapping[str, Floats]
    shift_by: Mapping[str, Floats]
    force_by_shift: Mapping[tuple[str, str], Floats]
    places: tuple[Place, ...]
    effects_by: Floats
    force_by_effects: Mapping[str, Floats]


@dataclass(frozen=True)
class PassJob:
    """What a process needs to know.

    ``model``: all effects, the scene's included. ``chosen`` (k,): keyframes by index of the frame.
    ``like``: the way that a similar model went, which saves work.
    ``watched``: effects of the tissue that go along. ``aside_m`` (2,): how far beside its place
    each jaw takes the tissue, and keeps it.
    """

    scene: Scene
    model: Extension
    trajectory: Trajectory
    chosen: Integers
    like: KnownWay | None = None
    watched: tuple[str, ...] = ()
    aside_m: tuple[float, float] = (0.0, 0.0)
    derivatives: bool = True


def run_pass(job: PassJob, known: Mapping[str, Effect]) -> tuple[KeyShape | None, ...]:
    """The keyframes in order; ``known`` are the effects by name.

    Raises:
        NothingToGrasp: a jaw takes tissue where the model has none.
    """
    scene, layers = job.scene, Layers.of(job.model)
    watched: dict[str, Values] = {
        name: {} for name in job.watched if isinstance(known[name], TissueEffect)
    }
    tissue = ExtendedTissue(scene, {**watched, **layers.tissue})
    held = HeldMotion(scene, layers)
    motion = job.trajectory.motion
    wanted = job.trajectory.frames[job.chosen]
    stops = set(wanted.tolist())
    for arm in motion.arms.values():
        stops |= set((np.flatnonzero(arm.grasped[1:] != arm.grasped[:-1]) + 1).tolist())
    shapes: dict[int, KeyShape | None] = {}
    aside = np.array([*job.aside_m, 0.0])
    solved_s = float(motion.time_s[0])
    state = tissue.solve({}, solved_s)
    holding: list[str] = []
    for row in range(int(wanted[-1]) + 1):
        time_s = float(motion.time_s[row])
        held.follow(motion.tips(row), time_s)
        if row not in stops:
            continue
        for name, arm in motion.arms.items():
            if arm.grasped[row] and name not in holding:
                tissue.grasp(name, held.take(name, time_s).moved(aside))
                holding.append(name)
            elif name in holding and not arm.grasped[row]:
                tissue.release(name)
                held.let_go(name)
                holding.remove(name)
        change_m = None if job.like is None else job.like.change_m(solved_s, time_s)
        state = _solved(tissue, held, state, time_s, aside, change_m)
        solved_s = time_s
        shapes[row] = None
        if row in stops and state.converged:
            shapes[row] = _shape(tissue, state, holding, tuple(watched), job.derivatives)
    return tuple(shapes[int(row)] for row in wanted)


def _solved(
    tissue: ExtendedTissue,
    held: HeldMotion,
    state: TissueState,
    time_s: float,
    aside: Floats,
    change_m: Floats | None,
) -> TissueState:
    """The equilibrium at ``time_s``; an arm that gives way rests where tissue and arm agree."""
    for _ in range(_GIVING_ROUNDS):
        jaws: dict[str, Pose] = {
            arm: jaw.moved(aside) for arm, jaw in held.held(time_s, state.grasp_forces_n).items()
        }
        state = tissue.solve(jaws, time_s, change_m)
        change_m = None
        if not held.gives or not state.converged:
            break
    return state


def _shape(
    tissue: ExtendedTissue,
    state: TissueState,
    holding: Sequence[str],
    watched: Sequence[str],
    derivatives: bool,
) -> KeyShape:
    forces = {arm: np.asarray(force) for arm, force in state.grasp_forces_n.items()}
    vertices = state.surface.vertices_m
    nothing = KeyShape(vertices, forces, {}, {}, (), np.zeros((*vertices.shape, 0)), {})
    if not derivatives:
        return nothing
    directions = [(name, each) for name in watched for each in tissue.directions(name)]
    tips = [TipMotion(arm) for arm in holding]
    parameters: list[Parameter] = list(tips)
    for _, direction in directions:
        parameters += [p for p in direction.by if p not in parameters]
    if not parameters:
        return nothing
    by = tissue.model.sensitivities(parameters)
    mixing = _mixing([direction for _, direction in directions], by)
    return KeyShape(
        vertices,
        forces,
        {tip.arm: by.surface_by[:, :, by.columns[tip]] for tip in tips},
        {
            (arm, tip.arm): by.grasp_forces_by[arm][:, by.columns[tip]]
            for arm in holding
            for tip in tips
        },
        tuple((n, d.parameter, tuple(sorted(d.at.items()))) for n, d in directions),
        by.surface_by @ mixing,
        {arm: by.grasp_forces_by[arm] @ mixing for arm in holding},
    )


def _mixing(directions: Sequence[Direction], by: Sensitivities) -> Floats:
    """Matrix (columns, p) from the tissue's own parameters to those of effects."""
    columns = by.nodes_by.shape[2]
    mixing = np.zeros((columns, len(directions)))
    for index, direction in enumerate(directions):
        for parameter, share in direction.by.items():
            mixing[by.columns[parameter], index] += share
    return mixing
