"""Patients to retract: what is believed, and what is really there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from defras_bt.benchmark.generated_scenes import GeneratedScenes
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_generator import Relation

SIMULATED = tuple(f"sim{number}" for number in range(1, 9))
SETUPS = ("A", "B", "C")
RELATIONS: tuple[Relation, ...] = ("fewer", "more", "equal")


@dataclass(frozen=True)
class Case:
    """A believed and an actual scene, by the names of shipped ones, or by a generator's seed.

    ``relation``: how the number of attachments compares. In table 1 it is that of the actual ones
    to those believed; in table 2, where reality stays and beliefs differ, the other way round.
    """

    name: str
    relation: Relation
    believed: str | None
    actual: str | None
    seed: int | None = None

    def scenes(self, generated: GeneratedScenes | None = None) -> tuple[Scene, Scene]:
        """(believed, actual). Generating them can take a minute, unless ``generated`` has them.

        Raises:
            NoScene: the seed gives no scene that can be exposed.
        """
        if self.seed is not None:
            return (generated or GeneratedScenes()).pair(self.seed, self.relation)
        return shipped(self.believed or ""), shipped(self.actual or "")


def shipped(name: str) -> Scene:
    return load_scene(resource(f"sim/scenes/{name}.yaml"))


def table1_cases() -> list[Case]:
    """The eight simulated patients with fewer and with more attachments than believed."""
    return [
        Case(name, relation, name, f"{name}_{relation}")
        for name in SIMULATED
        for relation in RELATIONS[:2]
    ]


def table2_cases() -> list[Case]:
    """The three set-ups, of which fewer, more, or as many attachments are believed."""
    return [
        Case(name, relation, f"{name}_{relation}", name)
        for name in SETUPS
        for relation in RELATIONS
    ]


def generated_cases(first_seed: int, count: int) -> list[Case]:
    """``count`` generated patients with fewer attachments than believed, and as many with more."""
    return [
        Case(f"seed{seed}", relation, None, None, seed)
        for seed in range(first_seed, first_seed + count)
        for relation in RELATIONS[:2]
    ]


def configurations() -> list[str]:
    """The 17 believed scenes over which the force threshold is derived, as the paper does."""
    return [*SIMULATED, *(f"{name}_{relation}" for name in SETUPS for relation in RELATIONS)]


Table = Literal["table1", "table2"]
