"""The model card of trained weights: data, metrics by condition, limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.networks.weights import NetworkName
from defras_bt.learning.training.calibration import fitted_temperature, mean_probability
from defras_bt.learning.training.checkpoint import Epoch
from defras_bt.learning.training.encoding import About, Encoded, Part
from defras_bt.learning.training.loop import Settings, all_logits
from defras_bt.learning.training.metrics import overlap, prior, scores
from defras_bt.learning.training.trainable import Trainable
from defras_sim.geometry import Floats

WHAT: Mapping[NetworkName, str] = {
    "banet": "3D U-Net over voxels: tissue at rest and the newest partial surface, to the "
    "probability that tissue is held there, read at the holes",
    "sequence": "convolutions over the grid of holes: up to five keyframes against the twin's "
    "prediction, the twin's strain and forces, and the belief, to a probability for each hole",
}
LIMITS: Mapping[NetworkName, Sequence[str]] = {
    "banet": (
        "It knows neither the belief nor where the tissue is grasped: where nothing moves, it can "
        "only say how often holes hold in the data.",
        "Trained on tissue of 80 to 150 mm, 3 to 8 mm thick, moved by 4 to 60 mm, no gravity.",
        "Slips, moved cameras and stiff spots look like attachments to it.",
    ),
    "sequence": (
        "Probabilities are right on average over the data's conditions, not for each of them; "
        "where beliefs hold much more or less than is there, they are less right.",
        "Trained on tissue of 80 to 150 mm, 3 to 8 mm thick, moved by 4 to 60 mm, no gravity.",
        "Reality is the same model on a finer mesh: other mechanics was never seen in training.",
    ),
}
TRIED: Mapping[NetworkName, Sequence[str]] = {
    "banet": (
        "32 x 32 x 32 voxels would be 4.7 times as many as these 24 x 24 x 12, as fine as "
        "the holes are apart; they were not trained.",
    ),
    "sequence": (
        "grid (convolutions over the grid of holes, three blocks, 40 channels, 117,000 numbers) "
        "and points (attention among holes by their places, three blocks, 61,000 numbers), five "
        "passes over the same 611 samples: validation loss 0.080 and 0.093 nats a hole, beside "
        "0.122 of the belief alone; a pass with points took about eight times as long.",
        "Without the belief's own logit added to the output, grid reached 0.191 after three passes "
        "over 474 samples: it then has to learn first to repeat the belief.",
    ),
}
"""What else was tried, and what came of it."""

_NEAR_M = ((0.0, 0.03), (0.03, 0.06), (0.06, 0.3))


def model_card(
    name: NetworkName,
    config: Mapping[str, Any],
    model: Trainable,
    parts: Mapping[Part, Encoded],
    settings: Settings,
    history: Sequence[Epoch],
    data: Mapping[str, Any],
) -> dict[str, Any]:
    """The card of a trained ``model``: its temperature is fitted here, on the validation part.

    ``data`` says which data it was; metrics are those of the test part.
    """
    validation, test = parts["validation"], parts["test"]
    known = _flat(all_logits(model, validation), validation)
    temperature = fitted_temperature(known, validation.truth[validation.is_hole])
    probability = mean_probability(np.moveaxis(all_logits(model, test), 1, 0), temperature)
    return {
        "what": WHAT[name],
        "config": dict(config),
        "temperature": temperature,
        "training": {
            "settings": asdict(settings),
            "epochs": len(history),
            "best_validation_loss": min(epoch.validation_loss for epoch in history),
            "seconds": round(sum(epoch.seconds for epoch in history)),
        },
        "data": {**data, "samples": {part: len(each) for part, each in parts.items()}},
        "metrics": metrics_by_condition(probability, test, _prior(parts["training"], test)),
        "limits": list(LIMITS[name]),
        "tried": list(TRIED[name]),
    }


def metrics_by_condition(
    probability: Floats, data: Encoded, baseline: Floats
) -> dict[str, dict[str, Any]]:
    """Scores of ``probability`` (n, 256) by condition, and of the ``baseline`` beside them."""
    rows: dict[str, dict[str, Any]] = {}
    everything = np.ones(len(data), bool)
    rows["all"] = _scores(probability, data, everything)
    rows["belief alone"] = _scores(baseline, data, everything)
    for heading, of in _CONDITIONS.items():
        values = np.array([of(about) for about in data.about])
        for value in sorted(set(values.tolist())):
            rows[f"{heading}: {value}"] = _scores(probability, data, values == value)
    for low_m, high_m in _NEAR_M:
        near = (data.grasp_m >= low_m) & (data.grasp_m < high_m) & data.is_hole
        held = probability > 0.5
        precision, recall, f1 = overlap(held[near], data.truth[near])
        heading = f"{1e3 * low_m:.0f} to {1e3 * high_m:.0f} mm from the grasp"
        rows[heading] = {
            "holes": int(near.sum()), "precision": precision, "recall": recall, "f1": f1
        }  # fmt: skip
    return {key: _rounded(row) for key, row in rows.items()}


def _mismatch(about: About) -> str:
    millimetres = 1e3 * about.local_m
    for limit in (2, 4, 8):
        if millimetres < limit:
            return f"under {limit} mm"
    return "8 mm or more"


_CONDITIONS: Mapping[str, Callable[[About], str]] = {
    "cause": lambda about: about.cause,
    "belief": lambda about: about.kind,
    "tissue": lambda about: about.tissue,
    "discrepancy": _mismatch,
    "hidden of the surface": lambda a: "under 30 %" if a.hidden_share < 0.3 else "30 % or more",
}


def _scores(probability: Floats, data: Encoded, rows: NDArray[np.bool_]) -> dict[str, Any]:
    mask = data.is_hole & rows[:, None]
    found = scores(probability[mask], data.truth[mask], data.believed[mask])
    return {"samples": int(rows.sum()), **asdict(found)}


def _prior(training: Encoded, test: Encoded) -> Floats:
    mask = training.is_hole
    return prior(training.believed[mask], training.truth[mask], test.believed)


def _flat(logits: Floats, data: Encoded) -> Floats:
    """Logits (n, heads, 256) of the holes only: (heads, holes)."""
    return np.moveaxis(logits, 1, 0)[:, data.is_hole]


def _rounded(row: Mapping[str, Any]) -> dict[str, Any]:
    """Four digits; None where a number is not defined."""
    return {
        key: (None if np.isnan(value) else round(value, 4)) if isinstance(value, float) else value
        for key, value in row.items()
    }
