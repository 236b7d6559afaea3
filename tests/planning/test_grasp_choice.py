"""asp/grasp_choice.lp: the preferences, chosen in the file alone, against brute force."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.planning.plan import ArmSituation, Situation
from defras_bt.planning.planner import Planner
from defras_sim.resources import resource

IDLE = Situation({"psm1": ArmSituation(), "psm2": ArmSituation()})


def band(distance_mm):
    return -(distance_mm // 10)


KEYS = {
    "attachments_first": lambda away, to_roi: (band(away), to_roi),
    "roi_first": lambda away, to_roi: (to_roi, band(away)),
    "balanced": lambda away, to_roi: (to_roi - away,),
}


@pytest.mark.parametrize("preference", KEYS)
def test_preference(scene, tmp_path, preference):
    text = resource("asp/grasp_choice.lp").read_text()
    edited = tmp_path / "grasp_choice.lp"
    edited.write_text(
        "\n".join(
            f"#const preference = {preference}." if line.startswith("#const preference") else line
            for line in text.splitlines()
        )
    )
    others = [resource("asp/retraction.lp"), resource("asp/explain.lp")]
    planner = Planner(scene, programs=[*others, edited])
    rng = np.random.default_rng(4)
    for _ in range(15):
        attached = rng.random(144) < 0.05
        attached[rng.integers(144)] = True
        held = scene.holes_xy_m[attached]

        def key(point, held=held):
            place = scene.grasp_xy_m(*point)
            away_mm = round(1000 * float(min(np.hypot(*(hole - place)) for hole in held)))
            to_roi_mm = round(1000 * float(np.hypot(*(scene.roi_center_m[:2] - place))))
            return (*KEYS[preference](away_mm, to_roi_mm), point[1], point[0])

        points = [(c, r) for c in range(1, 6) for r in range(1, 6)]
        assert planner.plan(IDLE, attached).actions[0].point == min(points, key=key)
