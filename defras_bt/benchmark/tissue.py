"""Tissue models side by side: force and shape against the converged solution, and time."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter, process_time

import numpy as np

from defras_bt.benchmark.tissue_bed import BED_MOTIONS, OverBed, over_bed
from defras_bt.benchmark.tissue_models import (
    TOOL_SPEED_M_S,
    BulletSlab,
    FelupeTissue,
    MujocoSlab,
    OwnTissue,
    TissueContestant,
    mujoco_is_installed,
)
from defras_bt.benchmark.tissue_motions import (
    CHECKPOINT_M,
    MOTIONS,
    OFF_CENTRE_LIFT,
    Motion,
)
from defras_bt.benchmark.tissue_paths import PathResult, summary
from defras_bt.benchmark.tissue_reference import MATERIALS, reference
from defras_sim.geometry import Floats
from defras_sim.scene import MaterialName

STEP_M = 0.001
# A force is right if it is off by at most this share, or by this much.
FORCE_SHARE, FORCE_N = 0.05, 0.005
# So many steps of random paths must end in equilibrium.
CONVERGED_PERCENT = 99.5
# Errors of small forces say little in per cent; these are left out of that number.
_TELLING_N = 0.02
OWN, FELUPE, BULLET, MUJOCO = "defras", "felupe", "PyBullet", "MuJoCo flex"


@dataclass(frozen=True)
class Case:
    """One model on one motion. Lists have an entry for each checkpoint that was reached.

    ``force_error`` is the length of the difference of force vectors as a share of what is allowed;
    ``force_ratio`` compares sizes. ``frames_s`` (n,) are wall times of 1 mm (static models) or
    5 mm (dynamic ones) of the tip's way, ``computing_s`` (n,) what all cores together worked for
    them: on a busy machine that compares models better. ``fault`` says why a model stopped early.
    """

    kind: str
    model: str
    motion: Motion
    material: MaterialName
    forces_n: Floats
    force_error: Floats
    force_ratio: Floats
    shape_median_m: Floats
    shape_p95_m: Floats
    frames_s: Floats
    computing_s: Floats
    simulated_s: float
    fault: str

    @property
    def computing_per_simulated_s(self) -> float:
        return float(np.sum(self.computing_s)) / self.simulated_s

    def __str__(self) -> str:
        error, frame_ms = _worst(self.force_error), 1e3 * np.median(self.frames_s)
        return (
            f"{self.model}, {self.motion.title.lower()}, {self.material}: force error at most "
            f"{error:.2f} of what is allowed, {frame_ms:.3g} ms a frame"
        )

    def row(self) -> dict[str, object]:
        """What the table says about the case."""
        telling = self.force_ratio[np.isfinite(self.force_ratio)]
        return {
            "model": self.model,
            "motion": self.motion.title,
            "material": self.material,
            "checkpoints": len(self.force_error),
            "force, worst ratio": _farthest_from_one(telling),
            "force error / allowed": _worst(self.force_error),
            "shape median mm": 1e3 * _worst(self.shape_median_m),
            "shape 95 % mm": 1e3 * _worst(self.shape_p95_m),
            "frame median ms": 1e3 * float(np.median(self.frames_s)),
            "frame 99 % ms": 1e3 * float(np.percentile(self.frames_s, 99)),
            "computing ms a frame": 1e3 * float(np.median(self.computing_s)),
            "computing s per simulated s": self.computing_per_simulated_s,
            "fault": self.fault,
        }


@dataclass(frozen=True)
class Growth:
    """Computing of a frame, all cores together, by the size of the mesh."""

    kind: str
    cells_xyz: tuple[int, int, int]
    unknowns: int
    frame_s: float

    def __str__(self) -> str:
        mesh = "x".join(map(str, self.cells_xyz))
        return f"{self.kind}, {mesh}: {1e3 * self.frame_s:.3g} ms a frame"

    def row(self) -> dict[str, object]:
        return {
            "model": self.kind,
            "mesh": "x".join(map(str, self.cells_xyz)),
            "unknowns": self.unknowns,
            "computing ms a frame": 1e3 * self.frame_s,
        }


@dataclass(frozen=True)
class Work:
    """A case to measure, by name, so that progress can tell of it."""

    title: str
    run: Callable[[], Case | Growth | OverBed]


def works(*, quick: bool) -> Iterator[Work]:
    """Everything that the benchmark measures, one after the other."""
    motions = (OFF_CENTRE_LIFT,) if quick else MOTIONS
    for motion in motions:
        for material in MATERIALS:
            make = partial(OwnTissue, motion, material)
            yield _work(OWN, make, motion, material, STEP_M, motion.length_m)
    for motion in motions if quick else BED_MOTIONS:
        for material in MATERIALS:
            yield Work(f"{motion.title} over a bed", partial(over_bed, motion, material))
    for motion in motions:
        felupe = partial(FelupeTissue, motion, "neo_hookean")
        bullet, mujoco = partial(BulletSlab, motion), partial(MujocoSlab, motion)
        most = 0.010 if quick else motion.length_m
        yield _work(FELUPE, felupe, motion, "neo_hookean", STEP_M, most)
        yield _work(BULLET, bullet, motion, "neo_hookean", CHECKPOINT_M, most)
        if mujoco_is_installed():
            yield _work(MUJOCO, mujoco, motion, "neo_hookean", CHECKPOINT_M, most)
    steps = 5 if quick else 12
    for cells in ((4, 4, 1), (8, 8, 1), (12, 12, 1)) if quick else _MESHES:
        yield Work(f"{OWN} {cells}", partial(growth, OWN, OwnTissue, cells, steps))
        if max(cells) <= (8 if quick else 16):
            yield Work(f"{FELUPE} {cells}", partial(growth, FELUPE, FelupeTissue, cells, steps))


_MESHES = (
    (4, 4, 1),
    (6, 6, 1),
    (8, 8, 1),
    (10, 10, 1),
    (12, 12, 1),
    (16, 16, 1),
    (16, 16, 2),
    (24, 24, 2),
)


def _work(
    kind: str,
    make: Callable[[], TissueContestant],
    motion: Motion,
    material: MaterialName,
    step_m: float,
    most_m: float,
) -> Work:
    run = partial(follow, kind, make, motion, material, step_m, most_m)
    return Work(f"{kind}, {motion.title}, {material}", run)


def follow(
    kind: str,
    make: Callable[[], TissueContestant],
    motion: Motion,
    material: MaterialName,
    step_m: float,
    most_m: float,
) -> Case:
    """Let a model go ``most_m`` along a motion in steps, and compare it at every checkpoint."""
    model = make()
    right = reference(motion.name, material)
    every = round(CHECKPOINT_M / step_m)
    tips = motion.tips(step_m)[: round(most_m / step_m)]
    frames, computing, forces, surfaces, fault = [], [], [], [], ""
    for number, tip in enumerate(tips, start=1):
        begun, worked = perf_counter(), process_time()
        try:
            model.go_to(tip)
        except ArithmeticError as error:
            fault = f"stopped after {1e3 * step_m * (number - 1):.0f} mm: {error}"
            break
        force_n = model.force_n()
        frames.append(perf_counter() - begun)
        computing.append(process_time() - worked)
        if number % every == 0:
            forces.append(force_n)
            surfaces.append(model.surface_m())
    found = np.array(forces).reshape(-1, 3)
    wanted = right.forces_n[: len(found)]
    size = np.linalg.norm(wanted, axis=1)
    allowed = np.maximum(FORCE_SHARE * size, FORCE_N)
    off = np.linalg.norm(
        np.array(surfaces).reshape(len(found), -1, 3) - right.surfaces_m[: len(found)], axis=2
    )
    return Case(
        kind=kind,
        model=model.title,
        motion=motion,
        material=material,
        forces_n=found,
        force_error=np.linalg.norm(found - wanted, axis=1) / allowed,
        force_ratio=np.where(size >= _TELLING_N, np.linalg.norm(found, axis=1) / size, np.nan),
        shape_median_m=np.median(off, axis=1),
        shape_p95_m=np.percentile(off, 95, axis=1),
        frames_s=np.array(frames),
        computing_s=np.array(computing),
        simulated_s=max(1, len(frames)) * step_m / TOOL_SPEED_M_S,
        fault=fault,
    )


def growth(
    kind: str,
    make: Callable[[Motion, MaterialName, tuple[int, int, int]], OwnTissue | FelupeTissue],
    cells_xyz: tuple[int, int, int],
    steps: int,
) -> Growth:
    """Frames of the off-centre lift's first millimetres on one mesh, after two to warm up."""
    model = make(OFF_CENTRE_LIFT, "neo_hookean", cells_xyz)
    frames = []
    for tip in OFF_CENTRE_LIFT.tips(STEP_M)[: steps + 2]:
        worked = process_time()
        model.go_to(tip)
        frames.append(process_time() - worked)
    return Growth(kind, cells_xyz, model.unknowns, float(np.median(frames[2:])))


def targets(cases: Sequence[Case], ends: Sequence[PathResult]) -> list[dict[str, object]]:
    """What the model is meant to reach, and what it reached; ``ends`` are those of random paths."""
    own = [case for case in cases if case.kind == OWN]
    frames = np.concatenate([case.frames_s for case in own])
    lines = [
        _target("force error / allowed, worst", _worst(_all(own, "force_error")), 1.0, below=True),
        _target(
            "shape, median mm, worst", 1e3 * _worst(_all(own, "shape_median_m")), 0.5, below=True
        ),
        _target("shape, 95 % mm, worst", 1e3 * _worst(_all(own, "shape_p95_m")), 2.0, below=True),
        _target("frame of 1 mm, median ms", 1e3 * float(np.median(frames)), 16.0, below=True),
        _target("frame of 1 mm, 99 % ms", 1e3 * float(np.percentile(frames, 99)), 50.0, below=True),
    ]
    plain = [case for case in own if case.material == "neo_hookean"]
    felupe = [case for case in cases if case.kind == FELUPE and len(case.frames_s)]
    if felupe:
        ratio = np.median(_all(felupe, "computing_s")) / np.median(_all(plain, "computing_s"))
        lines.append(_target("times faster than felupe, same mesh", float(ratio), 8.0, below=False))
    bullet = [case for case in cases if case.kind == BULLET and len(case.frames_s)]
    if bullet:
        theirs = np.mean([case.computing_per_simulated_s for case in bullet])
        ours = np.mean([case.computing_per_simulated_s for case in plain])
        lines.append(
            _target(
                "times more simulated seconds per second than PyBullet",
                float(theirs / ours),
                3.0,
                below=False,
            )
        )
    if ends:
        paths = summary(ends)
        name = f"steps that converged on {paths.paths} random paths, %"
        lines.append(_target(name, 100.0 * paths.converged, CONVERGED_PERCENT, below=False))
    return lines


def notes(*, quick: bool) -> list[str]:
    """How the numbers came about."""
    load = os.getloadavg()[0]
    said = [
        "Reference: 27-node hexahedra, 24x24x2, in equilibrium by felupe. No bed, no gravity: "
        "every motion then has one smooth branch. Allowed: 5 % of the force or 0.005 N, whichever "
        "is larger, as the length of the difference of the vectors.",
        "Over a bed: this model alone, since every model has a law of contact of its own.",
        "Static models go 1 mm a frame; dynamic ones move the tool at 15 mm/s. PyBullet runs its "
        "own neo-Hookean law, MuJoCo St. Venant-Kirchhoff (it warns of an ill-conditioned solve); "
        "felupe runs the same mesh with 27 points an element and without dents.",
        f"Frames are wall times on {os.cpu_count()} cores, begun at a load of {load:.1f}; "
        "ratios are of computing, the work of all cores together.",
    ]
    if not mujoco_is_installed():
        said.append("MuJoCo is not installed, so it is missing: pip install 'defras[bench]'.")
    if quick:
        said.append("Quick: one motion, and only its first 10 mm on other models.")
    return said


def _all(cases: Sequence[Case], field: str) -> Floats:
    return np.concatenate([getattr(case, field) for case in cases])


def _worst(values: Floats) -> float:
    return float(np.max(values, initial=0.0))


def _farthest_from_one(ratios: Floats) -> float | None:
    return float(ratios[np.argmax(np.abs(np.log(ratios)))]) if len(ratios) else None


def _target(name: str, value: float, goal: float, *, below: bool) -> dict[str, object]:
    met = value <= goal if below else value >= goal
    sign = "at most" if below else "at least"
    return {
        "": name,
        "measured": value,
        "target": f"{sign} {goal:g}",
        "met": "yes" if met else "no",
    }
