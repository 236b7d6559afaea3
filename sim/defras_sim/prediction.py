"""What the twin says of a whole recorded motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defras_sim.effects.camera_layer import CameraLayer
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.known_way import KnownWay
from defras_sim.recorded_motion import RecordedMotion
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.state import TissueState
from defras_sim.twin import Twin

Mask = NDArray[np.bool_]

# A solve that leads nowhere takes seconds, and the next one leads from there.
MOST_LOST = 3


@dataclass(frozen=True)
class Prediction:
    """What tissue and arms do over a motion, at ``time_s`` (m,): its instants ``rows`` (m,).

    ``states`` are the tissue's, stale where the model could not follow. ``measured`` is by arm
    where the encoders should say that its tip is (tissue_from_tip), at the instants ``read`` (r,).
    Clouds stamped ``delay_s`` later, seen through ``camera``, show these states.
    """

    rows: Integers
    time_s: Floats
    states: tuple[TissueState, ...]
    read: Integers
    measured: Mapping[str, tuple[Pose, ...]]
    camera: CameraLayer
    delay_s: float

    @cached_property
    def vertices_m(self) -> Floats:
        """Surface vertices (m, vertices, 3), NaN where the state is stale."""
        shape = self.states[0].surface.vertices_m.shape
        lost = np.full(shape, np.nan)
        return np.stack([s.surface.vertices_m if s.converged else lost for s in self.states])

    @cached_property
    def way(self) -> KnownWay | None:
        """Where its nodes went, for models that differ little; None where it could not follow."""
        known = [index for index, state in enumerate(self.states) if state.converged]
        if not known:
            return None
        return KnownWay(self.time_s[known], np.stack([self.states[i].nodes_m for i in known]))

    @property
    def nbytes(self) -> int:
        """About how much memory it takes: the shapes, and once more where they were asked for."""
        return sum(2 * s.nodes_m.nbytes + 2 * s.surface.vertices_m.nbytes for s in self.states)

    def force_n(self, arm: str) -> Floats:
        """Force (m, 3) of a jaw on the tissue; 0 without a grip, NaN where the state is stale."""
        none, lost = np.zeros(3), np.full(3, np.nan)
        return np.array(
            [s.grasp_forces_n.get(arm, none) if s.converged else lost for s in self.states]
        )

    def force_between_n(self, arm: str, time_s: Floats) -> Floats:
        """Force (k, 3) of a jaw on the tissue at other times (k,), linearly between instants."""
        known = self.force_n(arm)
        return np.stack([np.interp(time_s, self.time_s, known[:, axis]) for axis in range(3)], 1)

    def surface_shown(self, stamp_s: float) -> Surface:
        """The surface (vertices NaN where stale) that a cloud of this stamp shows.

        Between two instants it is interpolated; beyond the first and the last it is theirs.
        """
        first = self.states[0].surface
        time_s = stamp_s - self.delay_s
        after = int(np.clip(np.searchsorted(self.time_s, time_s), 1, len(self.time_s) - 1))
        if len(self.time_s) == 1:
            vertices_m = self.vertices_m[0]
        else:
            start_s, end_s = self.time_s[after - 1 : after + 1]
            share = float(np.clip((time_s - start_s) / (end_s - start_s), 0.0, 1.0))
            before_m, then_m = self.vertices_m[after - 1 : after + 1]
            vertices_m = before_m + share * (then_m - before_m) if share < 1.0 else then_m
        return Surface(vertices_m, first.triangles, first.upper, first.rest_xy_m)


def predict(
    scene: Scene,
    motion: RecordedMotion,
    rows: Integers | None = None,
    read: Integers | None = None,
    like: KnownWay | None = None,
) -> Prediction:
    """What the twin of ``scene``, with the effects it adopts, does along ``motion``.

    The arms follow every instant; the tissue is solved at ``rows`` of them (all of them, where
    none are given), around what clouds of their stamps show, and where a grip begins or ends. The
    encoders are read at ``read`` (where the tissue is solved, where none are given).
    ``like`` is the way that a similar model went, on the same mesh; it saves work.
    Effects of history are integrated between solved instants. A model that was lost three times in
    a row is not asked again until a grip begins or ends.

    Raises:
        NothingToGrasp: a jaw takes tissue where the twin has none.
        ValueError: the scene adopts what no tissue can have, or the motion has arms that the scene
            has not.
    """
    unknown = set(motion.arms) - set(scene.arms)
    if unknown:
        raise ValueError(
            f"the motion is one of {', '.join(sorted(motion.arms))}; the scene {scene.name} has "
            f"the arms {', '.join(scene.arms)}"
        )
    layers = Layers.of(scene.model.extension)
    wanted = _wanted(motion, rows, layers.delay_s)
    solved = np.flatnonzero(wanted)
    read = solved if read is None else np.unique(read)
    last = max(int(rows.max(initial=-1)) for rows in (solved, read))
    asked = np.isin(np.arange(last + 1), read)
    twin = Twin(scene, start_s=float(motion.time_s[0]))
    states: list[TissueState] = []
    measured: dict[str, list[Pose]] = {name: [] for name in motion.arms}
    lost = 0
    solved_s = float(motion.time_s[0])
    for row in range(last + 1):
        time_s, tips = float(motion.time_s[row]), motion.tips(row)
        if not wanted[row]:
            twin.follow(tips, time_s)
        else:
            if _regripped(twin, motion, row):
                lost = 0
            if lost < MOST_LOST:
                change_m = None if like is None else like.change_m(solved_s, time_s)
                states.append(twin.track(tips, time_s, change_m))
                lost = 0 if states[-1].converged else lost + 1
                solved_s = time_s
            else:
                twin.follow(tips, time_s)
                states.append(states[-1])
        if asked[row]:
            for name, poses in measured.items():
                poses.append(twin.measured(name))
    return Prediction(
        rows=solved,
        time_s=motion.time_s[solved],
        states=tuple(states),
        read=read,
        measured={name: tuple(poses) for name, poses in measured.items()},
        camera=CameraLayer(scene.depth_camera, layers.camera),
        delay_s=layers.delay_s,
    )


def _regripped(twin: Twin, motion: RecordedMotion, row: int) -> bool:
    """Let ``twin`` hold what is held at an instant of ``motion``; whether that is something else
    than before."""
    before, time_s = twin.holding, float(motion.time_s[row])
    for name, arm in motion.arms.items():
        if arm.grasped[row] and name not in before:
            twin.grasp(name, arm.tip(row), time_s)
        elif name in before and not arm.grasped[row]:
            twin.release(name, time_s)
    return twin.holding != before


def _wanted(motion: RecordedMotion, rows: Integers | None, delay_s: float) -> Mask:
    """The instants (n,) of ``motion`` at which the tissue is to be solved."""
    if rows is None:
        return np.ones(len(motion), bool)
    wanted = np.zeros(len(motion), bool)
    wanted[rows] = True
    if delay_s > 0.0:
        after = np.searchsorted(motion.time_s, motion.time_s[rows] - delay_s)
        wanted[after] = wanted[np.maximum(after - 1, 0)] = True
    for arm in motion.arms.values():
        wanted[1:] |= arm.grasped[1:] != arm.grasped[:-1]
        wanted[0] |= arm.grasped[0]
    return wanted
