"""The observed motion, repeated on a tissue model with other attachments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.estimate import Keyframe
from defras_sim.effects.extended_tissue import ExtendedSnapshot, ExtendedTissue
from defras_sim.effects.layers import Layers
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.hole_response import HoleResponse
from defras_sim.tissue.model import NothingToGrasp
from defras_sim.tissue.state import TissueState


class NotRepeatable(RuntimeError):
    """The model cannot follow the observed motion."""


class Replay:
    """Shapes of a tissue model at the keyframes, for any stiffness of the holes.

    The motion is repeated in order from the resting tissue once, by :meth:`repeat`, so that each
    frame lies on the branch of equilibria that the motion leads to. :meth:`shapes` then changes
    the holes under each frame as it stands, which costs one solve a frame.
    """

    def __init__(
        self,
        belief: Scene,
        keyframes: Sequence[Keyframe],
        elements_xyz: tuple[int, int, int] | None = None,
    ) -> None:
        self._keyframes = tuple(keyframes)
        layers = Layers.of(belief.model.extension)
        self._tissue = ExtendedTissue(belief, layers.tissue, elements_xyz=elements_xyz)
        self._rest = self._tissue.snapshot()
        self._speed_m_s = belief.motion.tissue_speed_m_s
        self._snapshots: list[ExtendedSnapshot] = []

    @property
    def rest_surface(self) -> Surface:
        """The surface where nobody holds the tissue."""
        return self._tissue.model.rest_surface

    def repeat(self, stiffness_n_per_m: Floats) -> list[TissueState]:
        """Repeat the whole motion from rest; later changes start from here.

        Raises:
            NotRepeatable: a grasp misses the tissue, or a solve fails.
        """
        tissue = self._tissue
        tissue.restore(self._rest)
        tissue.reset()
        tissue.set_hole_stiffness(stiffness_n_per_m)
        self._grasp_all(self._keyframes[0])
        states, self._snapshots = [], []
        for number, frame in enumerate(self._keyframes, 1):
            state = tissue.solve(frame.tips, frame.stamp_s)
            if not state.converged:
                raise NotRepeatable(
                    f"the model finds no equilibrium on the way to frame {number} "
                    f"of {len(self._keyframes)}"
                )
            states.append(state)
            self._snapshots.append(tissue.snapshot())
        return states

    def shapes(
        self, stiffness_n_per_m: Floats, frames: Sequence[int], *, keep: bool = False
    ) -> list[TissueState] | None:
        """Shapes at ``frames`` with other holes, each led there from its last kept shape.

        None where a solve fails. ``keep`` makes the new shapes the start of later changes.
        """
        states = []
        snapshots = list(self._snapshots)
        self._tissue.set_hole_stiffness(stiffness_n_per_m)
        for frame in frames:
            self._tissue.restore(self._snapshots[frame])
            state = self._tissue.solve(self._keyframes[frame].tips, self._keyframes[frame].stamp_s)
            if not state.converged:
                return None
            states.append(state)
            snapshots[frame] = self._tissue.snapshot()
        if keep:
            self._snapshots = snapshots
        return states

    def displaced(self, frame: int, shift_m: Mapping[str, Floats]) -> TissueState | None:
        """Shape at ``frame`` if what arms hold were ``shift_m`` (3,) off their tips, with the holes
        as they were last set; None where no equilibrium is found."""
        self._tissue.restore(self._snapshots[frame])
        tips = {
            arm: tip.moved(shift_m[arm]) if arm in shift_m else tip
            for arm, tip in self._keyframes[frame].tips.items()
        }
        state = self._tissue.solve(tips, self._keyframes[frame].stamp_s)
        return state if state.converged else None

    def response(
        self, frame: int, stiffness_n_per_m: Floats, holes: NDArray[np.int64]
    ) -> HoleResponse:
        """How a kept shape, with the holes as they were then, answers to forces at ``holes``."""
        self._tissue.set_hole_stiffness(stiffness_n_per_m)
        self._tissue.restore(self._snapshots[frame])
        return self._tissue.model.response_to_hole_forces(holes)

    def _grasp_all(self, first: Keyframe) -> None:
        """Take every grasp; an arm that has moved at the first frame took the tissue earlier."""
        moved = {
            arm: float(np.linalg.norm(first.tips[arm].position_m - tip.position_m))
            for arm, tip in first.grasp_tips.items()
        }
        # When the first arm closed nobody noted; moving at its usual speed, it was then.
        grasped_s = first.stamp_s - max(moved.values()) / self._speed_m_s
        held: dict[str, Pose] = {}
        for arm in sorted(moved, key=lambda name: -moved[name]):
            self._go(held, grasped_s)
            try:
                self._tissue.grasp(arm, first.grasp_tips[arm])
            except NothingToGrasp as miss:
                raise NotRepeatable(f"the grasp of {arm} cannot be repeated: {miss}") from miss
            held[arm] = first.tips[arm]

    def _go(self, tips: Mapping[str, Pose], time_s: float) -> None:
        if tips and not self._tissue.solve(tips, time_s).converged:
            raise NotRepeatable("the model finds no equilibrium on the way to the second grasp")
