"""A scene that adopts what was hidden runs with an extended twin: what disagreed agrees."""

from __future__ import annotations

import numpy as np

from defras_bt.executive.operation import Operation, operate
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_sim.effects.effect import Extension
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene

HIDDEN: Extension = {
    "tool_offset": {"y_m": 0.008},
    "camera_latency": {"delay_s": 0.15},
    "stress_relaxation": {"fraction": 0.4, "time_s": 1.0},
}


class Readings:
    """Collects what the monitor said while tissue was held, and the twin's force beside the true
    one."""

    def __init__(self) -> None:
        self.mu_m: list[float] = []
        self.warnings: list[int] = []
        self.forces_n: list[tuple[float, float]] = []

    def start(self, info: RunInfo) -> None:
        pass

    def tick(self, record: TickRecord) -> None:
        held = any(arm.grasped for arm in record.observation.arms.values())
        if record.reading is None or not held:
            return
        self.mu_m.append(record.reading.mu_m["local"])
        self.warnings.append(record.reading.warning_state["local"])
        if record.true_force_n is not None and np.isfinite(record.force_n):
            self.forces_n.append((record.force_n, record.true_force_n))

    def finish(self, summary: RunSummary) -> None:
        pass


def coarse() -> Scene:
    scene = load_scene(resource("sim/scenes/demo.yaml"))
    mesh = (6, 6, 1)
    return scene.model_copy(
        update={
            "tissue": scene.tissue.model_copy(update={"elements_xyz": mesh}),
            "simulation": scene.simulation.model_copy(update={"elements_xyz": mesh}),
        }
    )


def run(adopted: Extension) -> Readings:
    """With the tree that neither monitors nor learns, so that both runs go the same way."""
    readings = Readings()
    scene = coarse().extended(adopted)
    operate(
        Operation(
            scene=scene,
            actual=coarse().extended(HIDDEN),
            scene_file="demo.yaml",
            actual_file=None,
            world="model",
            tree_file=resource("trees/fras.yaml"),
            seed=0,
            force_threshold_n=1.0,
            max_time_s=6.5,
        ),
        [readings],
    )
    assert len(readings.mu_m) > 20
    return readings


def test_the_extended_twin_agrees_where_the_plain_one_does_not() -> None:
    plain, extended = run({}), run(HIDDEN)
    assert np.nanmax(plain.mu_m) > 0.002
    assert np.nanmax(extended.mu_m) < 0.0006
    assert max(plain.warnings) >= 1
    assert max(extended.warnings) == 0

    def force_error_n(readings: Readings) -> float:
        said, true = np.array(readings.forces_n).T
        return float(np.sqrt(np.mean((said - true) ** 2)))

    assert force_error_n(extended) < 0.3 * force_error_n(plain)
