"""From what one arm was last heard to say to what the executive observes of it."""

from __future__ import annotations

from defras_bt.dvrk.arm_frames import ArmFrames
from defras_bt.dvrk.jaw_grip import JawGrip
from defras_bt.dvrk.settings import ArmSetup
from defras_bt.dvrk.streaming.drive import ArmSnapshot
from defras_bt.dvrk.world_clock import WorldClock
from defras_sim.geometry import Pose
from defras_sim.worlds.protocol import JAW_CLOSED_RAD, ArmObservation


class ArmReader:
    """Knows one arm's frames, and whether its jaw holds something."""

    def __init__(self, setup: ArmSetup, tissue_from_base: Pose, *, senses_force: bool) -> None:
        """``senses_force``: whether the scene counts on a force sensor; what an arm makes of its
        motors' currents is too rough to be taken for one."""
        self.frames = ArmFrames.of(setup, tissue_from_base)
        self._closed_rad = setup.closed_rad
        self._grip = JawGrip(setup.closed_rad, setup.holds_above_rad)
        self._senses_force = senses_force

    def jaw_goal_rad(self, wanted_rad: float | None) -> float | None:
        """Where the jaw is sent for an opening of ``wanted_rad``; closed is as the set-up says."""
        closes = wanted_rad is not None and wanted_rad <= JAW_CLOSED_RAD
        return self._closed_rad if closes else wanted_rad

    def read(self, seen: ArmSnapshot, clock: WorldClock) -> ArmObservation:
        """The observation, stamped as its poses are. Older ones of its messages the stream has
        judged, and said so."""
        measured, setpoint = seen.measured, seen.setpoint
        jaw, jaw_setpoint = seen.jaw, seen.jaw_setpoint
        assert measured is not None
        assert setpoint is not None
        assert jaw is not None
        assert jaw_setpoint is not None
        frames, jaw_rad = self.frames, float(jaw.position[0])
        force_n = None
        if seen.wrench is not None and self._senses_force:
            # The wrench is what the arm feels; what it exerts is the opposite.
            force_n = -frames.force_n(seen.wrench.force_n, measured.pose)
        joints, setpoint_joints = seen.joints, seen.setpoint_joints
        return ArmObservation(
            stamp_s=clock.world_s(measured.stamp_s),
            tissue_from_tip=frames.tissue_from_tip(measured.pose),
            setpoint_tissue_from_tip=frames.tissue_from_tip(setpoint.pose),
            jaw_rad=jaw_rad,
            grasped=self._grip.look(jaw_rad, float(jaw_setpoint.position[0])),
            joints=None if joints is None else joints.position,
            setpoint_joints=None if setpoint_joints is None else setpoint_joints.position,
            force_n=force_n,
            goal_tissue_from_tip=None if seen.goal is None else frames.tip_in_tissue(seen.goal),
        )


def is_heard(seen: ArmSnapshot) -> bool:
    """Whether everything that an observation needs was heard at least once."""
    needed = (seen.measured, seen.setpoint, seen.jaw, seen.jaw_setpoint, seen.state)
    return not any(heard is None for heard in needed)
