"""A fingerprint of everything in a scene that a pre-operative plan depends on."""

from __future__ import annotations

import hashlib
import json

from defras_sim.scene import Scene

_PARTS = {"tissue", "attachments", "grasp", "roi", "arms", "endoscope", "motion", "model", "advice"}
_THRESHOLDS = {"force_n", "roi_visibility"}


def scene_hash(scene: Scene) -> str:
    """SHA-256 (hex) of the relevant content; names, descriptions and sensors do not count."""
    content = scene.model_dump(mode="json", include=_PARTS)
    for arm in content["arms"].values():
        del arm["force_noise_sd_n"]
    content["thresholds"] = scene.thresholds.model_dump(mode="json", include=_THRESHOLDS)
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
