"""Why a tick went as it did: from the root of the tree to the leaf that decided, in sentences."""

from __future__ import annotations

from dataclasses import dataclass

from defras_bt.recording.moment import Moment, NodeWord
from defras_bt.recording.record import Cause

_SELECTORS = ("selector", "reactive_selector")
_SEQUENCES = ("sequence", "reactive")


@dataclass(frozen=True)
class Explanation:
    """One tick in sentences.

    ``when`` names the tick; ``decided`` what decided it, or how the run ended with it; ``stop`` why
    no plan was carried out ("" where one was); ``chain`` how the tree came from its root to the
    leaf that decided, a sentence a node.
    """

    when: str
    decided: str
    stop: str = ""
    chain: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        """What decided and why no plan was carried out, in one line."""
        return f"{self.decided} {self.stop}".rstrip()

    @property
    def text(self) -> str:
        """Everything, the chain a line a node."""
        chain = [f"  {number}. {said}" for number, said in enumerate(self.chain, 1)]
        return "\n".join([f"{self.when}: {self.summary}", *chain])


def explain(moment: Moment) -> Explanation:
    """The explanation of one tick, from its record alone."""
    when = f"Tick {moment.tick}, {moment.time_s:.2f} s"
    if moment.cause is None:
        return Explanation(when, "The tree was not ticked.")
    decided = _sentence(moment.cause)
    if moment.ended is not None:
        decided = f"The operation ended. {_sentence(moment.ended)}"
    if moment.cause == moment.ended and not moment.cause.path:
        # The executive itself broke: no node decided, and what they said is of the tick before.
        return Explanation(when, decided)
    stopped = moment.stopped_by
    stop = ""
    if stopped is not None and stopped.message not in (moment.cause.message, decided):
        stop = f"No plan was carried out: {_sentence(stopped, start=False)}"
    return Explanation(when, decided, stop, tuple(_chain(moment)))


def spoken(name: str) -> str:
    """A node's name as one would say it: ``3_grasp_psm1`` is "grasp psm1 (step 3)"."""
    first, _, rest = name.partition("_")
    if first.isdigit() and rest:
        return f"{rest.replace('_', ' ')} (step {first})"
    return name.replace("_", " ")


def _sentence(cause: Cause, *, start: bool = True) -> str:
    """What a leaf said as a sentence, with its code for whoever looks it up."""
    said = cause.message.rstrip(".")
    if start:
        said = said[:1].upper() + said[1:]
    return f"{said} [{cause.code}]."


def _chain(moment: Moment) -> list[str]:
    """A sentence for each node from the root to the leaf that decided."""
    path = moment.root
    said = []
    while path is not None:
        word = moment.nodes[path]
        name = spoken(path.rpartition("/")[2])
        if word.decider is None:
            said.append(f'"{name}": {_sentence(Cause(word.code, word.message), start=False)}')
            break
        said.append(_inner(moment, path, name, word))
        path = f"{path}/{word.decider}"
    return said


def _inner(moment: Moment, path: str, name: str, word: NodeWord) -> str:
    kind = moment.kinds.get(path, "")
    decider = spoken(str(word.decider))
    before = _ticked_before(moment, path, str(word.decider))
    if kind in _SELECTORS and word.status == "FAILURE":
        others = _list([*before, (decider, moment.nodes[f"{path}/{word.decider}"])])
        return f'"{name}" had no alternative left: {others}.'
    if kind in _SELECTORS:
        instead = f"; before it, these did not apply: {_list(before)}" if before else ""
        return f'"{name}" chose "{decider}"{instead}.'
    if kind in _SEQUENCES and word.status == "FAILURE":
        return f'"{name}" was stopped by "{decider}".'
    if kind in _SEQUENCES:
        after = f", after {_list(before)}" if before else ""
        verb = "came to its end with" if word.status == "SUCCESS" else "was at"
        return f'"{name}" {verb} "{decider}"{after}.'
    if kind == "plan_slot":
        verb = "failed" if word.status == "FAILURE" else "was carried out"
        return f'The plan {verb} at "{decider}".'
    if kind == "invert":
        return f'"{name}" says the opposite of "{decider}".'
    return f'"{name}" went as "{decider}" did.'


def _ticked_before(moment: Moment, path: str, decider: str) -> list[tuple[str, NodeWord]]:
    """The siblings of the decider that were ticked before it in this tick, with their words."""
    siblings = []
    for child in moment.children(path):
        name = child.rpartition("/")[2]
        if name == decider:
            break
        if moment.nodes[child].ticked:
            siblings.append((spoken(name), moment.nodes[child]))
    return siblings


def _list(nodes: list[tuple[str, NodeWord]]) -> str:
    return "; ".join(f'"{name}" ({word.message.rstrip(".")})' for name, word in nodes)
