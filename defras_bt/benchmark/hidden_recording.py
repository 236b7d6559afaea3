"""Measured data with a hidden cause: a recording, and nothing else that could tell.

Reality is another model than the one that will diagnose it: quadratic tetrahedra on a finer mesh
(whose points of contact with the bed are others, too), led along at another time step, seen with
noise that remembers and drifts.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from defras_bt.benchmark.hidden_noise import CameraNoise, ForceNoise, NoiseSpectrum
from defras_bt.benchmark.hidden_retraction import Script
from defras_bt.recording.readings_bag import ReadingsBag
from defras_sim.effects.effect import Extension
from defras_sim.scene import Scene
from defras_sim.worlds.model_world import ModelWorld
from defras_sim.worlds.protocol import PointCloud

TICK_S = 0.04
ELEMENTS_XYZ = (16, 16, 1)


def reality(
    scene: Scene,
    hidden: Extension,
    *,
    with_force: bool = True,
    elements_xyz: tuple[int, int, int] = ELEMENTS_XYZ,
) -> Scene:
    """What is really there where ``scene`` is believed and the effects ``hidden`` are not known."""
    actual = scene.extended({**scene.model.extension, **hidden})
    arms = {
        name: arm.model_copy(update={"force_noise_sd_n": 0.0 if with_force else None})
        for name, arm in actual.arms.items()
    }
    return actual.model_copy(
        update={
            "tick_s": TICK_S,
            "arms": arms,
            "tissue": actual.tissue.model_copy(update={"element": "tetrahedron10"}),
            "simulation": actual.simulation.model_copy(update={"elements_xyz": elements_xyz}),
            "depth_camera": actual.depth_camera.model_copy(update={"noise_sd_m": 0.0}),
        }
    )


def record(
    actual: Scene,
    script: Script,
    spectrum: NoiseSpectrum,
    rng: np.random.Generator,
    file: Path,
) -> None:
    """Carry out ``script`` where ``actual`` is real, and leave the recording in ``file``.

    Raises:
        WorldError: the actual tissue cannot be led along.
    """
    world = ModelWorld(actual, rng)
    camera = CameraNoise(spectrum, actual.depth_camera, rng)
    force = ForceNoise(spectrum, rng)
    with ReadingsBag(file) as bag:
        shown: PointCloud | None = None
        commands = script.commands(actual, world)
        while True:
            seen = world.observe()
            arms = {
                name: arm if arm.force_n is None else replace(arm, force_n=force.on(arm.force_n))
                for name, arm in seen.arms.items()
            }
            cloud = seen.cloud if seen.cloud is not shown else None
            shown = seen.cloud
            if cloud is not None:
                points = camera.on(cloud.points_m, seen.time_s)
                cloud = None if points is None else PointCloud(cloud.stamp_s, points)
            bag.add(seen.time_s, arms, cloud)
            command = next(commands, None)
            if command is None:
                break
            world.command(command)
            world.step()
    world.close()
