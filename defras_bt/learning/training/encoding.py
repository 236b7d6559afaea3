"""Training data as arrays that networks take, kept beside the shards so that it is made once.

All holes of all tissues are put on one grid of 16 x 16 places, the rest of which is masked.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.data import samples as sampling
from defras_bt.learning.data.generate import shard_files
from defras_bt.learning.data.samples import Sample, samples_of
from defras_bt.learning.data.shards import read_shard
from defras_bt.learning.networks import hole_features as features
from defras_bt.learning.networks import hole_grid, voxels
from defras_bt.learning.networks.weights import NetworkName
from defras_sim.geometry import Floats
from defras_sim.scene import Scene

SIDE = 16
"""Places along each side of the common grid."""

Part = Literal["training", "validation", "test"]
PARTS: tuple[Part, ...] = ("training", "validation", "test")


def part_of(shard: int) -> Part:
    """Which part of the data a shard belongs to: tissues of one are in no other."""
    if shard % 8 == 3:
        return "validation"
    return "test" if shard % 8 == 7 else "training"


@dataclass(frozen=True)
class About:
    """Of one sample: where it stands in the data, and its conditions. Distances in metres."""

    key: str
    cause: str
    kind: str
    tissue: str
    local_m: float
    frames: int
    hidden_share: float


@dataclass(frozen=True)
class Encoded:
    """``inputs`` by name (n, ...); ``truth``, ``believed`` and ``is_hole`` (n, 256) of each hole,
    ``grasp_m`` (n, 256) how far it is from the nearest grasp; ``about`` each sample."""

    inputs: Mapping[str, NDArray[Any]]
    truth: NDArray[np.bool_]
    believed: NDArray[np.bool_]
    is_hole: NDArray[np.bool_]
    grasp_m: Floats
    about: Sequence[About]

    def __len__(self) -> int:
        return len(self.about)


def encoded(
    folder: Path, network: NetworkName, tell: Callable[[int, int], None]
) -> dict[Part, Encoded]:
    """The data of ``folder`` by part; what is not yet encoded is encoded now.

    ``tell`` hears how many of how many shards are done.
    """
    files = shard_files(folder)
    cache = folder / "encoded" / f"{network}-{_version(network)}"
    cache.mkdir(parents=True, exist_ok=True)
    read: dict[Part, list[dict[str, NDArray[Any]]]] = {}
    for number, file in enumerate(files):
        kept = cache / file.name
        if not kept.exists():
            _encode(file, kept, network)
        with np.load(kept, allow_pickle=False) as stored:
            read.setdefault(part_of(int(file.stem)), []).append(dict(stored))
        tell(number + 1, len(files))
    return {part: _joined(arrays) for part, arrays in read.items()}


def _encode(shard_file: Path, file: Path, network: NetworkName) -> None:
    rows: list[dict[str, NDArray[Any]]] = []
    about: list[About] = []
    for sample in samples_of(read_shard(shard_file)):
        inputs = sequence_inputs(sample) if network == "sequence" else banet_inputs(sample)
        if inputs is None:
            continue
        belief = sample.belief
        taken = [tip.position_m[:2] for tip in sample.keyframes[0].grasp_tips.values()]
        away = np.linalg.norm(belief.holes_xy_m[:, None] - np.array(taken), axis=2).min(axis=1)
        rows.append(
            {
                **inputs,
                "truth": on_grid(belief, sample.truth.attached),
                "believed": on_grid(belief, belief.attached),
                "is_hole": on_grid(belief, belief.is_hole),
                "grasp_m": on_grid(belief, away).astype(np.float32),
            }
        )
        about.append(_about(sample))
    arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    said = json.dumps([asdict(each) for each in about])
    arrays["about"] = np.frombuffer(said.encode(), np.uint8)
    partial = file.with_suffix(".part")
    with partial.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays)
    os.replace(partial, file)


def sequence_inputs(sample: Sample) -> dict[str, NDArray[Any]] | None:
    """``frames`` (5, channels, 16, 16), the newest last; ``known`` (5,) marks real ones; ``holes``
    (channels, 16, 16). None where the camera sees nothing of the twin."""
    found = features.hole_features(sample.belief, sample.keyframes, sample.predicted)
    if found is None:
        return None
    frames = np.zeros((features.FRAMES, found.frames.shape[2], SIDE, SIDE), np.float16)
    rows, columns = found.grid
    missing = features.FRAMES - len(found.frames)
    frames[missing:, :, :rows, :columns] = np.moveaxis(
        found.frames.reshape(-1, rows, columns, found.frames.shape[2]), 3, 1
    )
    holes = np.zeros((found.holes.shape[1], SIDE, SIDE), np.float16)
    holes[:, :rows, :columns] = np.moveaxis(found.holes.reshape(rows, columns, -1), 2, 0)
    known = np.arange(features.FRAMES) >= missing
    return {"frames": frames, "known": known, "holes": holes}


def banet_inputs(sample: Sample) -> dict[str, NDArray[Any]]:
    """``channels`` (3, x, y, z), and where the holes lie in them."""
    belief = sample.belief
    channels = voxels.voxel_inputs(belief, sample.keyframes[-1].cloud_m)
    corners, weights = voxels.corners_of_holes(belief)
    return {
        "channels": channels.astype(np.float16),
        "corners": on_grid(belief, corners).astype(np.int32),
        "weights": on_grid(belief, weights).astype(np.float32),
    }


def on_grid(scene: Scene, values: NDArray[Any]) -> NDArray[Any]:
    """Values (holes, ...) at their places (256, ...) of the common grid; zero elsewhere.

    Raises:
        ValueError: the scene has more holes along a side than the grid.
    """
    nx, ny = scene.hole_counts
    if max(nx, ny) > SIDE:
        raise ValueError(f"training data has at most {SIDE} holes a side; {nx} x {ny} are given")
    placed = np.zeros((SIDE, SIDE, *values.shape[1:]), values.dtype)
    placed[:ny, :nx] = values.reshape(ny, nx, *values.shape[1:])
    return placed.reshape(SIDE * SIDE, *values.shape[1:])


def _about(sample: Sample) -> About:
    counts = [len(frame.cloud_m) for frame in sample.keyframes]
    anatomy = sample.belief.tissue.anatomy
    return About(
        key=sample.key,
        cause=sample.cause,
        kind=sample.kind,
        tissue="slab" if anatomy is None else anatomy.file.stem,
        local_m=sample.local_m,
        frames=len(sample.keyframes),
        hidden_share=1.0 - counts[-1] / max(counts),
    )


def _joined(arrays: Sequence[dict[str, NDArray[Any]]]) -> Encoded:
    about = [About(**row) for part in arrays for row in json.loads(part["about"].tobytes())]
    names = [name for name in arrays[0] if name != "about"]
    whole = {name: np.concatenate([part[name] for part in arrays]) for name in names}
    known = ("truth", "believed", "is_hole", "grasp_m")
    return Encoded(
        inputs={name: values for name, values in whole.items() if name not in known},
        truth=whole["truth"],
        believed=whole["believed"],
        is_hole=whole["is_hole"],
        grasp_m=whole["grasp_m"],
        about=about,
    )


def _version(network: NetworkName) -> str:
    """Changes with the code that makes the inputs: what is kept of another is not used."""
    modules: dict[NetworkName, tuple[ModuleType, ...]] = {
        "sequence": (features, hole_grid, sampling),
        "banet": (voxels, sampling),
    }
    source = "".join(inspect.getsource(module) for module in modules[network])
    return hashlib.sha256(source.encode()).hexdigest()[:12]
