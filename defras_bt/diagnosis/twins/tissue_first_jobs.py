"""How a model is led along the keyframes of a trajectory to know what would change there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from defras_bt.diagnosis.twins.tissue_keyframes import keyframes
from defras_bt.diagnosis.twins.tissue_part import ASIDE_M, KeyShapes
from defras_bt.diagnosis.twins.tissue_pass import KeyShape, PassJob
from defras_bt.diagnosis.twins.tissue_trajectory import Trajectory
from defras_sim.effects.effect import Effect, Extension
from defras_sim.effects.tissue_effect import TissueEffect
from defras_sim.known_way import KnownWay
from defras_sim.scene import Scene

_ASIDE = ((ASIDE_M, 0.0), (0.0, ASIDE_M))


def first_jobs(
    scene: Scene,
    model: Extension,
    trajectory: Trajectory,
    effects: Sequence[Effect],
    like: KnownWay | None,
) -> tuple[PassJob, ...]:
    """One pass with derivatives by the grips and by those of ``effects`` that act on tissue; two
    more with every jaw aside where others act on arms or grasps; none where all act on cameras.

    ``model``: all effects, the scene's included. ``like``: the way that a similar model went.
    """
    layers = {effect.layer for effect in effects}
    if not layers & {"arm", "grasp", "tissue"}:
        return ()
    tissue = tuple(effect.name for effect in effects if isinstance(effect, TissueEffect))
    chosen = keyframes(trajectory).chosen
    plain = PassJob(scene, model, trajectory, chosen, like, derivatives=False)
    ways = _ASIDE if layers & {"arm", "grasp"} else ()
    return (
        replace(plain, watched=tissue, derivatives=True),
        *(replace(plain, aside_m=way) for way in ways),
    )


def key_shapes(found: Sequence[Sequence[KeyShape | None]], trajectories: int) -> list[KeyShapes]:
    """What the jobs of every trajectory gave, by trajectory."""
    size = len(found) // trajectories
    return [KeyShapes(*found[i * size : (i + 1) * size]) for i in range(trajectories)]
