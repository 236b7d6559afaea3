"""Where each manoeuvre takes the held tissue; executive and simulated rehearsal share it."""

from __future__ import annotations

from math import hypot

import numpy as np

from defras_sim.geometry import Floats
from defras_sim.scene import Scene


def away_from_endoscope(scene: Scene) -> Floats:
    """Unit vector (3,) in the tissue plane along which the endoscope looks."""
    from_x_m, from_y_m, _ = scene.endoscope.position_m
    to_x_m, to_y_m, _ = scene.endoscope.target_m
    x_m, y_m = to_x_m - from_x_m, to_y_m - from_y_m
    length_m = hypot(x_m, y_m)
    if length_m < 1e-9:
        raise ValueError("the endoscope looks straight down: no direction leads away from it")
    return np.array([x_m / length_m, y_m / length_m, 0.0])


def manoeuvre_target_m(scene: Scene, manoeuvre: str, tip_m: Floats) -> Floats:
    """Tip position (3,) at the end of ``pull``, ``move`` or ``fold`` when it starts at ``tip_m``.

    Pull lifts straight up, to a height over the tissue at rest; move goes planarly towards the
    region of interest, at most over its centre; fold moves away from the endoscope.
    """
    if manoeuvre == "pull":
        ground_m = float(scene.tissue.shape.upper.at(tip_m[:2])[2])
        return np.array([tip_m[0], tip_m[1], ground_m + scene.motion.pull_height_m])
    if manoeuvre == "move":
        towards = scene.roi_center_m[:2] - tip_m[:2]
        distance = hypot(*towards.tolist())
        share = min(1.0, scene.motion.move_limit_m / distance) if distance > 1e-9 else 0.0
        return tip_m + np.array([*(towards * share), 0.0])
    if manoeuvre == "fold":
        return tip_m + scene.motion.fold_distance_m * away_from_endoscope(scene)
    raise ValueError(f"unknown manoeuvre {manoeuvre!r}; valid: pull, move, fold")
