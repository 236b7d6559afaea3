"""Why a leaf reports what it reports: stable codes, and the remedies that help against each."""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

_EVERY_KIND = "replan learn let_go wait human"
_LOOK_AND_THINK = "replan learn let_go human"


class Remedy(StrEnum):
    """What can be done about a failure. Recovery leaves declare theirs; the rest stands in trees.

    ``wait``: hold still until it passes. ``human``: only a person can help, now or in the end.
    """

    REPLAN = "replan"
    LEARN = "learn"
    LET_GO = "let_go"
    WAIT = "wait"
    HUMAN = "human"

    @property
    def spoken(self) -> str:
        """As the subject of a sentence."""
        return {
            "replan": "a new plan",
            "learn": "learning the attachments",
            "let_go": "letting go of the tissue",
            "wait": "holding still for a while",
            "human": "a human",
        }[self.value]


class ReasonCode(StrEnum):
    """Base of the codes: a word for programs, its meaning for people, and what helps against it.

    A package with leaves of its own derives its own codes from it:

    >>> class ProbeCode(ReasonCode):
    ...     TOO_COLD = "too_cold", "the probe is below its working temperature", "wait human"
    >>> ProbeCode.TOO_COLD == "too_cold", sorted(ProbeCode.TOO_COLD.remedies)
    (True, [<Remedy.HUMAN: 'human'>, <Remedy.WAIT: 'wait'>])
    """

    meaning: str
    remedies: frozenset[Remedy]

    def __new__(cls, word: str, meaning: str, remedies: str = "") -> ReasonCode:
        member = str.__new__(cls, word)
        member._value_ = word
        member.meaning = meaning
        member.remedies = frozenset(Remedy(name) for name in remedies.split())
        return member


class Code(ReasonCode):
    """The codes of the leaves that come with this project, and of the plan slot.

    Words are kept from version to version: programs count and compare them. Remedies are given
    where the code can be the reason why motion stopped.
    """

    # Sensors
    FRESH = "fresh", "every reading is there, a number, and young enough"
    STALE = "stale", "a reading is missing, not a number, or too old", "wait human"

    # Operator
    PERMITTED = "permitted", "the operator lets the operation go on"
    STOPPED = "stopped", "the operator ended the operation", "human"
    PAUSED = "paused", "the operator paused the operation", "wait"
    TAKEN_OVER = "taken_over", "the operator drives the arms", "wait"
    PLAN_REFUSED = "plan_refused", "the operator did not approve the plan", "human"
    AWAITING_APPROVAL = "awaiting_approval", "a plan waits for the operator's approval"
    OPERATOR_HOLDS = "operator_holds", "nothing moves until the operator lets the operation go on"

    # Discrepancy between tissue and model
    CALIBRATED = "calibrated", "monitoring knows what the untouched tissue looks like"
    NOT_CALIBRATED = "not_calibrated", "the untouched tissue was not watched long enough", "wait"
    WATCHING = "watching", "the untouched tissue is being watched"
    BELOW = "below", "the warning state is lower than the one asked about"
    REACHED = "reached", "the warning state is the one asked about, or higher"
    WARNED = "warned", "the warning state is too high for motion", _EVERY_KIND
    WARNING_UNKNOWN = "warning_unknown", "the warning state is unknown", "let_go wait human"

    # Force
    ACCEPTED = "accepted", "the force is below its threshold, or above it only for a moment"
    FORCE_TOO_HIGH = "force_too_high", "the force stayed over its threshold", _EVERY_KIND
    FORCE_UNKNOWN = "force_unknown", "the force cannot be estimated", "let_go wait human"

    # Goal
    VISIBLE = "visible", "enough of the region of interest is seen"
    HIDDEN = "hidden", "too little of the region is seen, or nobody knows", _LOOK_AND_THINK
    GOAL = "goal", "the operation ended at its goal"

    # Actions of a plan
    DONE = "done", "the action is finished"
    MOVING = "moving", "the tip is on its way"
    SETTLING = "settling", "the tissue comes to rest after a manoeuvre"
    OPENING = "opening", "the jaw opens"
    CLOSING = "closing", "the jaw closes"
    HOLDING = "holding", "the arm holds tissue that it would drop or drag", _LOOK_AND_THINK
    NOT_HOLDING = "not_holding", "the arm does not hold the tissue to be moved", _LOOK_AND_THINK
    NOT_THERE = "not_there", "the arm is not at the grasp point", _LOOK_AND_THINK
    NOTHING_GRASPED = "nothing_grasped", "the jaw closed without getting hold", _LOOK_AND_THINK
    JAW_STUCK = "jaw_stuck", "the jaw did not open in time", "let_go human"

    # Plans
    PLANNED = "planned", "a plan is in place"
    NO_PLAN = "no_plan", "there is no plan to carry out", _LOOK_AND_THINK
    PLAN_READY = "plan_ready", "a plan waits for its first tick"
    PLAN_RUNNING = "plan_running", "a plan is carried out"
    PLAN_FINISHED = "plan_finished", "all actions of the plan are done", _LOOK_AND_THINK
    PLAN_FAILED = "plan_failed", "an action of the plan failed", _LOOK_AND_THINK
    PLAN_INTERRUPTED = "plan_interrupted", "motion stopped in the middle of a plan", _LOOK_AND_THINK
    FITS = "fits", "the plan was made with the attachments believed now"
    OUTDATED = (
        "outdated",
        "other attachments are believed than the plan was made with",
        (_LOOK_AND_THINK),
    )
    NOTHING_PREPARED = "nothing_prepared", "no plan was made before the operation", _LOOK_AND_THINK
    USED_ALREADY = "used_already", "the plan made before the operation was used", _LOOK_AND_THINK
    IMPOSSIBLE = "impossible", "no plan leads to the goal from here"
    PLANNER_TIMED_OUT = "planner_timed_out", "the planner did not answer in time", "wait human"

    # Learning
    ADOPTED = "adopted", "new attachments are believed"
    REJECTED = "rejected", "attachments do not explain what is seen", _EVERY_KIND
    NO_SHAPES = "no_shapes", "no shape of the tissue was seen since the grasp", _EVERY_KIND
    DUE = "due", "there is something new to learn from"
    NOT_DUE = "not_due", "nothing new was seen since the last attempt"
    PROBED = "probed", "the tissue was tugged at to learn more"
    NOT_DOUBTFUL = "not_doubtful", "learning left nothing about the attachments in doubt"
    NO_SAFE_TUG = "no_safe_tug", "no small tug is safe and would tell anything"

    # Diagnosis of a mismatch
    DIAGNOSED = "diagnosed", "somebody was found to blame for the mismatch"
    BLAMED = "blamed", "this is to blame for the mismatch"
    NOT_BLAMED = "not_blamed", "this was not found to be to blame for the mismatch"
    REGISTERED = "registered", "the camera is believed to stand where it was found to stand"

    # Grip
    NOTHING_HELD = "nothing_held", "no arm holds tissue"
    SAFE = "safe", "the grip may be kept"
    FORCE = "force", "the force speaks against keeping the grip"
    UNEXPLAINED = "unexplained", "a mismatch that nothing explains speaks against the grip"
    LET_GO = "let_go", "no arm holds tissue any more"

    # Pace, recovery, end
    NOMINAL = "nominal", "motion at full speed"
    SLOWED = "slowed", "motion at reduced speed"
    WAITING = "waiting", "holding still"
    WAITED = "waited", "held still for the time asked"
    WOULD_NOT_HELP = "would_not_help", "not tried: it does not help against what failed"
    HUMAN_HELPS = "human_helps", "a human can help with what failed"
    ASKED = "asked", "the operation ended with a call for a human"
    TIME_OVER = "time_over", "the longest time given to the operation is over"
    MOTION_REFUSED = "motion_refused", "the command gate refused motion for too long", "human"
    INTERNAL_ERROR = "internal_error", "the program broke", "human"
    GAVE_UP = "gave_up", "the operation ended without its goal"


def helps(remedy: Remedy, code: str) -> bool:
    """Whether ``remedy`` may help against a failure with ``code``.

    A code that is no :class:`ReasonCode` says nothing about remedies and rules none out.
    """
    return not isinstance(code, ReasonCode) or remedy in code.remedies


def codes_table(codes: Collection[ReasonCode] = tuple(Code)) -> str:
    """The documentation of ``codes`` as a Markdown table."""
    rows = ["| code | meaning | what helps |", "|---|---|---|"]
    for code in codes:
        remedies = ", ".join(remedy.value for remedy in Remedy if remedy in code.remedies)
        rows.append(f"| `{code.value}` | {code.meaning} | {remedies} |")
    return "\n".join(rows) + "\n"
