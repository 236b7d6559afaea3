"""One case of the boards: data are made with a hidden cause, and the engine is asked."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from defras_bt.benchmark.cases import shipped
from defras_bt.benchmark.diagnosis_cases import BoardCase, hidden_in_table
from defras_bt.benchmark.hidden_draw import NULL, draw
from defras_bt.benchmark.hidden_noise import NoiseSpectrum
from defras_bt.benchmark.hidden_recording import reality, record
from defras_bt.benchmark.hidden_tables import arm_table, coupon_table
from defras_bt.diagnosis.baselines import asked_of_baselines
from defras_bt.diagnosis.diagnosis import Ranked
from defras_bt.diagnosis.engine import diagnose
from defras_bt.diagnosis.problem import Candidate, Problem, Samples, Tangent
from defras_bt.diagnosis.recording import RecordedRun
from defras_bt.diagnosis.recording_reader import read_recording
from defras_bt.diagnosis.twins.tables import read_problem
from defras_bt.diagnosis.twins.tissue import TissueProblem
from defras_bt.diagnosis.twins.tissue_candidates import tissue_candidates
from defras_bt.diagnosis.verdict import Verdict
from defras_sim.effects.effect import Extension
from defras_sim.geometry import Floats
from defras_sim.scene import GraspPoint
from defras_sim.worlds.error import WorldError

_BELIEVED = "sim1"
GRASPS: tuple[GraspPoint, ...] = ((2, 4), (4, 4))
"""Where tissue is taken: at both where two retractions are diagnosed together."""


@dataclass(frozen=True)
class BoardRow:
    """What was said in one case.

    ``named`` are keys; ``alike`` are all that the verdict's set holds. ``covered``: for each
    strength whose effect was named rightly, whether the 90 % interval holds the truth.
    ``baselines``: by name, (alarm, named). ``times_limit``: how far above the detection limit what
    was hidden stands; see :func:`times_limit`.
    """

    key: str
    board: str
    twin: str
    causes: list[str]
    verdict: str
    named: list[str]
    alike: list[str]
    covered: dict[str, bool]
    in_range: float | None
    beyond_range: float | None
    new_grasp: float | None
    unexplained: float | None
    wall_s: float
    baselines: dict[str, list[Any]] = field(default_factory=dict)
    error: str = ""
    times_limit: float | None = None

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Without:
    """``problem`` of tables for somebody whose library lacks ``effects``."""

    problem: Problem
    effects: tuple[str, ...]

    @property
    def samples(self) -> Samples:
        return self.problem.samples

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        return tuple(c for c in self.problem.candidates if c.effect.name not in self.effects)

    def residual(self, model: Extension) -> Floats:
        return self.problem.residual(model)

    def tangents(self, model: Extension, candidate: Candidate) -> Sequence[Tangent]:
        return self.problem.tangents(model, candidate)


@dataclass(frozen=True)
class _Material:
    problem: Problem
    beyond_range: Problem | None
    new_grasp: Problem | None
    hidden: Extension


def board_rows(
    cases: Sequence[BoardCase], *, further: bool, baselines: bool, jobs: int, grasps: int = 1
) -> Iterator[BoardRow]:
    """A row for each case, as they end. ``further``: what was gained is measured on other
    retractions, too. ``grasps``: retractions at so many points (of :data:`GRASPS`) are diagnosed
    together.

    Raises:
        ValueError: more grasps than there are.
    """
    if not 1 <= grasps <= len(GRASPS):
        raise ValueError(f"grasps: {grasps}; valid are 1 to {len(GRASPS)}")
    asked = delayed(board_row)
    work = (asked(case, further=further, baselines=baselines, grasps=grasps) for case in cases)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


def board_row(case: BoardCase, *, further: bool, baselines: bool, grasps: int = 1) -> BoardRow:
    """Make the data of a case, and ask what is wrong with them.

    Where reality itself finds no equilibrium there is nothing to ask; the row says so.
    """
    try:
        return _asked(case, further=further, baselines=baselines, grasps=grasps)
    except WorldError as error:
        nothing: dict[str, bool] = {}
        return BoardRow(
            case.key,
            case.board,
            case.twin,
            list(case.causes),
            "",
            [],
            [],
            nothing,
            None,
            None,
            None,
            None,
            0.0,
            {},
            str(error),
        )


def _asked(case: BoardCase, *, further: bool, baselines: bool, grasps: int) -> BoardRow:
    with TemporaryDirectory() as folder:
        made = _made(case, Path(folder), further=further, grasps=grasps)
        problem: Problem = made.problem
        if case.board == "lacking" and case.twin != "tissue":
            problem = Without(problem, _effects(case))
        began = time.perf_counter()
        told = diagnose(
            problem,
            np.random.default_rng(case.seed),
            beyond_range=made.beyond_range if case.board == "one" else None,
            new_grasp=made.new_grasp if case.board == "one" else None,
        )
        wall_s = time.perf_counter() - began
        others: dict[str, list[Any]] = {}
        if baselines:
            for name, said in asked_of_baselines(problem).items():
                others[name] = [bool(said.alarm), said.named]
    verdict = told.verdict
    gain = verdict.gain
    chance = told.rounds[0].threshold if told.rounds else 0.0
    return BoardRow(
        case.key,
        case.board,
        case.twin,
        list(case.causes),
        verdict.verdict,
        [_key(cause.effect, cause.site) for cause in verdict.causes],
        list(verdict.ambiguous),
        _covered(verdict, made.hidden) if case.board == "one" else {},
        gain.in_range,
        gain.beyond_range,
        gain.new_grasp,
        verdict.unexplained_share,
        round(wall_s, 2),
        others,
        times_limit=times_limit(told.ranking, chance, case.causes),
    )


def times_limit(ranking: Sequence[Ranked], chance: float, causes: Sequence[str]) -> float | None:
    """How many times stronger the weakest of what was hidden is than what would just be told from
    chance; None where nothing was.

    What a cause explains of held-out data beside the plain model grows with the square of its
    strength; at the limit it is what ``chance`` reaches.
    """
    if not causes or chance <= 0.0:
        return None

    def explains(cause: str) -> float:
        known = [r.held_out for r in ranking if cause in (r.key, r.key.split("@")[0])]
        return max(known, default=0.0)

    weakest = max(min(explains(cause) for cause in causes), 0.0)
    return round(float(np.sqrt(weakest / chance)), 2)


def _made(case: BoardCase, folder: Path, *, further: bool, grasps: int) -> _Material:
    rng = np.random.default_rng([case.seed, *case.key.encode()])
    if case.twin == "tissue":
        return _retraction(case, folder, rng, further=further, grasps=grasps)
    hidden = hidden_in_table(case, rng)
    file = folder / "measured.csv"
    (arm_table if case.twin == "arm" else coupon_table)(file, hidden, rng)
    return _Material(read_problem([file], case.twin), None, None, hidden)


def _retraction(
    case: BoardCase, folder: Path, rng: np.random.Generator, *, further: bool, grasps: int
) -> _Material:
    scene = shipped(_BELIEVED)
    drawn = [draw(scene, cause, case.seed) for cause in case.causes or (NULL,)]
    hidden: dict[str, dict[str, float]] = {}
    for one in drawn:
        hidden |= {effect: dict(values) for effect, values in one.hidden.items()}
    actual = reality(scene, hidden)
    candidates = tissue_candidates(_effects(case) if case.board == "lacking" else ())

    def recorded(point: GraspPoint, number: int) -> RecordedRun:
        # Other retractions go other ways: their heights and speeds are drawn anew.
        script = draw(scene, NULL, case.seed + 7919 * number, point).script
        file = folder / f"measured_{number}.mcap"
        record(actual, drawn[0].script if number == 0 else script, NoiseSpectrum(), rng, file)
        return read_recording(file, scene, None)

    def problem(*runs: RecordedRun, to_score: bool) -> TissueProblem:
        return TissueProblem(scene, runs, candidates, jobs=1, to_score=to_score)

    first = [recorded(GRASPS[0], 0)]
    if grasps > 1:
        first.append(recorded(GRASPS[1], 2))
    main = problem(*first, to_score=False)
    if not further or case.board != "one":
        return _Material(main, None, None, hidden)
    again = problem(recorded(GRASPS[0], 1), to_score=True)
    if grasps > 1:
        return _Material(main, again, None, hidden)  # no grasp is new
    return _Material(main, again, problem(recorded(GRASPS[1], 2), to_score=True), hidden)


def _effects(case: BoardCase) -> tuple[str, ...]:
    """The effects that a case hides."""
    return tuple(cause.split("@")[0] for cause in case.causes)


def _key(effect: str, site: str) -> str:
    return f"{effect}@{site}" if site else effect


def _covered(verdict: Verdict, hidden: Extension) -> dict[str, bool]:
    found = {}
    for cause in verdict.causes:
        for name, truth in hidden.get(cause.effect, {}).items():
            estimate = cause.parameters.get(name)
            if estimate is not None:
                low, high = estimate.interval90
                found[f"{cause.effect}.{name}"] = bool(low <= truth <= high)
    return found
