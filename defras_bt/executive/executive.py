"""The executive: it owns the clock and closes the loop from the world to the world."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from py_trees.visitors import VisitorBase

from defras_bt.acting.actions import action_leaves
from defras_bt.executive.acting_leaves import ActionVisitor
from defras_bt.executive.blackboard import Blackboard, TickInputs
from defras_bt.executive.context import Context
from defras_bt.executive.deadline import Deadline
from defras_bt.executive.gate import CommandGate, GateVerdict, Proposal
from defras_bt.executive.handover import Handover
from defras_bt.executive.loader import LoadedTree, build_tree
from defras_bt.executive.perception import Perception
from defras_bt.executive.reasons import Code
from defras_bt.executive.statuses import TickedVisitor
from defras_bt.executive.substitution import NOTHING_SUBSTITUTED, Substitutes
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.why import WhyTeller
from defras_bt.recording.operator_state import UNATTENDED, Operator
from defras_bt.recording.record import Event, Recorder, TickRecord
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import HOLD, Command, World

# So long a tree may want motion that the gate refuses before a human is asked.
REFUSED_PATIENCE_S = 5.0
# A tree that took longer than this to decide is spoken of: a robot stands still meanwhile.
COMPUTED_S = 1.0
# So many ticks the world's clock may stand still: no patience in world time would ever end then.
CLOCK_PATIENCE_TICKS = 60


class ExecutiveFailed(RuntimeError):
    """Something broke while operating; motion was stopped and the grip kept."""


class Executive:
    """Runs one tree in one world until the tree decides the outcome or time is over.

    One tick: observe, sense, track the twin, monitor, tick the tree, check the command, send it,
    record, put a new plan into the tree, let time pass.
    """

    def __init__(
        self,
        tree_file: Path,
        context: Context,
        world: World,
        perception: Perception,
        recorder: Recorder,
        max_time_s: float,
        deadline: Deadline = nullcontext,
        substitutes: Substitutes = NOTHING_SUBSTITUTED,
        operator: Operator = UNATTENDED,
    ) -> None:
        self._context = context
        self._board: Blackboard = context.board
        self._world = world
        self._perception = perception
        self._recorder = recorder
        self._max_time_s = max_time_s
        self._deadline = deadline
        self._substitutes = substitutes
        spec = read_tree(tree_file)
        self.substituted = substitutes.paths(spec)
        self.tree: LoadedTree = substitutes.into_tree(build_tree(spec, context), context)
        self._board.metric = self.tree.metric
        self._ticked = TickedVisitor(self._board, self.tree)
        self._actions = ActionVisitor()
        self._visitors: list[VisitorBase] = [self._ticked, self._actions]
        self._gate = CommandGate(context.scene, self.tree.metric)
        self._why = WhyTeller()
        self._operator = operator
        self._handover = Handover(self._board, self.tree.plan_slot)
        self._held_s = 0.0
        self._tick = 0
        self._state_before = 0
        self._over_before = False
        self._stopped_before: tuple[str, ...] = ()
        self._refused_since_s: float | None = None
        self._clock_s, self._clock_ticks = float("-inf"), 0
        self.last: TickRecord | None = None
        """The record of the latest tick."""

    def watch(self, visitor: VisitorBase) -> None:
        """Let ``visitor`` see every node of the tree as it is ticked."""
        self._visitors.append(visitor)

    def run(self) -> None:
        """Tick until there is an outcome; it stands on the blackboard then.

        Raises:
            ExecutiveFailed: after any exception. Motion is zero, the grip is kept, and what
                happened stands in the last record.
            KeyboardInterrupt: the operator ended the program; the same holds.
        """
        try:
            while self._board.outcome is None:
                self.tick()
        except Exception as error:
            failure = ExecutiveFailed(f"{type(error).__name__}: {error}")
            self._stop_after(failure)
            raise failure from error
        except BaseException as error:
            self._stop_after(ExecutiveFailed(f"the program was ended ({type(error).__name__})"))
            raise

    def _stop_after(self, failure: ExecutiveFailed) -> None:
        """Motion zero first; then the outcome, and a last record."""
        try:
            self._world.command(HOLD)
        except Exception as error:
            self._board.end("error", str(failure), Code.INTERNAL_ERROR)
            self._record_failure(f"The world did not take the order to stop ({error}): {failure}")
            raise failure from error
        self._board.end("error", str(failure), Code.INTERNAL_ERROR)
        self._record_failure(
            f"Motion stopped, the grip is kept, a human is asked to take over: {failure}"
        )

    def tick(self) -> None:
        """One tick, without the care that :meth:`run` takes of exceptions."""
        board = self._board
        operator = self._operator.state()
        inputs = self._perception.update(self._tick, self._world.observe(), operator)
        board.begin_tick(inputs)
        self._handover.update()
        if self._tick == 0 and self.substituted:
            self._tell_substituted()
        self._tell_changes(inputs)
        with self._deadline():
            self._tick_tree()
        returned_s = self._world.time_s
        self._tell_computed(returned_s - inputs.time_s)
        if board.awaits_approval or operator.holds:
            self._held_s += self._context.scene.tick_s
        if board.watched_s - self._held_s >= self._max_time_s and board.outcome is None:
            board.tell("end", f"Stopped after {inputs.time_s:.0f} s without the goal.", "error")
            why = f"time is over after {inputs.time_s:.0f} s"
            board.end("not_reached", why, Code.TIME_OVER)
        self._end_if_clock_stands(inputs.time_s)
        proposal = Proposal(board.command, board.rate, self._actions.acting, returned_s)
        verdict = self._gate.check(proposal, inputs)
        self._tell_stopped(verdict)
        sent = verdict.command if board.outcome is None else HOLD
        self._world.command(sent)
        self._perception.sent(inputs.time_s, sent)
        self._record(inputs, sent)
        self._splice()
        self._tick += 1
        self._operator.idle()
        self._world.step()

    def _tick_tree(self) -> None:
        """As py_trees' BehaviourTree does it, in half the time: it asks every visitor each time
        whether it wants to see every node.
        """
        for visitor in self._visitors:
            visitor.initialise()
        for node in self.tree.root.tick():
            for visitor in self._visitors:
                visitor.run(node)

    def _splice(self) -> None:
        """Put a plan that a node brought into the tree; it is carried out from the next tick on."""
        board, slot = self._board, self.tree.plan_slot
        if board.new_plan is None:
            return
        if slot is None:
            raise ValueError(f"tree {self.tree.name} makes plans but has no plan_slot")
        leaves = action_leaves(board.new_plan, self._context)
        slot.fill(self._substitutes.into_plan(slot, self.tree.root, leaves, self._context))
        board.plan, board.new_plan = board.new_plan, None

    def _tell_substituted(self) -> None:
        """Nobody may take a trial for an operation."""
        self._board.tell(
            "start",
            "This is a trial: these nodes do not act but say what a script tells them: "
            f"{', '.join(self.substituted)}.",
            "warning",
        )

    def _tell_changes(self, inputs: TickInputs) -> None:
        """Say when the warning state or the force rose."""
        board = self._board
        state = board.warning_state or 0
        if state > self._state_before:
            what = ("slower, and learning", "stop, learn, plan anew", "stop, ask a human")[
                state - 1
            ]
            board.tell(
                "warning",
                f"Warning state {state}: the tissue is {board.mu_m * 1e3:.1f} mm off the model; "
                f"{what}.",
                "warning",
                {"state": state},
            )
        self._state_before = state
        over = inputs.force_n > inputs.force_threshold_n
        if over and not self._over_before:
            board.tell(
                "force",
                f"The estimated force is {inputs.force_n:.2f} N, "
                f"over {inputs.force_threshold_n:.2f} N: slower.",
                "warning",
            )
        self._over_before = over

    def _tell_computed(self, took_s: float) -> None:
        """Say why a robot stood still; the time of a simulated world does not pass meanwhile.

        Before the first tick nothing moved anyway: much is loaded only then.
        """
        if self._tick > 0 and took_s > COMPUTED_S:
            self._board.tell(
                "hold",
                f"The arms held still for {took_s:.1f} s, until this was worked out.",
                "warning",
                {"took_s": took_s},
            )

    def _tell_stopped(self, verdict: GateVerdict) -> None:
        """Say, once, that the gate stopped motion which the tree had wanted."""
        wanted = self._board.command.arms.values()
        moving = any(arm.moves for arm in wanted)
        stopped = verdict.reasons if moving else ()
        if stopped and stopped != self._stopped_before:
            sentence = f"The command gate stopped motion: {'; '.join(stopped)}."
            self._board.tell("hold", sentence, "warning")
        self._stopped_before = stopped
        self._end_if_refused_for_long(stopped)

    def _end_if_clock_stands(self, time_s: float) -> None:
        """Where time does not pass, nothing that waits for it would ever end the run."""
        self._clock_ticks = self._clock_ticks + 1 if time_s <= self._clock_s else 0
        self._clock_s = time_s
        if self._clock_ticks >= CLOCK_PATIENCE_TICKS and self._board.outcome is None:
            why = f"the world's clock stood still for {CLOCK_PATIENCE_TICKS} ticks"
            sentence = f"Motion stopped, a human is asked to take over: {why}."
            self._board.tell("human", sentence, "error")
            self._board.end("human", why, Code.STALE)

    def _end_if_refused_for_long(self, stopped: tuple[str, ...]) -> None:
        """A tree that goes on wanting what the gate refuses does not know what to do."""
        now_s = self._board.watched_s
        if not stopped or self._refused_since_s is None:
            self._refused_since_s = now_s if stopped else None
        elif now_s - self._refused_since_s >= REFUSED_PATIENCE_S and self._board.outcome is None:
            why = f"motion was refused for {REFUSED_PATIENCE_S:g} s: {'; '.join(stopped)}"
            sentence = f"Motion stopped, a human is asked to take over: {why}."
            self._board.tell("human", sentence, "error")
            self._board.end("human", why, Code.MOTION_REFUSED)

    def _record(self, inputs: TickInputs, sent: Command) -> None:
        truth = self._world.true_force_n(), self._world.true_surface()
        known = self._known(inputs, sent, *truth)
        why = self._why.event(known, self.tree.kinds)
        self.last = known if why is None else replace(known, events=(*known.events, why))
        self._recorder.tick(self.last)

    def _known(
        self,
        inputs: TickInputs,
        sent: Command,
        true_force_n: float | None = None,
        true_surface: Surface | None = None,
    ) -> TickRecord:
        """The tick as the executive knows it; what is true only the world knows."""
        board, slot = self._board, self.tree.plan_slot
        snapshot = self._ticked.snapshot()
        return TickRecord(
            tick=inputs.tick,
            time_s=inputs.time_s,
            observation=inputs.observation,
            twin=inputs.twin,
            reading=inputs.reading,
            force_n=inputs.force_n,
            true_force_n=true_force_n,
            true_surface=true_surface,
            rate=board.rate,
            proposed=board.command,
            sent=sent,
            believed=self._context.scene.attached,
            node_status=snapshot.status,
            node_message=snapshot.message,
            node_last_status=snapshot.last_status,
            node_code=snapshot.code,
            node_decider=snapshot.decider,
            cause=snapshot.cause,
            stopped_by=snapshot.stopped_by,
            ended=board.outcome_cause,
            operator=inputs.operator,
            plan=board.plan,
            plan_step=slot.step if slot is not None else None,
            events=tuple(board.events),
        )

    def _record_failure(self, sentence: str) -> None:
        """One more record, with what the broken tick told, so that nobody has to guess."""
        board = self._board
        last = self.last or self._known(board.inputs, HOLD)
        untold: list[Event] = []
        if board.inputs.tick > last.tick:
            # The tick broke after it had sensed: this is what it knew.
            known, untold = board.inputs, board.events
            last = replace(
                last,
                time_s=known.time_s,
                observation=known.observation,
                twin=known.twin,
                reading=known.reading,
                force_n=known.force_n,
                true_force_n=None,
                true_surface=None,
                operator=known.operator,
            )
        event = Event(last.time_s, "error", "error", sentence)
        ended = board.outcome_cause
        self._recorder.tick(
            replace(
                last,
                tick=last.tick + 1,
                sent=HOLD,
                events=(*untold, event),
                cause=ended,
                ended=ended,
            )
        )
