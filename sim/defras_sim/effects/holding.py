"""How firmly holes hold the tissue, and how much of that is left."""

from __future__ import annotations

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import RIGID_HOLE_N_PER_M
from defras_sim.tissue.parameters import HoleStiffnesses, Parameter

# Tissue of a few kilopascal gives way so much over a hole of 3 mm radius: a rigid hole and one of
# a thousand newtons a metre feel alike.
TISSUE_N_PER_M = 40.0


def weakened_n_per_m(stiffness_n_per_m: Floats, lost: Floats) -> Floats:
    """Stiffness (holes,) of holes of which the share ``lost`` (holes,) of the hold is gone.

    The hold is what the tissue feels: k / (k + k_tissue). Shares of it, unlike shares of a
    stiffness far above the tissue's, all make a difference.
    """
    hold = stiffness_n_per_m / (stiffness_n_per_m + TISSUE_N_PER_M)
    left = (1 - lost) * hold
    weaker = TISSUE_N_PER_M * left / (1 - left)
    return np.where(lost > 0, weaker, stiffness_n_per_m)


def weakened_by(stiffness_n_per_m: Floats, lost: Floats) -> Floats:
    """Derivative (holes,) [N/m] of :func:`weakened_n_per_m` by the share lost."""
    hold = stiffness_n_per_m / (stiffness_n_per_m + TISSUE_N_PER_M)
    return -TISSUE_N_PER_M * hold / (1 - (1 - lost) * hold) ** 2


def strengthened_n_per_m(stiffness_n_per_m: Floats, gained: Floats) -> Floats:
    """Stiffness (holes,) of holes that have the share ``gained`` (holes,) of the hold that they
    lack to a rigid one."""
    hold = stiffness_n_per_m / (stiffness_n_per_m + TISSUE_N_PER_M)
    more = hold + gained * _lacking(hold)
    return np.where(gained > 0, TISSUE_N_PER_M * more / (1 - more), stiffness_n_per_m)


def strengthened_by(stiffness_n_per_m: Floats, gained: Floats) -> Floats:
    """Derivative (holes,) [N/m] of :func:`strengthened_n_per_m` by the share gained."""
    hold = stiffness_n_per_m / (stiffness_n_per_m + TISSUE_N_PER_M)
    lacking = _lacking(hold)
    return TISSUE_N_PER_M * lacking / (1 - hold - gained * lacking) ** 2


def _lacking(hold: Floats) -> Floats:
    return np.maximum(RIGID_HOLE_N_PER_M / (RIGID_HOLE_N_PER_M + TISSUE_N_PER_M) - hold, 0.0)


def by_holes(by_n_per_m: Floats) -> dict[Parameter, float]:
    """What changes the stiffness of each hole by its number of (holes,), as a direction."""
    return {HoleStiffnesses(tuple(by_n_per_m.tolist())): 1.0}
