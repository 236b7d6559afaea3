"""A proof as JSON, for programs; ``ProofJson.model_json_schema()`` is its schema."""

from __future__ import annotations

from pydantic import BaseModel

from defras_bt.executive.proof.blame import blame
from defras_bt.executive.proof.prover import Proof, Refutation
from defras_bt.executive.proof.trace import TracedTick


class NodeJson(BaseModel):
    """Status of a node before and after a tick, and what it showed; null if it was not ticked."""

    before: str
    shows: str | None
    after: str


class TickJson(BaseModel):
    """One tick. ``world``: what is known about the world; ``nodes`` by path."""

    world: dict[str, str]
    new_plan: bool
    nodes: dict[str, NodeJson]


class FaultJson(BaseModel):
    """The node at fault; place and kind are null for an action of a plan."""

    path: str
    sentence: str
    kind: str | None = None
    file: str | None = None
    line: int | None = None
    column: int | None = None


class RefutationJson(BaseModel):
    """A claim that does not hold. ``happens``: the ticks are a run from the start."""

    claim: str
    happens: bool
    plan_length: int
    culprits: list[str]
    at_fault: FaultJson
    ticks: list[TickJson]


class ClaimJson(BaseModel):
    """A claim that was looked at."""

    name: str
    statement: str
    holds: bool


class ProofJson(BaseModel):
    """Everything that was found out. ``plan_length`` is null for plans of any length."""

    tree: str
    holds: bool
    plan_length: int | None
    claims: list[ClaimJson]
    refuted: list[RefutationJson]


def proof_json(proof: Proof, plan_length: int | None = None) -> ProofJson:
    """``proof`` for plans of ``plan_length`` actions, or of any length."""
    refuted = {refutation.claim.name for refutation in proof.refuted}
    return ProofJson(
        tree=proof.tree.name,
        holds=proof.holds,
        plan_length=plan_length,
        claims=[
            ClaimJson(name=c.name, statement=c.statement, holds=c.name not in refuted)
            for c in proof.claims
        ],
        refuted=[_refutation(refutation) for refutation in proof.refuted],
    )


def _refutation(refutation: Refutation) -> RefutationJson:
    found = blame(refutation.trace, refutation.claim)
    at_fault = FaultJson(path=found.node.path, sentence=found.sentence)
    if found.node.spec is not None:
        file, line, column = found.node.spec.place
        place = {"kind": found.node.spec.kind, "file": str(file), "line": line, "column": column}
        at_fault = at_fault.model_copy(update=place)
    return RefutationJson(
        claim=refutation.claim.name,
        happens=refutation.happens,
        plan_length=refutation.plan_length,
        culprits=list(refutation.trace.culprits),
        at_fault=at_fault,
        ticks=[_tick(tick) for tick in refutation.trace.ticks],
    )


def _tick(tick: TracedTick) -> TickJson:
    return TickJson(
        world=dict(tick.world),
        new_plan=tick.new_plan,
        nodes={
            path: NodeJson(
                before=tick.before[path].name,
                shows=tick.shown[path].name if path in tick.shown else None,
                after=tick.after[path].name,
            )
            for path in tick.before
        },
    )
