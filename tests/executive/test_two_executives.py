"""Two executives in one process share nothing: each does what it would do alone."""

import py_trees
import pytest

from defras_bt.recording.operator_state import Act
from tests.executive.stage import Stage

TICKS = 80


def did(record):
    """What a tick did, as far as a tree decides it."""
    arms = {
        name: (tuple(command.linear_m_s), command.jaw_rad)
        for name, command in record.sent.arms.items()
    }
    return dict(record.node_status), arms, record.plan_step


def events_of(stage, tick, disturbed):
    """Let something happen to a disturbed stage at fixed ticks."""
    if disturbed and tick == 20:
        stage.warn(2)
    if disturbed and tick == 40:
        stage.warn(0)
        stage.bench.board.ports.write("strange", object())
    if disturbed and tick == 60:
        stage.operator(Act.STOP, "the pedal was pressed")


def alone(disturbed):
    stage, history = Stage("defras"), []
    for tick in range(TICKS):
        events_of(stage, tick, disturbed)
        if stage.board.outcome is None:
            history.append(did(stage.tick()))
    return history


@pytest.mark.parametrize("first", [False, True])
def test_interleaved_executives_do_what_they_do_alone(first):
    stages = {first: Stage("defras"), (not first): Stage("defras")}
    histories = {False: [], True: []}
    for tick in range(TICKS):
        for disturbed, stage in stages.items():
            events_of(stage, tick, disturbed)
            if stage.board.outcome is None:
                histories[disturbed].append(did(stage.tick()))
    assert histories == {False: alone(False), True: alone(True)}
    assert "strange" not in stages[False].board.ports


def test_the_blackboard_of_the_whole_process_stays_empty():
    stage = Stage("defras")
    stage.ticks(1.0)
    assert py_trees.blackboard.Blackboard.storage == {}
