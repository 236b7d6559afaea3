"""Whole retractions with a hidden slip, a bumped camera, an arm that is off, or other attachments:
who is blamed, and what comes of it, where the tree asks and where it always blames attachments."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from joblib import Parallel, delayed

from defras_bt.benchmark.cases import SIMULATED, shipped
from defras_bt.benchmark.preparations import FORCE_THRESHOLD_N
from defras_bt.benchmark.retraction import Row
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import Operation, operate
from defras_bt.faults.clouds import Displaced
from defras_bt.faults.faults import FaultInjection, Faults
from defras_bt.monitoring.closest import closest_on_triangles
from defras_bt.recording.record import RunInfo, RunSummary, TickRecord
from defras_sim.resources import resource
from defras_sim.scene import ModelExtension, Scene

Hidden = Literal["nothing", "slip", "camera", "arm", "attachments", "tear"]

HIDDEN: tuple[Hidden, ...] = ("nothing", "slip", "camera", "arm", "attachments", "tear")
CULPRIT: dict[Hidden, str] = {
    "nothing": "",
    "slip": "grasp",
    "camera": "camera",
    "arm": "arm",
    "attachments": "attachments",
    "tear": "attachments",
}
"""Who should be blamed."""

ASKS, BLAMES = "asks", "blames attachments"
_MOST_S = 60.0


@dataclass(frozen=True)
class BlameCase:
    """What is believed, what is there, and what goes wrong on the way."""

    hidden: Hidden
    seed: int
    believed: Scene
    actual: Scene
    faults: Faults

    @property
    def name(self) -> str:
        return f"{self.hidden} {self.seed}"


def draw_case(hidden: Hidden, seed: int) -> BlameCase:
    """A simulated patient with something hidden; it shows while the tissue is pulled and folded."""
    digest = hashlib.sha256(f"{hidden} {seed}".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "little"))
    name = SIMULATED[rng.integers(len(SIMULATED))]
    believed = actual = shipped(name)
    faults: tuple[Displaced, ...] = ()
    # Reaching and grasping takes about 3 s, pulling 3 s, folding 3 s.
    time_s = float(rng.uniform(4.5, 7.0))
    if hidden == "slip":
        slip = {"distance_m": float(rng.uniform(0.006, 0.015)), "time_s": time_s}
        actual = _with(believed, "grasp_slip", slip)
    elif hidden == "camera":
        way_m = rng.standard_normal(3)
        offset_m = tuple((way_m * rng.uniform(0.004, 0.008) / np.linalg.norm(way_m)).tolist())
        faults = (Displaced(start_s=time_s, offset_m=offset_m),)
    elif hidden == "arm":
        turn = rng.uniform(0, 2 * np.pi)
        off_m = rng.uniform(0.005, 0.009) * np.array([np.cos(turn), np.sin(turn)])
        actual = _with(believed, "tool_offset", {"x_m": float(off_m[0]), "y_m": float(off_m[1])})
    elif hidden == "attachments":
        actual = shipped(f"{name}_{('fewer', 'more')[rng.integers(2)]}")
    elif hidden == "tear":
        hole_m = believed.holes_xy_m[rng.choice(np.flatnonzero(believed.attached))]
        torn = {"share": 1.0, "x_m": float(hole_m[0]), "y_m": float(hole_m[1]), "radius_m": 0.02}
        actual = _with(believed, "attachment_tear", {**torn, "time_s": time_s})
    return BlameCase(hidden, seed, believed, actual, Faults(faults, seed))


def run_blame(
    cases: Sequence[BlameCase], *, jobs: int, done: frozenset[str] = frozenset()
) -> Iterator[Row]:
    """Every case with both trees, except those in ``done`` (see :attr:`Row.key`)."""
    work = [
        delayed(_row)(case, tree)
        for case in cases
        for tree in (ASKS, BLAMES)
        if f"{case.name} {CULPRIT[case.hidden]} {tree}" not in done
    ]
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


class _Listener:
    """A recorder that keeps what was found and learned, and how far the twin was off at the end."""

    def __init__(self) -> None:
        self.blamed: list[str] = []
        self.last: TickRecord | None = None

    def start(self, info: RunInfo) -> None:
        pass

    def tick(self, record: TickRecord) -> None:
        for event in record.events:
            if event.kind == "diagnosis" and "cause" in event.data:
                self.blamed.append(str(event.data["cause"]))
            if event.kind == "learning" and event.data.get("adopted"):
                self.blamed.append("attachments")
        self.last = record

    def finish(self, summary: RunSummary) -> None:
        pass


def _row(case: BlameCase, tree: str) -> Row:
    listener = _Listener()
    with TemporaryDirectory() as folder:
        operation = Operation(
            scene=case.believed,
            actual=case.actual,
            scene_file=f"{case.believed.name}.yaml",
            actual_file=None,
            world="model",
            tree_file=_tree(tree, Path(folder)),
            seed=case.seed,
            force_threshold_n=case.believed.thresholds.force_n or FORCE_THRESHOLD_N,
            max_time_s=_MOST_S,
        )
        faults = FaultInjection(case.faults, case.believed, case.seed)
        try:
            values = dict(operate(operation, [listener], faults=faults).values)
        except ExecutiveFailed as error:
            values = {"outcome": "error", "error": str(error)}
    culprit = CULPRIT[case.hidden]
    said: dict[str, Any] = {
        key: values.get(key)
        for key in ("outcome", "roi_visibility", "force_max_true_n", "duration_s", "replans")
    }
    said |= {
        "blamed": " ".join(listener.blamed),
        "right": culprit in listener.blamed if culprit else not listener.blamed,
        "wrong": any(cause != culprit for cause in listener.blamed),
        "warned": any((values.get("warnings") or {}).get(state) for state in "123"),
        "off_mm": _off_mm(listener.last),
    }
    return Row(case.name, culprit, tree, said)


def _tree(tree: str, folder: Path) -> Path:
    """trees/defras.yaml; or a copy that learns attachments without asking."""
    shipped_trees = resource("trees")
    if tree == ASKS:
        return shipped_trees / "defras.yaml"
    for file in shipped_trees.glob("*.yaml"):
        shutil.copy(file, folder / file.name)
    main = folder / "defras.yaml"
    text = main.read_text(encoding="utf-8")
    main.write_text(text.replace("diagnose.yaml", "learn.yaml"), encoding="utf-8")
    return main


def _off_mm(record: TickRecord | None) -> float | None:
    """95th percentile of how far the twin's surface is from the actual one at the end; None where
    that is not known."""
    if record is None or record.twin is None or record.true_surface is None:
        return None
    if not record.twin.converged:
        return None
    surface = record.twin.surface
    corners_m = surface.vertices_m[surface.triangles]
    closest = closest_on_triangles(record.true_surface.vertices_m, corners_m)
    return float(1e3 * np.percentile(closest.distance_m, 95))


def _with(scene: Scene, effect: str, values: dict[str, float]) -> Scene:
    return scene.model_copy(update={"model": ModelExtension.of({effect: values})})
