"""When a jaw presses held tissue onto the bed: forces that tell nothing of the tissue's causes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defras_bt.diagnosis.problem import Integers
from defras_sim.geometry import Floats
from defras_sim.recorded_motion import ArmMotion

LOW_M = 0.002
"""Over where the tissue was taken: lower than this, what is held reaches the bed."""
PRESSED_N = 0.005
"""Downwards: what holds held tissue elsewhere is smaller there."""
_BEYOND_NOISE = 4.0
"""Standard deviations: of noise, as many readings point down as up."""
PRESSED_REMARK = (
    "Left out: {count} readings of forces with which a jaw pressed held tissue onto the bed."
)


def pressed(arm: ArmMotion, frames: Integers, force_n: Floats) -> NDArray[np.bool_]:
    """Of ``frames`` (f,), instants of the motion of ``arm``, those at which it pushes held tissue
    down, with ``force_n`` (f, 3) on it, where it took it.

    Tissue between jaw and bed is as stiff as its thickness is small: such a force is that of some
    hundredths of a millimetre, which neither the tip nor the model is known to, and many times
    what holds the tissue elsewhere.
    """
    taken = np.flatnonzero(np.diff(arm.grasped.astype(np.int8), prepend=0) == 1)
    if len(taken) == 0:
        return np.zeros(len(frames), dtype=bool)
    last = np.clip(np.searchsorted(taken, frames, side="right") - 1, 0, None)
    above_m = arm.position_m[frames, 2] - arm.position_m[taken[last], 2]
    with np.errstate(invalid="ignore"):
        down = force_n[:, 2] < -max(PRESSED_N, _BEYOND_NOISE * _scatter_n(force_n[:, 2]))
    return np.asarray(arm.grasped[frames] & (above_m < LOW_M) & down)


def _scatter_n(force_n: Floats) -> float:
    """Standard deviation of the noise of readings (f,), by how they depart from straight lines
    through their neighbours; most motion does not."""
    bends = np.diff(force_n, n=2)
    bends = bends[np.isfinite(bends)]
    return 1.4826 * float(np.median(np.abs(bends))) / np.sqrt(6.0) if len(bends) else 0.0
