"""Trees that misbehave on purpose: the gate and the executive never trust them."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable

import numpy as np
import pytest
from py_trees.common import Status

from defras_bt.executive.blackboard import Blackboard
from defras_bt.executive.deadline import TreeStuck, interrupting
from defras_bt.executive.executive import REFUSED_PATIENCE_S, ExecutiveFailed
from defras_bt.executive.node import Node
from defras_bt.recording.operator_state import Act
from defras_sim.worlds.protocol import HOLD, ArmCommand, Command
from tests.executive.stage import Stage, moving, still

UP = ArmCommand(np.array([0.0, 0.0, 0.01]))
NAN, INF = float("nan"), float("inf")


def with_leaf(act: Callable[[Blackboard], None], role: str = "motion", **options: object) -> Stage:
    """A tree whose first leaf does ``act`` every tick and lets nothing else be ticked."""
    stage = Stage("fras", **options)
    leaf = next(node for node in stage.executive.tree.root.iterate() if isinstance(node, Node))

    def update() -> Status:
        act(stage.board)
        return leaf.run("rogue", "does as it likes")

    leaf.update, leaf.role = update, role
    return stage


def moves_up(board: Blackboard) -> None:
    board.move("psm1", UP)


def at_pull() -> Stage:
    stage = Stage("fras")
    stage.until_doing("pull")
    return stage


def failure_of(stage: Stage) -> ExecutiveFailed:
    with pytest.raises(ExecutiveFailed) as caught:
        stage.executive.run()
    assert stage.bench.world.sent[-1] == HOLD
    assert stage.notes.records[-1].sent == HOLD
    assert "a human is asked to take over" in stage.notes.records[-1].events[-1].sentence
    assert stage.board.outcome == "error"
    return caught.value


class TestCommands:
    """Whatever a leaf commands."""

    @pytest.mark.parametrize(
        ("command", "reason"),
        [
            (ArmCommand(np.array([NAN, 0.0, 0.0])), "the command for psm1 is not a number"),
            (ArmCommand(np.array([0.0, INF, 0.0])), "the command for psm1 is not a number"),
            (ArmCommand(np.ones(2)), "the command for psm1 has not three components"),
        ],
    )
    def test_what_is_no_velocity(self, command, reason):
        stage = with_leaf(lambda board: board.move("psm1", command))
        records = stage.ticks(0.5)
        assert all(record.sent == HOLD for record in records)
        (sentence,) = stage.notes.told("hold")
        assert reason in sentence

    @pytest.mark.parametrize("speed_m_s", [9.0, 1e300])
    def test_a_leaf_that_races(self, speed_m_s):
        fast = ArmCommand(np.array([speed_m_s, 0.0, 0.0]))
        stage = with_leaf(lambda board: board.move("psm1", fast))
        limit = stage.bench.scene.motion.reach_speed_m_s
        assert moving(stage.tick())["psm1"] == pytest.approx(limit)
        assert moving(stage.tick())["psm1"] <= limit + 1e-12

    def test_an_arm_that_is_not_there(self):
        stage = with_leaf(lambda board: board.move("psm3", UP))
        assert stage.tick().sent == HOLD
        assert "psm3 is not an arm" in stage.notes.told("hold")[0]

    def test_a_leaf_that_raises_the_rate(self):
        def races(board):
            board.rate = 2.0
            moves_up(board)

        assert with_leaf(races).tick().sent == HOLD

    def test_something_that_is_no_command_ends_the_run(self):
        def spoils(board):
            board.command = Command({"psm1": "up"})

        failure_of(with_leaf(spoils))

    def test_a_leaf_that_moves_in_spite_of_the_guards(self):
        """It hands in its command behind the tree's back; the inputs alone decide."""
        stage = with_leaf(moves_up)
        assert any(moving(stage.tick()).values())
        stage.operator(Act.PAUSE)
        assert still(stage.tick())
        stage.operator(Act.RESUME)
        assert any(moving(stage.tick()).values())
        stage.bench.world.cloud_m = None
        assert still(stage.tick())

    def test_a_leaf_that_never_stops_wanting_what_is_refused(self):
        """It wants out of the workspace for ever: a human is asked, with the reason."""
        stage = with_leaf(lambda board: board.move("psm1", ArmCommand(np.array([0.0, 0.0, NAN]))))
        stage.until_over(REFUSED_PATIENCE_S + 1.0)
        assert stage.board.outcome == "human"
        assert "motion was refused for 5 s" in stage.board.outcome_reason
        assert "not a number" in stage.board.outcome_reason
        assert all(still(record) for record in stage.notes.records)


class TestOwnership:
    """Motion comes from an action that is under way, or not at all."""

    @pytest.mark.parametrize("role", ["guard", "task", "recovery"])
    def test_a_leaf_that_is_no_action(self, role):
        stage = with_leaf(moves_up, role)
        assert still(stage.tick())
        assert "no action was under way" in stage.notes.told("hold")[0]

    def test_an_action_that_commands_as_it_is_terminated(self):
        """A guard that only the tree knows trips; the last word of the action would be motion."""
        stage = at_pull()
        action = stage.slot.current_child
        action.terminate = lambda new_status: moves_up(stage.board)
        trip(stage, "force_accepted")
        record = stage.tick()
        assert action.status == Status.INVALID
        assert record.proposed.arms["psm1"] == UP
        assert still(record)

    def test_an_action_that_commanded_before_it_was_pre_empted(self):
        """As in a parallel whose guard is ticked after the action."""
        stage = at_pull()
        root = stage.executive.tree.root
        tick = root.tick

        def tick_then_stop():
            yield from tick()
            stage.slot.stop(Status.INVALID)

        root.tick = tick_then_stop
        record = stage.tick()
        assert any(np.any(arm.linear_m_s) for arm in record.proposed.arms.values())
        assert still(record)


def trip(stage: Stage, name: str) -> None:
    (guard,) = [node for node in stage.executive.tree.root.iterate() if node.name == name][:1]
    guard.update = lambda: guard.fail("tripped", "the test says so")


class TestExceptions:
    """Motion zero, the grip kept, a human asked, the reason told."""

    @pytest.mark.parametrize("method", ["initialise", "update"])
    def test_in_a_leaf(self, method):
        stage = at_pull()
        leaf = next(n for n in stage.executive.tree.root.iterate() if n.name == "force_accepted")
        setattr(leaf, method, breaks)
        assert "ZeroDivisionError: by 0" in str(failure_of(stage))

    def test_in_terminate(self):
        stage = at_pull()
        stage.slot.current_child.terminate = breaks
        trip(stage, "force_accepted")
        assert "ZeroDivisionError: by 0" in str(failure_of(stage))

    @pytest.mark.parametrize("ends", [KeyboardInterrupt, SystemExit])
    def test_when_the_program_is_ended_the_arms_are_stopped_first(self, ends):
        stage = at_pull()

        def ended() -> Status:
            raise ends

        stage.slot.current_child.update = ended
        with pytest.raises(ends):
            stage.executive.run()
        assert stage.bench.world.sent[-1] == HOLD
        assert "the program was ended" in stage.notes.records[-1].events[-1].sentence


def breaks(*_: object) -> None:
    raise ZeroDivisionError("by 0")


class TestLateTrees:
    """A tree that takes too long, or never returns."""

    def test_in_a_world_that_does_not_wait_late_motion_is_dropped(self):
        late_s = [0.0]

        def thinks(board):
            stage.bench.world.ticks += round(late_s[0] / stage.bench.scene.tick_s)
            moves_up(board)

        stage = with_leaf(thinks)
        assert any(moving(stage.tick()).values())
        late_s[0] = 1.0
        assert stage.tick().sent == HOLD
        assert "the tree took 1.00 s" in " ".join(stage.notes.told("hold"))
        late_s[0] = 0.0
        assert any(moving(stage.tick()).values()), "what is decided on fresh readings may leave"

    @pytest.mark.parametrize("swallows", [False, True])
    def test_an_endless_loop_is_ended(self, swallows):
        def loops(board):
            moves_up(board)
            rung = 0
            while True:
                try:
                    while True:
                        pass
                except TreeStuck:
                    rung += 1
                    if not swallows or rung > 1:
                        raise

        before = signal.getsignal(signal.SIGALRM)
        stage = with_leaf(loops, deadline=interrupting(0.05))
        assert "did not return within 0.05 s" in str(failure_of(stage))
        assert all(still(record) for record in stage.notes.records)
        assert signal.getsignal(signal.SIGALRM) is before
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)

    @pytest.mark.parametrize(("role", "returns"), [("motion", False), ("recovery", True)])
    def test_only_a_recovery_may_take_longer(self, monkeypatch, role, returns):
        def thinks(board):
            end_s = time.monotonic() + 0.3
            while time.monotonic() < end_s:
                pass

        monkeypatch.setattr("defras_bt.executive.deadline._AGAIN_S", 0.05)
        stage = with_leaf(thinks, role, deadline=interrupting(0.05, recovery_s=60.0))
        if returns:
            assert stage.tick().sent == HOLD
        else:
            said = str(failure_of(stage))
            assert "OperatorHolds 'operator_holds' did not return within 0.05 s" in said

    def test_a_limit_has_to_be_positive(self):
        with pytest.raises(ValueError, match="positive"):
            interrupting(0.0)


def test_a_world_whose_clock_stands_still_does_not_run_for_ever():
    stage = at_pull()
    stage.bench.world.step = lambda: None
    for _ in range(70):
        if stage.board.outcome is not None:
            break
        stage.tick()
    assert stage.board.outcome == "human"
    assert "clock stood still" in stage.board.outcome_reason
    assert all(still(record) for record in stage.notes.records[-60:])
