"""From a case to the moment at which monitoring asks for an update: what is known then."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from defras_bt.benchmark.attachment_cases import UpdateCase
from defras_bt.benchmark.attachment_driver import Asked, Driver
from defras_bt.executive.operation import make_world
from defras_bt.faults.faults import FaultInjection


def asked_update(case: UpdateCase, world_name: str) -> Asked | None:
    """Run ``case`` until monitoring asks for an update; None if it never does."""
    with driven(case, world_name) as driver:
        return driver.run()


@contextmanager
def driven(case: UpdateCase, world_name: str) -> Iterator[Driver]:
    """A driver of ``case`` in a world of its own, the same every time."""
    believed = case.believed.for_bullet() if world_name == "bullet" else case.believed
    world = make_world(world_name, case.actual, np.random.default_rng([case.seed, 1]))
    try:
        faulty = FaultInjection(case.faults, believed, case.seed).world(world)
        yield Driver(case, faulty, believed)
    finally:
        world.close()
