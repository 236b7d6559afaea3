"""From what an arm reports in its own frame to the tip in the tissue frame, and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from defras_bt.dvrk.settings import ArmSetup
from defras_bt.dvrk.streaming.tip_stream import TipVelocity
from defras_sim.geometry import Floats, Pose


@dataclass(frozen=True)
class ArmFrames:
    """``tissue_from_base`` is the registration of the frame that the arm's poses come in;
    ``reported_from_tip`` leads along the jaw from the point that the driver calls the tip."""

    tissue_from_base: Pose
    reported_from_tip: Pose

    @staticmethod
    def of(setup: ArmSetup, tissue_from_base: Pose) -> ArmFrames:
        return ArmFrames(tissue_from_base, Pose(np.array([0.0, 0.0, setup.reported_to_tip_m])))

    def tissue_from_tip(self, base_from_reported: Pose) -> Pose:
        return self.tissue_from_base @ base_from_reported @ self.reported_from_tip

    def tip_in_tissue(self, base_from_tip: Pose) -> Pose:
        """As :meth:`tissue_from_tip`, of a pose of the tip itself."""
        return self.tissue_from_base @ base_from_tip

    def velocity(self, linear_m_s: Floats, angular_rad_s: Floats) -> TipVelocity:
        """A tip's velocity of the tissue frame in the arm's own."""
        turn = self.tissue_from_base.rotation.T
        return TipVelocity(turn @ linear_m_s, turn @ angular_rad_s)

    def force_n(self, force_n: Floats, reported: Pose) -> Floats:
        """A force (3,) along the axes of the reported frame, as ``body/`` topics give it, in the
        tissue frame."""
        return (self.tissue_from_base @ reported).rotation @ force_n
