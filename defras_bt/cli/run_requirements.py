"""What ``defras run`` refuses before anything moves: each is said in one sentence, exit code 2."""

from __future__ import annotations

from pathlib import Path

from defras_bt.cli.errors import UserError
from defras_bt.diagnosis.mismatch.nodes import DiagnoseParameters
from defras_bt.executive.operation import WORLDS
from defras_bt.executive.proof.prover import prove
from defras_bt.executive.tree_spec import TreeSpec
from defras_bt.learning.chain.estimators import NETWORK_OF
from defras_bt.learning.networks.own_weights import OwnWeights
from defras_bt.learning.nodes import LearnParameters
from defras_sim.scene import Scene


def require_safe(tree: TreeSpec, named: str) -> None:
    """A tree whose guards do not stop every motion in time is not run, in no world."""
    proof = prove(tree)
    if not proof.holds:
        claims = "; ".join(refutation.claim.statement for refutation in proof.refuted)
        raise UserError(
            f"--tree {named}: not run, because it is not proved that {claims}. "
            f"`defras tree prove {named}` shows the ticks that break it and the node at fault"
        )


def require_asked(own: OwnWeights, tree: TreeSpec) -> None:
    """Weights that no leaf of the tree asks are a mistake that nobody would notice."""
    learns = {
        spec.options.estimator
        for _, spec in tree.root.walk()
        if isinstance(spec.options, LearnParameters | DiagnoseParameters)
    }
    asked = {network for name in learns if (network := NETWORK_OF[name]) is not None}
    there = [name for name, _ in own.cards]
    if asked.isdisjoint(there):
        does = f"asks {' and '.join(sorted(asked))}" if asked else "asks no network"
        raise UserError(
            f"--weights {own.folder}: it holds weights of {' and '.join(there)}, but the tree "
            f"{tree.name} {does}; see `estimator` of LearnAttachments and DiagnoseMismatch"
        )


def require_no_trial(**options: str | Path | None) -> None:
    """Nothing is tried out on a robot.

    Raises:
        UserError: an option of simulated worlds was given.
    """
    for option, given in options.items():
        if given is not None:
            raise UserError(
                f"--{option} {given}: in simulated worlds ({', '.join(WORLDS)}) only; a robot's "
                "patient is what it is"
            )


def require_same_set_up(believed: Scene, truth: Scene) -> None:
    """What the executive takes for granted: one patient, one clock, the same arms.

    Raises:
        UserError: the actual scene is of another set-up.
    """
    if truth.hole_counts != believed.hole_counts:
        raise UserError(
            f"{believed.name} and {truth.name} have different holes "
            f"({believed.hole_counts} and {truth.hole_counts}): they are not one patient"
        )
    for key in ("tick_s", "arms"):
        if getattr(truth, key) != getattr(believed, key):
            raise UserError(
                f"{believed.name} and {truth.name} differ in {key}; an actual scene may differ "
                "from the believed one in the patient, not in the set-up"
            )
