"""What the tissue is attached to gives way."""

from __future__ import annotations

import numpy as np

from defras_sim.effects.effect import EffectParameter, Values
from defras_sim.effects.holding import by_holes
from defras_sim.effects.tissue_effect import Direction, Evolution, TissueEffect
from defras_sim.geometry import Floats
from defras_sim.tissue.model import TissueModel

COMPLIANCE = "compliance_m_per_n"


class AttachmentCompliance(TissueEffect):
    """Every attachment is in series with a spring of the same compliance."""

    name = "attachment_compliance"
    rank = 2
    sentence = "What the tissue is attached to gives way."
    parameters = (
        EffectParameter(
            COMPLIANCE, "m/N", null=0.0, lower=0.0, upper=1.0, step=0.01,
            meaning="how far each attachment follows a pull of one newton",
        ),
    )  # fmt: skip
    falsified_by = "Tissue over attachments does not rise under load, at any of them."
    excited_by = "A firm pull near attachments; their tissue rises in proportion to the force."
    source = "Springs in series: 1 / (1 / k + c)."

    def begin(self, values: Values, model: TissueModel) -> Evolution:
        return _Giving(values[COMPLIANCE])


class _Giving(Evolution):
    def __init__(self, compliance_m_per_n: float) -> None:
        self._give = compliance_m_per_n
        self._left_n_per_m: Floats = np.zeros(0)

    def hold_n_per_m(self, stiffness_n_per_m: Floats) -> Floats:
        self._left_n_per_m = stiffness_n_per_m / (1 + self._give * stiffness_n_per_m)
        return self._left_n_per_m

    def directions(self) -> tuple[Direction, ...]:
        return (Direction(COMPLIANCE, {}, by_holes(-(self._left_n_per_m**2))),)


EFFECT = AttachmentCompliance()
