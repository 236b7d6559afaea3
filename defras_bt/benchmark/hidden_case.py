"""One hidden cause, recorded, diagnosed and judged: a row of the boards of diagnosis."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from defras_bt.benchmark.hidden_draw import NULL, Draw, draw
from defras_bt.benchmark.hidden_noise import NoiseSpectrum
from defras_bt.benchmark.hidden_recording import ELEMENTS_XYZ, reality, record
from defras_bt.benchmark.hidden_retraction import Script
from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.diagnosis.twins.tissue import TissueProblem
from defras_bt.diagnosis.twins.tissue_candidates import tissue_candidates
from defras_bt.diagnosis.verdict import Verdict
from defras_sim.retraction import arm_for
from defras_sim.scene import GraspPoint, Scene

_FARTHER = 1.25
"""A held-out retraction goes this much farther than the one that is fitted."""


@dataclass(frozen=True)
class HiddenCase:
    """``effect`` was hidden (:data:`NULL`: nothing), and ``left_out`` of the library or not.

    ``named`` are effects that the verdict names, ``possible`` those that it could not tell apart.
    ``covered``: whether the 90 % interval of the hidden strength holds it; None where it was not
    named. Gains are None where the diagnosis could not say.
    """

    effect: str
    left_out: bool
    seed: int
    verdict: str
    named: tuple[str, ...]
    possible: tuple[str, ...]
    strength: float
    estimate: float | None
    covered: bool | None
    gain_in_range: float | None
    gain_beyond_range: float | None
    gain_new_grasp: float | None
    unexplained: float | None
    seconds: float

    @property
    def is_right(self) -> bool:
        """Named and nothing else; nothing where nothing was hidden; outside where it was left
        out."""
        if self.left_out:
            return self.verdict == "outside"
        if self.effect == NULL:
            return self.verdict == "nothing"
        return self.verdict == "named" and set(self.named) == {self.effect}


def hidden_case(
    scene: Scene,
    effect: str,
    seed: int,
    folder: Path,
    *,
    point: GraspPoint = (2, 4),
    other_point: GraspPoint = (4, 4),
    leave_out: bool = False,
    without: Collection[str] = (),
    elements_xyz: tuple[int, int, int] = ELEMENTS_XYZ,
) -> HiddenCase:
    """Hide ``effect`` in three retractions and diagnose the first of them.

    The second goes farther, the third takes the tissue at ``other_point``: there gains are
    measured. ``leave_out`` takes the hidden effect out of the library.

    Raises:
        WorldError: the actual tissue cannot be led along one of them.
    """
    drawn = draw(scene, effect, seed, point)
    actual = reality(scene, drawn.hidden, elements_xyz=elements_xyz)
    rng = np.random.default_rng([seed, 1, *effect.encode()])
    runs = []
    for name, script in _scripts(scene, drawn, other_point).items():
        file = folder / f"{effect}_{seed}_{name}.mcap"
        record(actual, script, NoiseSpectrum(), rng, file)
        runs.append(read_recording(file, scene))
        file.unlink()
    taken_out = {*without, *((effect,) if leave_out and effect != NULL else ())}
    candidates = tissue_candidates(taken_out)
    began = time.perf_counter()
    main, farther, elsewhere = (TissueProblem(scene, [run], candidates) for run in runs)
    found = diagnose(
        main, np.random.default_rng(seed), beyond_range=farther, new_grasp=elsewhere
    ).verdict
    return _judged(drawn, found, leave_out, time.perf_counter() - began)


def _scripts(scene: Scene, drawn: Draw, other_point: GraspPoint) -> dict[str, Script]:
    script = drawn.script
    farther = replace(
        script, lift_m=_FARTHER * script.lift_m, fold_m=_FARTHER * script.fold_m, hold_s=0.5
    )
    elsewhere = replace(script, arm=arm_for(scene, other_point), point=other_point, hold_s=0.5)
    return {"main": script, "farther": farther, "elsewhere": elsewhere}


def _judged(drawn: Draw, verdict: Verdict, left_out: bool, seconds: float) -> HiddenCase:
    strength = drawn.hidden[drawn.effect][drawn.strength] if drawn.hidden else 0.0
    estimate = next(
        (
            cause.parameters[drawn.strength]
            for cause in verdict.causes
            if cause.effect == drawn.effect and drawn.strength in cause.parameters
        ),
        None,
    )
    return HiddenCase(
        effect=drawn.effect,
        left_out=left_out,
        seed=drawn.seed,
        verdict=verdict.verdict,
        named=tuple(cause.effect for cause in verdict.causes),
        possible=verdict.ambiguous,
        strength=float(strength),
        estimate=None if estimate is None else estimate.value,
        covered=None
        if estimate is None
        else bool(estimate.interval90[0] <= strength <= estimate.interval90[1]),
        gain_in_range=verdict.gain.in_range,
        gain_beyond_range=verdict.gain.beyond_range,
        gain_new_grasp=verdict.gain.new_grasp,
        unexplained=verdict.unexplained_share,
        seconds=seconds,
    )
