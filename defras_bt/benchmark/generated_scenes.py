"""Generated patients, kept in a folder: nobody searches for the same one twice."""

from __future__ import annotations

from pathlib import Path

from defras_bt.planning.scene_hash import scene_hash
from defras_bt.recording.whole_file import write_whole
from defras_sim.scene import Scene, load_scene
from defras_sim.scene_file import write_scene
from defras_sim.scene_generator import NoScene, Relation, Solved, generate_scene, solve


class GeneratedScenes:
    """Patients by seed. Most of the time of a retraction goes into finding one that can be exposed.

    What is believed of a seed is mostly the same whatever is really there: it is solved once.
    ``folder`` holds what was found, as scenes that ``defras run`` takes, and what was not; without
    one, nothing is kept.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._solved: dict[str, Solved | None] = {}

    def pair(self, seed: int, relation: Relation) -> tuple[Scene, Scene]:
        """(believed, actual), read from the folder or generated.

        Raises:
            NoScene: the seed gives no scene that can be exposed.
        """
        if self._folder is None:
            return self._generated(seed, relation)
        known = [self._folder / f"seed{seed}_{relation}_{side}.yaml" for side in _SIDES]
        nothing = self._folder / f"seed{seed}_{relation}_none.txt"
        if nothing.is_file():
            raise NoScene(nothing.read_text(encoding="utf-8").strip())
        if not all(file.is_file() for file in known):
            self._folder.mkdir(parents=True, exist_ok=True)
            try:
                pair = self._generated(seed, relation)
            except NoScene as error:
                write_whole(nothing, f"{error}\n")
                raise
            for scene, file in zip(pair, known, strict=True):
                write_scene(scene, file)
        believed, actual = map(load_scene, known)
        return believed, actual

    def _generated(self, seed: int, relation: Relation) -> tuple[Scene, Scene]:
        drawn = generate_scene(seed, relation, solver=self._solve_once)
        return drawn.believed.scene, drawn.actual.scene

    def _solve_once(self, scene: Scene) -> Solved | None:
        key = scene_hash(scene)
        if key not in self._solved:
            self._solved[key] = solve(scene)
        return self._solved[key]


_SIDES = ("believed", "actual")
