"""A world seen, and commanded, through faults."""

from __future__ import annotations

from collections.abc import Sequence

from defras_bt.faults.fault import Injector
from defras_bt.faults.system import trips
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import Command, Observation, World


class FaultyWorld:
    """Wraps any world. ``trips`` tells, per observation, what must keep the arms still."""

    def __init__(self, world: World, injectors: Sequence[Injector]) -> None:
        self.name = world.name
        self.tick_s = world.tick_s
        self.trips: list[tuple[str, ...]] = []
        self._world = world
        self._injectors = tuple(injectors)
        self._delivered = self._deliver()

    @property
    def time_s(self) -> float:
        return self._world.time_s + sum(injector.late_s for injector in self._injectors)

    def observe(self) -> Observation:
        return self._delivered

    def command(self, command: Command) -> None:
        true = self._world.observe()
        for injector in self._injectors:
            command = injector.commanded(command, true)
        self._world.command(command)

    def step(self) -> None:
        """Let ``tick_s`` of world time pass, and deliver what is then sensed.

        Raises:
            WorldError: the world cannot go on, or a fault has it that it is lost.
        """
        for injector in self._injectors:
            injector.step(self._world.time_s)
        self._world.step()
        self._delivered = self._deliver()

    def mark(self, sentence: str) -> None:
        """Something else than the world broke: the arms must be still from this tick on."""
        self.trips[-1] = (*self.trips[-1], sentence)

    def true_force_n(self) -> float | None:
        return self._world.true_force_n()

    def true_surface(self) -> Surface | None:
        return self._world.true_surface()

    def close(self) -> None:
        self._world.close()

    def _deliver(self) -> Observation:
        true = delivered = self._world.observe()
        for injector in self._injectors:
            delivered = injector.observed(true, delivered)
        self.trips.append(trips(self._injectors))
        return delivered
