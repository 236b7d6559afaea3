"""Training data on disk: one npz file (no pickles) per tissue, and how it is read back.

    anatomies/NAME.yaml, NAME.npz   scenes from meshes that shards refer to
    shards/00012.npz                ten patients of one tissue
    manifest.json                   what was asked for, and what became of it

A shard holds ``meta``, UTF-8 JSON: the tissue's scene, and by patient its cause, what differs from
the tissue's scene, and by grasp the arms, and by belief its kind. The rest are arrays: the resting
surface of the twin (``rest_vertices``, ``triangles``, ``upper``, ``rest_xy_m``), and by patient P,
grasp G and belief B

    P/true (holes,)                    which holes hold
    P/G/way_ARM_m (frames, 3)          tip of an arm at each keyframe; the first is the grasp
    P/G/cloud, P/G/cloud_ends          points (n, 3) of all keyframes, and where each one's end
    P/G/B/believed (holes,)            the belief
    P/G/B/vertices (m, vertices, 3)    the twin's surface at the first m keyframes
    P/G/B/hole_forces_n (m, holes, 3)  and its forces at the holes
    P/G/B/local_m (m,)                 and the local discrepancy

Places are whole numbers of 10 micrometres (int16).
"""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defras_bt.learning.data.episode import BeliefWalk, Episode
from defras_sim.geometry import Floats
from defras_sim.scene import Camera, Roi, Scene
from defras_sim.surface import Surface

FORMAT = "defras attachment data 1"
UNIT_M = 1e-5


@dataclass(frozen=True)
class RecordedGrasp:
    """One grasp as read back: ``ways_m`` (frames, 3) by arm, ``clouds_m`` per keyframe."""

    ways_m: dict[str, Floats]
    clouds_m: Sequence[Floats]
    walks: Sequence[BeliefWalk]


@dataclass(frozen=True)
class RecordedPatient:
    """A patient as read back; ``scene`` holds the true attachments."""

    scene: Scene
    cause: str
    grasps: Sequence[RecordedGrasp]


@dataclass(frozen=True)
class Shard:
    """``rest``: the twin's surface at rest, whose triangles all walks share."""

    number: int
    rest: Surface
    patients: Sequence[RecordedPatient]

    def walks(self) -> Iterator[tuple[RecordedPatient, RecordedGrasp, BeliefWalk]]:
        for patient in self.patients:
            for grasp in patient.grasps:
                for walk in grasp.walks:
                    yield patient, grasp, walk


class InvalidData(ValueError):
    """A folder or file that is no training data of this format."""


def write_shard(file: Path, tissue: Scene, rest: Surface, episodes: Sequence[Episode]) -> None:
    """Write a shard in one step: a file that exists is complete."""
    arrays: dict[str, NDArray[Any]] = {
        "rest_vertices": packed(rest.vertices_m),
        "triangles": rest.triangles.astype(np.int32),
        "upper": rest.upper,
        "rest_xy_m": rest.rest_xy_m.astype(np.float32),
    }
    patients = []
    for p, episode in enumerate(episodes):
        scene = episode.patient
        arrays[f"{p}/true"] = scene.attached
        grasps = []
        for g, grasp in enumerate(episode.grasps):
            for hold in grasp.holds:
                arrays[f"{p}/{g}/way_{hold.arm}_m"] = hold.way_m
            arrays[f"{p}/{g}/cloud"] = packed(np.concatenate(grasp.clouds_m))
            arrays[f"{p}/{g}/cloud_ends"] = np.cumsum([len(c) for c in grasp.clouds_m])
            for b, walk in enumerate(grasp.walks):
                arrays[f"{p}/{g}/{b}/believed"] = walk.attached
                arrays[f"{p}/{g}/{b}/vertices"] = packed(walk.vertices_m)
                arrays[f"{p}/{g}/{b}/hole_forces_n"] = walk.hole_forces_n.astype(np.float16)
                arrays[f"{p}/{g}/{b}/local_m"] = walk.local_m
            arms = [hold.arm for hold in grasp.holds]
            grasps.append({"arms": arms, "beliefs": [walk.kind for walk in grasp.walks]})
        patients.append(
            {
                "cause": episode.cause,
                "camera": scene.depth_camera.model_dump(mode="json"),
                "roi": scene.roi.model_dump(mode="json"),
                "grasps": grasps,
            }
        )
    meta = {
        "format": FORMAT,
        "tissue": tissue.model_dump(mode="json", exclude_defaults=True),
        "patients": patients,
    }
    arrays["meta"] = np.frombuffer(json.dumps(meta).encode(), np.uint8)
    partial = file.with_suffix(".part")
    with partial.open("wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays)
    os.replace(partial, file)


def read_shard(file: Path) -> Shard:
    """Read a shard back.

    Raises:
        InvalidData: the file is no shard of this format.
    """
    try:
        return _read_shard(file)
    except InvalidData:
        raise
    except _BROKEN as error:
        raise InvalidData(
            f"{file} cannot be read as a shard ({type(error).__name__}: {error}); remove it, and "
            "defras train data makes it again"
        ) from error


_BROKEN = (
    AttributeError,
    EOFError,
    IndexError,
    KeyError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What numpy, zip, JSON and the scene's model raise of a file that was cut or is something else."""


def _read_shard(file: Path) -> Shard:
    number = int(file.stem)
    with np.load(file, allow_pickle=False) as stored:
        arrays = dict(stored)
    if "meta" not in arrays:
        raise InvalidData(f"{file} is no shard of training data; defras train data makes them")
    meta = json.loads(arrays["meta"].tobytes())
    if meta.get("format") != FORMAT:
        raise InvalidData(f"{file} has the format {meta.get('format')!r}; readable is {FORMAT!r}")
    folder = file.parent.parent / "anatomies"
    tissue = Scene.model_validate(meta["tissue"], context={"folder": folder})
    rest = Surface(
        unpacked(arrays["rest_vertices"]),
        arrays["triangles"].astype(np.int64),
        arrays["upper"],
        arrays["rest_xy_m"].astype(float),
    )
    patients = []
    for p, about in enumerate(meta["patients"]):
        scene = tissue.with_attached(arrays[f"{p}/true"]).model_copy(
            update={
                "depth_camera": Camera.model_validate(about["camera"]),
                "roi": Roi.model_validate(about["roi"]),
            }
        )
        grasps = [_grasp(arrays, f"{p}/{g}", said) for g, said in enumerate(about["grasps"])]
        patients.append(RecordedPatient(scene, about["cause"], grasps))
    return Shard(number, rest, patients)


def _grasp(arrays: dict[str, NDArray[Any]], key: str, about: dict[str, Any]) -> RecordedGrasp:
    clouds = np.split(unpacked(arrays[f"{key}/cloud"]), arrays[f"{key}/cloud_ends"][:-1])
    walks = [
        BeliefWalk(
            kind,
            arrays[f"{key}/{b}/believed"],
            unpacked(arrays[f"{key}/{b}/vertices"]),
            arrays[f"{key}/{b}/hole_forces_n"].astype(float),
            arrays[f"{key}/{b}/local_m"],
        )
        for b, kind in enumerate(about["beliefs"])
    ]
    ways = {arm: arrays[f"{key}/way_{arm}_m"] for arm in about["arms"]}
    return RecordedGrasp(ways, clouds, walks)


def packed(places_m: Floats) -> NDArray[np.int16]:
    """Whole numbers of 10 micrometres.

    Raises:
        ValueError: something is farther than 327 mm from the origin.
    """
    counted = np.rint(np.asarray(places_m) / UNIT_M)
    if np.abs(counted).max(initial=0.0) > np.iinfo(np.int16).max:
        raise ValueError("training data holds places within 327 mm of the origin")
    return counted.astype(np.int16)


def unpacked(places: NDArray[np.int16]) -> Floats:
    return places.astype(float) * UNIT_M
