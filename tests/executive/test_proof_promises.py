"""What the proof counts on is what the leaves do."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from py_trees.common import Status

from defras_bt.executive.dangers import LONGEST_PATIENCE_S, WORLD
from defras_bt.executive.registry import builtin_nodes
from defras_bt.executive.testing import EPSILON_N, NodeBench
from defras_bt.recording.operator_state import NOBODY, Mode, OperatorState
from defras_sim.worlds.protocol import HOLD

Situation = Callable[[NodeBench], None]


def says(**inputs: object) -> Situation:
    return lambda bench: bench.says.update(inputs)


def force_for(over_s: float, force_n: float = 2 * EPSILON_N) -> Situation:
    def put(bench: NodeBench) -> None:
        bench.says.update(force_n=force_n, force_over_s=over_s)
        bench.board.force_over_s = over_s

    return put


def warning(state: int | None) -> Situation:
    return lambda bench: bench.warn(state)


SITUATIONS: dict[tuple[str, str], list[Situation]] = {
    ("readings", "fresh"): [says(missing=())],
    ("readings", "missing"): [says(missing=("no cloud",)), says(missing=("a", "b"))],
    ("operator", "permits"): [says(operator=NOBODY)],
    ("operator", "pauses"): [says(operator=OperatorState(Mode.PAUSED, "a pause was asked for"))],
    ("operator", "drives"): [says(operator=OperatorState(Mode.TAKEN_OVER, "the arms are driven"))],
    ("operator", "stops"): [says(operator=OperatorState(Mode.STOPPED, "the pedal was pressed"))],
    ("force", "tolerable"): [force_for(0.0, 0.1), force_for(0.3)],
    ("force", "dangerous"): [
        force_for(LONGEST_PATIENCE_S),
        force_for(99.0),
        force_for(0.0, math.nan),
        force_for(LONGEST_PATIENCE_S, math.inf),
    ],
    ("warning", "unknown"): [
        warning(None),
        lambda bench: bench.warn(0, mu_m=math.nan),
        lambda bench: setattr(bench.board, "metric", None),
    ],
    **{("warning", str(state)): [warning(state)] for state in range(4)},
}
"""What each value of a variable of the world looks like to a leaf."""

PARAMETERS = {
    "ForceAccepted": [{"patience_s": 0.0}, {"patience_s": 0.5}, {"patience_s": 1.0}],
    "WarningBelow": [{"state": state} for state in (1, 2, 3)],
    "WarningReached": [{"state": state} for state in (1, 2, 3)],
    "Wait": [{"seconds": 1.0}],
    "MismatchIs": [{"cause": "grasp"}],
}
ALL = [(*key, index) for key, some in SITUATIONS.items() for index in range(len(some))]


def test_every_value_of_the_world_is_tried():
    assert set(SITUATIONS) == {(name, value) for name, values in WORLD.items() for value in values}


KNOWING = {
    "SensorsFresh": "readings",
    "OperatorPermits": "operator",
    "OperatorHolds": "operator",
    "WaitForOperator": "operator",
    "ForceAccepted": "force",
    "WarningBelow": "warning",
    "WarningReached": "warning",
}
"""Leaves that the proofs of the shipped trees count on."""


@pytest.mark.parametrize("name", builtin_nodes())
@pytest.mark.parametrize("variable", WORLD)
def test_promises_are_kept(name, variable):
    node_class, kept = builtin_nodes()[name], 0
    if node_class.role == "motion":
        return
    for value in WORLD[variable]:
        for situation in SITUATIONS[variable, value]:
            for parameters in PARAMETERS.get(name, [{}]):
                bench = NodeBench()
                situation(bench)
                node = bench.node(node_class, **parameters)
                promised = node_class.promise(node.parameters, variable, value)
                status = bench.tick(node)
                assert promised in (status, None), (value, parameters)
                kept += promised is not None
    assert bool(kept) == (KNOWING.get(name) == variable)


def test_a_guard_that_is_too_patient_promises_nothing():
    node_class = builtin_nodes()["ForceAccepted"]
    patient = node_class.Parameters(patience_s=LONGEST_PATIENCE_S + 0.1)
    assert node_class.promise(patient, "force", "dangerous") is None


@pytest.mark.parametrize(("variable", "value", "index"), ALL)
@pytest.mark.parametrize("held", [False, True], ids=["nothing held", "tissue held"])
def test_leaves_answer_and_command_as_the_proof_says(variable, value, index, held):
    for name, node_class in builtin_nodes().items():
        if node_class.role == "motion":
            continue
        for parameters in PARAMETERS.get(name, [{}]):
            bench = NodeBench()
            if held:
                bench.hold()
            SITUATIONS[variable, value][index](bench)
            status = bench.tick(bench.node(node_class, **parameters))
            assert status in node_class.answers, name
            assert node_class.opens_jaws or bench.board.command == HOLD, name


def test_those_who_may_command_without_moving_do_not_move():
    bench = NodeBench()
    bench.hold()
    before_m = bench.tip_m().copy()
    (node_class,) = (leaf for leaf in builtin_nodes().values() if leaf.opens_jaws)
    assert bench.tick(bench.node(node_class)) == Status.RUNNING
    assert bench.commanded_jaw_rad() is not None
    assert (bench.tip_m() == before_m).all()
