"""Generated patients are looked for once, and what was found is what is read again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import defras_bt.benchmark.generated_scenes as kept
from defras_bt.benchmark.cases import shipped
from defras_bt.benchmark.generated_scenes import GeneratedScenes
from defras_sim.retraction import Rehearsal
from defras_sim.scene import Scene
from defras_sim.scene_generator import GeneratedScene, NoScene, Solved, Solver


class Generator:
    """Takes the first shipped patient for what it generates, or finds nothing."""

    def __init__(self, solution: Rehearsal, *, finds: bool = True) -> None:
        self.asked: list[tuple[int, str]] = []
        self._solution = solution
        self._finds = finds

    def __call__(self, seed: int, relation: str, *, solver: Solver) -> GeneratedScene:
        self.asked.append((seed, relation))
        believed = solver(shipped("sim1"))
        if believed is None or not self._finds:
            raise NoScene(f"seed {seed}: nothing")
        return GeneratedScene(believed, Solved(shipped(f"sim1_{relation}"), self._solution))


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the scenes that were solved."""
    names: list[str] = []

    def solve(scene: Scene) -> Solved:
        names.append(scene.name)
        return Solved(scene, SOLUTION)

    monkeypatch.setattr(kept, "solve", solve)
    return names


SOLUTION = Rehearsal("psm1", (2, 2), (), (), (), 1.0, np.zeros(3), np.zeros(3), True)


def test_a_patient_is_looked_for_once(
    tmp_path: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    generator = Generator(SOLUTION)
    monkeypatch.setattr(kept, "generate_scene", generator)
    scenes = GeneratedScenes(tmp_path / "scenes")
    pairs = [scenes.pair(3, relation) for relation in ("fewer", "more", "fewer")]
    assert generator.asked == [(3, "fewer"), (3, "more")]
    assert solved == ["sim1"]
    assert pairs[0] == pairs[2] == (shipped("sim1"), shipped("sim1_fewer"))
    assert GeneratedScenes(tmp_path / "scenes").pair(3, "more") == pairs[1]
    assert len(generator.asked) == 2


def test_that_there_is_none_is_known_the_next_time(
    tmp_path: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    generator = Generator(SOLUTION, finds=False)
    monkeypatch.setattr(kept, "generate_scene", generator)
    for _ in range(2):
        with pytest.raises(NoScene, match="seed 4: nothing"):
            GeneratedScenes(tmp_path).pair(4, "more")
    assert generator.asked == [(4, "more")]
