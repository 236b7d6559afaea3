"""A bench world through faults, and one that moves as told."""

from __future__ import annotations

import numpy as np

from defras_bt.executive.testing import BenchWorld, bench_scene
from defras_bt.faults.fault import Fault
from defras_bt.faults.world import FaultyWorld
from defras_sim.worlds.protocol import HOLD, ArmCommand, Command, Observation

UP = Command({"psm1": ArmCommand(np.array([0.0, 0.0, 0.05]))})


def faulty(*faults: Fault, seed: int = 0) -> FaultyWorld:
    scene = bench_scene()
    rng = np.random.default_rng(seed)
    return FaultyWorld(BenchWorld(scene), [fault.injector(scene, rng) for fault in faults])


def watch(world: FaultyWorld, seconds: float, command: Command = HOLD) -> list[Observation]:
    """What arrives while ``command`` is given every tick; the first one is of now."""
    seen = [world.observe()]
    for _ in range(round(seconds / world.tick_s)):
        world.command(command)
        world.step()
        seen.append(world.observe())
    return seen


def tripped(world: FaultyWorld) -> list[float]:
    """Times at which something must have kept the arms still."""
    return [round(tick * world.tick_s, 6) for tick, why in enumerate(world.trips) if why]
