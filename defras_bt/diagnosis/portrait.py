"""Portrait of a residual: numbers that make kinds of causes visible, each with a sentence."""

from __future__ import annotations

import numpy as np

from defras_bt.diagnosis.diagnosis import Statistic
from defras_bt.diagnosis.problem import Samples
from defras_sim.geometry import Floats


def portrait(residual: Floats, samples: Samples) -> tuple[Statistic, ...]:
    """Statistics of ``residual`` (n,)."""
    found = []
    for index, channel in enumerate(samples.channels):
        values = residual[samples.channel == index]
        values = values[np.isfinite(values)]
        if len(values):
            rms = float(np.sqrt(np.mean(values**2)))
            found.append(
                Statistic(
                    "rms",
                    channel.sensor,
                    rms,
                    channel.unit,
                    f"{channel.name} differs from the simulation by {rms:.3g} {channel.unit} "
                    f"(root mean square); the sensor scatters by {channel.noise_sd:.3g}.",
                    channel=channel.name,
                )
            )
    return tuple(found)
