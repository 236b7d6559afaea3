"""The desk where front ends speak for the operator, from any thread; the executive listens."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition, RLock

from defras_bt.planning.english import plan_text
from defras_bt.planning.plan import Plan
from defras_bt.recording.operator_state import Act, DoneAct, Mode, OperatorState

NEXT: dict[Mode, dict[Act, Mode]] = {
    Mode.AUTONOMOUS: {
        Act.PAUSE: Mode.PAUSED,
        Act.TAKE_OVER: Mode.TAKEN_OVER,
        Act.STOP: Mode.STOPPED,
    },
    Mode.PAUSED: {
        Act.RESUME: Mode.AUTONOMOUS,
        Act.TAKE_OVER: Mode.TAKEN_OVER,
        Act.STOP: Mode.STOPPED,
    },
    Mode.TAKEN_OVER: {Act.HAND_BACK: Mode.AUTONOMOUS, Act.STOP: Mode.STOPPED},
    Mode.STOPPED: {},
}
"""Which mode follows which act. What an operator has taken over is only given back by handing it
back: no second front end can resume over the hands of the first."""

_REASONS = {
    Mode.AUTONOMOUS: "",
    Mode.PAUSED: "the operator paused the operation",
    Mode.TAKEN_OVER: "the operator has taken over the arms",
    Mode.STOPPED: "the operator asked to stop",
}


@dataclass(frozen=True)
class Answer:
    """What became of a request: whether it took effect, and a sentence about it."""

    accepted: bool
    sentence: str


@dataclass(frozen=True)
class DeskNotice:
    """What front ends show.

    ``question``: the plan that waits for approval, "" for none; ``plan_number`` counts the plans
    shown. ``possible``: what may be asked for now. ``sentence``: the latest news.
    """

    mode: Mode
    question: str
    plan_number: int
    possible: tuple[Act, ...]
    sentence: str = ""


@dataclass
class _Question:
    plan: Plan
    text: str
    answer: bool | None = None
    asked: bool = True


Listener = Callable[[DeskNotice], None]


class OperatorDesk:
    """Takes requests, keeps the mode, and shows plans for approval.

    A request takes effect with the next tick; it is refused, with what is possible instead, where
    it makes no sense. ``asks``: whether plans need approval. ``idle_s``: how long an idle tick
    waits; as long as a tick for simulated worlds, so that they do not race while a human thinks,
    and 0 where the world itself takes its time.

    All methods may be called from any thread, and from a signal handler.
    """

    def __init__(self, *, asks: bool = False, idle_s: float = 0.0) -> None:
        self._asks = asks
        self._idle_s = idle_s
        # Re-entrant: a signal handler may come while its own thread is inside.
        self._changed = Condition(RLock())
        self._mode = Mode.AUTONOMOUS
        self._reason = ""
        self._acts: list[DoneAct] = []
        self._question: _Question | None = None
        self._plan_number = 0
        self._listeners: list[Listener] = []
        self._closed = False

    def request(
        self, act: Act, source: str, words: str = "", plan_number: int | None = None
    ) -> Answer:
        """Ask for ``act``; ``words`` are kept with it in every record.

        ``plan_number``: the plan that the operator has read and answers; None for the one that
        waits now.
        """
        with self._changed:
            refusal = self._objection(act, plan_number)
            if refusal is not None:
                return Answer(False, refusal)
            self._acts.append(DoneAct(act, source, words))
            if self._question is not None and act in (Act.APPROVE, Act.REFUSE):
                self._question.answer = act is Act.APPROVE
            else:
                self._mode = NEXT[self._mode][act]
                said = f": {words}" if words and self._mode is not Mode.AUTONOMOUS else ""
                self._reason = f"{_REASONS[self._mode]}{said}"
            self._changed.notify_all()
        answer = Answer(True, f"From the next tick on: {act.spoken}.")
        self._tell(answer.sentence)
        return answer

    def notice(self, sentence: str = "") -> DeskNotice:
        """The state of things for a front end."""
        with self._changed:
            waiting = self._question if self._open_question() else None
            question = waiting.text if waiting is not None else ""
            return DeskNotice(self._mode, question, self._plan_number, self._possible(), sentence)

    def close(self) -> None:
        """The operation has its outcome: from now on nothing takes effect any more.

        What was asked for in its very last tick had no next tick to take effect in: that is said.
        """
        with self._changed:
            self._closed = True
            self._question = None
            late, self._acts = self._acts, []
            self._changed.notify_all()
        for done in late:
            self._tell(
                f"Too late: the operation ended before it could heed {done.act.spoken} "
                f"({done.source})."
            )
        self._tell("The operation has ended.")

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Tell ``listener`` of every change; the function returned ends that."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def state(self) -> OperatorState:
        """What the operator wants; the executive asks once a tick.

        A question that nobody has asked since the last time is withdrawn: the tree does something
        else by now.
        """
        with self._changed:
            if self._question is not None and not self._question.asked:
                self._question = None
            elif self._question is not None:
                self._question.asked = False
            acts, self._acts = tuple(self._acts), []
            return OperatorState(self._mode, self._reason, acts)

    def approve(self, plan: Plan) -> bool | None:
        """Whether ``plan`` may be carried out; None until the operator has answered.

        Ask every tick: another plan, or a tick without asking, withdraws the question.
        """
        if not self._asks:
            return True
        with self._changed:
            question = self._question
            if question is not None and question.plan is plan:
                question.asked = True
                if question.answer is not None:
                    self._question = None
                return question.answer
            self._question = _Question(plan, plan_text(plan, reasons=True))
            self._plan_number += 1
        self._tell("A plan waits for approval.")
        return None

    def idle(self) -> None:
        """Wait for a request, at most ``idle_s``, if somebody is being waited for."""
        with self._changed:
            if self._mode in (Mode.PAUSED, Mode.TAKEN_OVER) or self._open_question():
                self._changed.wait(self._idle_s)

    def _open_question(self) -> bool:
        return self._question is not None and self._question.answer is None

    def _possible(self) -> tuple[Act, ...]:
        if self._closed:
            return ()
        answers = (Act.APPROVE, Act.REFUSE) if self._open_question() else ()
        return (*NEXT[self._mode], *answers)

    def _objection(self, act: Act, plan_number: int | None) -> str | None:
        possible = self._possible()
        if act in possible:
            if act in (Act.APPROVE, Act.REFUSE) and plan_number not in (None, self._plan_number):
                return (
                    f"{act.spoken} is not possible: plan {plan_number} was replaced by plan "
                    f"{self._plan_number}; read that one first"
                )
            return None
        if not possible:
            why = "has ended" if self._closed else "was stopped"
            return f"{act.spoken} is not possible: the operation {why}"
        choice = ", ".join(other.spoken for other in possible)
        why = (
            "no plan waits for approval"
            if act in (Act.APPROVE, Act.REFUSE)
            else (_REASONS[self._mode] or "the operation goes on by itself")
        )
        return f"{act.spoken} is not possible: {why}; possible now: {choice}"

    def _tell(self, sentence: str) -> None:
        notice = self.notice(sentence)
        for listener in tuple(self._listeners):
            listener(notice)
