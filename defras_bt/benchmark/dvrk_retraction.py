"""Retractions by a dVRK's stand-in over a real ROS master: the protocol of table 2."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from defras_bt.benchmark.cases import Case
from defras_bt.benchmark.dvrk_fault_judge import read_facts
from defras_bt.benchmark.dvrk_patient import write_scene
from defras_bt.benchmark.force_error import ForceError
from defras_bt.benchmark.own_process import ProcessFailed, in_own_process
from defras_bt.benchmark.preparations import Plans, Preparations
from defras_bt.benchmark.retraction import Row
from defras_bt.dvrk.laboratory import at_robot_speed, open_world
from defras_bt.dvrk.settings import Ros1Transport, load_setup
from defras_bt.dvrk.stand_in.belief import measured_belief
from defras_bt.dvrk.stand_in.imperfections import read_imperfections
from defras_bt.dvrk.stand_in.order import WorldName
from defras_bt.dvrk.stand_in.ros_master import RosMaster
from defras_bt.dvrk.stand_in.set_up import SETUP_FILE, set_up_of
from defras_bt.dvrk.stand_in.stand_in_process import StandInProcess
from defras_bt.executive.executive import ExecutiveFailed
from defras_bt.executive.operation import ROBOT_WORLD, Operation, operate_in, random_generators
from defras_bt.executive.tree_file import read_tree
from defras_bt.planning.preparation import needs_plan
from defras_sim.resources import resource
from defras_sim.scene import Scene

_RUN_S = 3600.0
MAX_TIME_S = 300.0


@dataclass(frozen=True)
class DvrkSetting:
    """``patient``: the world behind the stand-in. ``speed``: of its clock, at most."""

    patient: WorldName = "bullet"
    imperfections: str = "lab"
    speed: float = 1.0


def dvrk_rows(
    cases: Sequence[Case],
    trees: Sequence[str],
    setting: DvrkSetting,
    preparations: Preparations,
    *,
    seed: int = 0,
    done: frozenset[str] = frozenset(),
) -> Iterator[Row]:
    """Run every case with every tree, one after the other, except those in ``done``."""
    plans = Plans(preparations)
    for case in cases:
        for tree in trees:
            row = Row(case.name, case.relation, tree, {})
            if row.key in done:
                continue
            believed, actual = case.scenes()
            imperfections = read_imperfections(setting.imperfections)
            believed = measured_belief(believed, imperfections, setting.patient)
            setup = set_up_of(Ros1Transport().master_uri, believed)
            tree_file = resource(f"trees/{tree}.yaml")
            plan = None
            if needs_plan(read_tree(tree_file)):
                plan = plans.plan(believed, 0, seed)
            threshold_n = plans.threshold_n(believed)
            operation = Operation(
                scene=at_robot_speed(believed, setup),
                actual=None,
                scene_file=f"{believed.name}.yaml",
                actual_file=None,
                world=ROBOT_WORLD,
                tree_file=tree_file,
                seed=seed,
                force_threshold_n=threshold_n,
                preoperative=plan,
                max_time_s=MAX_TIME_S,
            )
            yield Row(case.name, case.relation, tree, _values(operation, believed, actual, setting))


def _values(
    operation: Operation, believed: Scene, actual: Scene, setting: DvrkSetting
) -> dict[str, Any]:
    """The content of run.json, with the true force from the stand-in's record."""
    with TemporaryDirectory(prefix="defras_table2_") as folder:
        try:
            return in_own_process(
                _operate, operation, believed, actual, setting, Path(folder), within_s=_RUN_S
            )
        except ProcessFailed as error:
            return {"outcome": "error", "error": str(error).strip().splitlines()[-1]}


def _operate(
    operation: Operation, believed: Scene, actual: Scene, setting: DvrkSetting, folder: Path
) -> dict[str, Any]:
    files = {name: folder / f"{name}.yaml" for name in ("believed", "actual")}
    write_scene(believed, files["believed"])
    write_scene(actual, files["actual"])
    arguments = (
        str(files["believed"]), "--actual", str(files["actual"]), "--world", setting.patient,
        "--imperfections", setting.imperfections, "--clock", "simulated",
        "--speed", str(setting.speed), "--seed", str(operation.seed),
        "--set-up", str(folder / "lab"), "--witness", str(folder / "witness.jsonl"),
    )  # fmt: skip
    with (
        RosMaster(folder / "ros") as master,
        StandInProcess(master, arguments, folder / "stand_in.log"),
    ):
        world = open_world(load_setup(folder / "lab" / SETUP_FILE), operation.scene, folder)
        force = ForceError()
        try:
            _, rng = random_generators(operation.seed)
            values = dict(operate_in(world, operation, rng, [force]).values)
        except ExecutiveFailed as error:
            values = {**force.summary, "outcome": "error", "error": str(error)}
    felt_n = [fact["force_n"] for fact in _arm_facts(folder / "witness.jsonl")]
    return {**values, **force.values(), "force_max_true_n": max(felt_n, default=0.0)}


def _arm_facts(witness: Path) -> list[Any]:
    return [fact for fact in read_facts(witness) if fact["event"] == "arm"]
