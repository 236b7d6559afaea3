"""Makes training data: shards side by side, each from its own seed, none twice."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from defras_bt.learning.data.anatomies import anatomy_scenes
from defras_bt.learning.data.episode import Episode, TissueModels, draw_episode
from defras_bt.learning.data.patients import draw_patient, draw_tissue
from defras_bt.learning.data.samples import SAMPLES_PER_WALK
from defras_bt.learning.data.shards import FORMAT, InvalidData, write_shard
from defras_sim.scene import Scene

MANIFEST = "manifest.json"
PATIENTS_PER_SHARD = 10
_WALKS_PER_PATIENT = 2.4
"""Measured: some patients are grasped once, and what is not due to attachments has one belief."""


@dataclass(frozen=True)
class Request:
    """What was asked for; more samples of the same seed go on with what is there."""

    seed: int
    samples: int

    @property
    def shards(self) -> int:
        each = PATIENTS_PER_SHARD * _WALKS_PER_PATIENT * SAMPLES_PER_WALK
        return max(1, int(np.ceil(self.samples / each)))


def generate(
    out: Path, request: Request, *, jobs: int, tell: Callable[[str], None]
) -> Iterator[int]:
    """Make the shards of ``request`` that ``out`` does not have yet; yields each one's number.

    Raises:
        InvalidData: the folder holds data of another seed or format.
    """
    shards = out / "shards"
    shards.mkdir(parents=True, exist_ok=True)
    open_manifest(out, request)
    anatomies = anatomy_scenes(out / "anatomies", tell)
    missing = missing_shards(out, request)
    work = (delayed(_make_shard)(shards, anatomies, request.seed, number) for number in missing)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


def missing_shards(out: Path, request: Request) -> list[int]:
    """Numbers of the shards of ``request`` that ``out`` does not have yet."""
    shards = out / "shards"
    return [n for n in range(request.shards) if not (shards / f"{n:05}.npz").exists()]


def shard_files(folder: Path) -> list[Path]:
    """The shards of a folder, in order.

    Raises:
        InvalidData: there are none.
    """
    files = sorted((folder / "shards").glob("*.npz"))
    if not files:
        raise InvalidData(f"{folder} holds no shards; make some: defras train data --out {folder}")
    return files


def _make_shard(folder: Path, anatomies: list[Scene], seed: int, number: int) -> int:
    rng = np.random.default_rng([seed, number])
    tissue = draw_tissue(anatomies, rng)
    models = TissueModels(tissue)
    episodes: list[Episode] = []
    while len(episodes) < PATIENTS_PER_SHARD:
        # Each patient has its own generator, so that one's luck does not change the next.
        episode = draw_episode(models, draw_patient(tissue, rng), rng.spawn(1)[0])
        if episode is not None:
            episodes.append(episode)
    write_shard(folder / f"{number:05}.npz", tissue, models.rest, episodes)
    return number


def open_manifest(out: Path, request: Request) -> None:
    """Note in the folder what was asked for.

    Raises:
        InvalidData: the folder holds data of another seed or format, or a broken manifest.
    """
    file = out / MANIFEST
    if file.exists():
        known = read_manifest(out)
        if known.seed != request.seed:
            raise InvalidData(
                f"{out} holds data of seed {known.seed}; asked for is {request.seed}: choose "
                "another folder"
            )
    content = {"format": FORMAT, "request": asdict(request)}
    file.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def read_manifest(folder: Path) -> Request:
    """What was asked for when the data in ``folder`` was made.

    Raises:
        InvalidData: the manifest is missing, broken, or of another format.
    """
    file = folder / MANIFEST
    if not file.is_file():
        raise InvalidData(
            f"{file} is missing, which says how the data was made; restore it, or make data anew: "
            "defras train data --out DIR"
        )
    try:
        said = json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InvalidData(f"{file} cannot be read as JSON: {error}; choose another folder") from (
            error
        )
    if not isinstance(said, dict) or said.get("format") != FORMAT:
        found = said.get("format") if isinstance(said, dict) else None
        raise InvalidData(
            f"{file} has the format {found!r}; readable is {FORMAT!r}: choose another folder"
        )
    request = said.get("request")
    if not isinstance(request, dict) or not all(
        isinstance(request.get(key), int) for key in ("seed", "samples")
    ):
        raise InvalidData(
            f"{file}: request has to hold whole numbers seed and samples, not {request!r}"
        )
    return Request(request["seed"], request["samples"])
