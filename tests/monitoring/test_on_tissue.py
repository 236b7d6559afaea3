"""The metrics on tissue that is held by a patch the twin does not know of."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.metric import Metric
from defras_bt.monitoring.seen import seen_surface
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.tissue.model import TissueModel

GRASP = Pose(np.array([0.05, 0.0, 0.0]))
FRAME = ("##########..",) * 2 + ("##..........",) * 8 + ("##########..",) * 2


def lifted(scene: Scene, cells: int) -> tuple[Surface, Surface]:
    """The surface at rest, and after a lift of 15 mm at the free side."""
    model = TissueModel(scene, elements_xyz=(cells, cells, 1))
    rest = model.solve({}).surface
    model.grasp("psm1", GRASP)
    return rest, model.solve({"psm1": GRASP.moved(np.array([0.0, 0.0, 0.015]))}).surface


@pytest.fixture(scope="module")
def believed(scene: Scene) -> Scene:
    held = scene.attachments.model_copy(update={"map": FRAME})
    return scene.model_copy(update={"attachments": held})


@pytest.fixture(scope="module")
def actual(believed: Scene) -> Scene:
    patch = believed.attached.reshape(12, 12).copy()
    patch[5:8, 6:8] = True
    return believed.with_attached(patch.ravel())


def rise_mm(
    metric: Metric, twin: tuple[Surface, Surface], clouds: tuple[Floats, Floats], scene: Scene
) -> float:
    values = [
        metric.measure(cloud, seen_surface(surface, scene.depth_camera)).value_m
        for surface, cloud in zip(twin, clouds, strict=True)
    ]
    return 1e3 * (values[1] - values[0])


def test_an_unknown_patch_alarms_the_local_metric_only(
    believed: Scene, actual: Scene, take_cloud: Callable[[Surface, int], Floats]
) -> None:
    twin = lifted(believed, 8)
    rest, held = (take_cloud(surface, seed) for seed, surface in enumerate(lifted(actual, 10)))
    assert rise_mm(LocalMetric(), twin, (rest, held), believed) > 4.0
    assert rise_mm(MedianMetric(), twin, (rest, held), believed) < 2.0


def test_the_right_belief_alarms_neither_though_its_mesh_is_another(
    actual: Scene, take_cloud: Callable[[Surface, int], Floats]
) -> None:
    twin = lifted(actual, 8)
    rest, held = (take_cloud(surface, seed) for seed, surface in enumerate(lifted(actual, 10)))
    for metric in (LocalMetric(), MedianMetric()):
        assert rise_mm(metric, twin, (rest, held), actual) < 2.0
