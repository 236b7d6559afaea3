"""Trees in trees/ are proved safe; unsafe changes are refuted, and the right node is blamed."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import pairwise

import pytest
from py_trees.common import Status

from defras_bt.executive.loader import build_tree
from defras_bt.executive.node import NoParameters
from defras_bt.executive.proof.blame import blame
from defras_bt.executive.proof.claims import CLAIMS
from defras_bt.executive.proof.facts import numbered
from defras_bt.executive.proof.prover import prove
from defras_bt.executive.proof.replay import NotReproduced, replay
from defras_bt.executive.proof.report import proof_text
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_spec import TreeSpec
from defras_sim.resources import resource
from tests.executive.random_trees import INNER, random_spec, spec_of
from tests.executive.unsafe_mutants import DEFRAS_MUTANTS, changed, mutant

OPERATE, LET_GO = "defras/operate", "defras/recover/give_up_grip/let_go"
GUARDS = {"guards_first", "stops_with_guard"}

# Claims of which one at least has to fall, and who is at fault.
EXPECTED = {
    "guards are not looked at again": (GUARDS, OPERATE),
    "guards are in a sequence of their own": (GUARDS, f"{OPERATE}/guards"),
    "guards run beside the plan": (GUARDS, OPERATE),
    "guards that succeeded are skipped": (GUARDS, OPERATE),
    "one guard of many is enough": ({"guards_first"}, OPERATE),
    "guards are alternatives": ({"force_dangerous", "warning_2"}, OPERATE),
    "the plan comes before its guards": ({"guards_first"}, OPERATE),
    "the force guard may fail": (GUARDS, f"{OPERATE}/ignore_failure_force_accepted"),
    "the force guard is inverted": ({"force_dangerous"}, OPERATE),
    "the sensors are looked at once": (GUARDS, f"{OPERATE}/once_sensors_fresh"),
    "a failed guard counts as waiting": (GUARDS, f"{OPERATE}/running_is_success_operator_permits"),
    "a failed warning counts as running on": (
        GUARDS | {"warning_2"},
        f"{OPERATE}/running_is_success_failure_is_running_warning_below",
    ),
    "no look at the sensors": ({"readings_missing"}, OPERATE),
    "no look at the force": ({"force_dangerous"}, OPERATE),
    "no look at the warning state": ({"warning_2", "warning_unknown"}, OPERATE),
    "warning state 2 is let pass": ({"warning_2"}, OPERATE),
    "the force may be too high for ten seconds": ({"force_dangerous"}, OPERATE),
    "no human at warning state 3": ({"warning_3"}, LET_GO),
    "no human when the operator stops": ({"warning_3"}, LET_GO),
    "a running branch keeps its turn": ({"warning_3"}, "defras"),
    "recovery before the human": ({"warning_3"}, LET_GO),
    "jaws open without a look at the sensors": ({"readings_missing"}, LET_GO),
    "letting go is not interrupted": ({"readings_missing"}, LET_GO),
    "everything beside everything": ({"guards_first", "warning_3"}, "defras"),
    "the human is asked beside the rest": ({"warning_3"}, "defras/success_is_failure_human"),
}


@pytest.fixture(scope="module")
def defras():
    return read_tree(resource("trees") / "defras.yaml")


@pytest.mark.parametrize(
    "file", sorted(path.name for path in resource("trees").glob("*.yaml")), ids=str
)
def test_every_tree_that_comes_with_this_project_is_safe(file):
    proof = prove(read_tree(resource("trees") / file))
    assert proof.holds, proof_text(proof)


def test_also_with_a_plan_of_600_actions(defras):
    assert prove(defras, [600]).holds


def test_every_claim_is_looked_at_where_it_concerns_the_tree(defras):
    assert prove(defras, [1]).claims == CLAIMS
    unmonitored = prove(replace(defras, metric=None), [1]).claims
    assert {claim.name for claim in CLAIMS} - {claim.name for claim in unmonitored} == {
        "warning_2",
        "warning_3",
        "warning_unknown",
    }


@pytest.mark.parametrize("name", DEFRAS_MUTANTS)
def test_an_unsafe_change_is_refuted_by_ticks_that_py_trees_repeats(defras, name):
    """Every example is carried out by py_trees before it is told."""
    proof = prove(mutant(defras, name), [1])
    claims, at_fault = EXPECTED[name]
    refuted = {refutation.claim.name: refutation for refutation in proof.refuted}
    assert claims <= set(refuted)
    assert all(refutation.happens for refutation in proof.refuted)
    for claim in claims:
        found = blame(refuted[claim].trace, refuted[claim].claim)
        assert found.node.path == at_fault, found.sentence


def test_the_report_names_the_composite_its_place_and_the_ticks(defras):
    text = proof_text(prove(mutant(defras, "guards are not looked at again"), [1]))
    lines = text.splitlines()
    assert lines[0].startswith("✗ guards_first: no motion leaf is ticked unless")
    assert "✓ well_kept: every tick and every new plan leave the tree in a state" in text
    at = next(i for i, line in enumerate(lines) if "at fault" in line)
    assert "at fault: defras/operate (sequence, " in lines[at]
    assert "trees/defras.yaml:" in lines[at]
    assert "it does not look at defras/operate/sensors_fresh in this tick" in lines[at]
    assert "These 2 ticks break it" in lines[at + 1]
    assert [line.split(":")[0] for line in lines if line.startswith("  tick")][:2] == [
        "  tick 1",
        "  tick 2",
    ]


def test_what_is_not_known_to_happen_is_not_proved_either(toys):
    """Push can never be reached, but the proof starts from any state."""
    never = spec_of(toys.registry, "success_is_failure", [spec_of(toys.registry, "Watch")])
    root = spec_of(toys.registry, "sequence", [never, spec_of(toys.registry, "Push")], name="n")
    proof = prove(TreeSpec("n", "", root))
    (first, *_) = proof.refuted
    assert (first.claim.name, first.happens, len(first.trace.ticks)) == ("guards_first", False, 1)
    assert not proof.holds
    text = proof_text(proof)
    assert "It is not proved: this tick would break it." in text
    assert "at fault: n (sequence, tree.yaml:1:1)" in text


def test_an_example_that_py_trees_does_not_repeat_is_never_told(defras):
    (refutation, *_) = prove(mutant(defras, "no look at the force")).refuted
    (tick,) = refutation.trace.ticks
    wrong = {**tick.after, "defras/operate": Status.INVALID}
    with pytest.raises(NotReproduced, match=r"defras/operate is Status\.\w+ in py_trees"):
        replay(replace(refutation.trace, ticks=(replace(tick, after=wrong),)))


# The prover against simulation and against the check of files, on random trees.

SIMPLE = (*INNER, *["reactive", "sequence", "parallel"] * 5)


def well_guarded(node, index, succeeded):
    """Whether the guard leaves that stand beside child ``index`` as its guards all succeeded.

    Read off plainly, other than the prover does it: guard leaves that stand alone, before the child
    under a reactive or sequence, or anywhere beside it under a parallel.
    """
    beside = node.children if node.spec.kind == "parallel" else node.children[:index]
    if node.spec.kind not in ("reactive", "sequence", "parallel"):
        return True
    guards = [n for n in beside if n.is_leaf and n.spec.kind == "Watch"]
    return all(guard.path in succeeded for guard in guards)


def breached(toys, tree, chance, ticks):
    """The claims about guards that py_trees breaks with leaves that answer at random."""

    class Chance:
        def __init__(self):
            self.log = []

        def next_status(self, name, default):
            return chance.choice([Status.SUCCESS] * 2 + [Status.FAILURE, Status.RUNNING])

    loaded, root, broken = build_tree(tree, Chance()), numbered(tree.root), set()
    motions = {
        path: list(pairwise(way_to(root, path)))
        for path, spec in tree.root.walk()
        if spec.kind == "Push"
    }
    for _ in range(ticks):
        paths = loaded.paths()
        shown = {paths[node.id]: node.status for node in loaded.root.tick()}
        succeeded = {path for path, status in shown.items() if status == Status.SUCCESS}
        after = {paths[node.id]: node.status for node in loaded.root.iterate()}
        for motion, way in motions.items():
            guarded = all(
                well_guarded(node, node.children.index(child), succeeded) for node, child in way
            )
            if motion in shown and not guarded:
                broken.add("guards_first")
            if after[motion] == Status.RUNNING and (motion not in shown or not guarded):
                broken.add("stops_with_guard")
    return broken


def way_to(root, path):
    yield root
    for child in root.children:
        if f"{path}/".startswith(f"{child.path}/"):
            yield from way_to(child, path)


def test_nothing_that_is_proved_ever_happens(toys):
    chance = random.Random(5)
    proved_with_motion = broken = unknown = refutations = 0
    for _ in range(70):
        spec = random_spec(
            toys.registry,
            chance,
            inner=SIMPLE,
            leaves=("Watch", "Push", "Push", "Think"),
            guard_first=0.8,
            deepest=3,
            most_children=3,
        )
        tree = TreeSpec("n", "", spec)
        refuted = {refutation.claim.name: refutation for refutation in prove(tree, [0]).refuted}
        assert "well_kept" not in refuted
        seen = breached(toys, tree, chance, 40)
        assert seen <= set(refuted)
        broken += bool(seen)
        refutations += len(refuted)
        unknown += sum(not refutation.happens for refutation in refuted.values())
        moves = any(s.kind == "Push" for _, s in spec.walk())
        proved_with_motion += moves and not GUARDS & set(refuted)
    assert proved_with_motion > 3
    assert broken > 5
    # Where a motion can never be reached, a state from which it would be wrong remains unrefuted.
    assert unknown < 0.05 * refutations, "most refutations come with a run that py_trees repeated"


# The argument that three actions stand for any number, tried out on py_trees itself.


def shown_by_slot(toys, tree, plan_length, answers, ticks):
    """Status of every node outside the slot, and what becomes of each action, tick by tick."""

    class Told:
        def __init__(self):
            self.log, self.tick = [], 0

        def next_status(self, name, default):
            return answers[self.tick][name]

    context = Told()
    loaded = build_tree(tree, context)
    names = [f"a{step}" for step in range(plan_length)]
    loaded.plan_slot.fill([toys.Push(name, context, NoParameters()) for name in names])
    history = []
    for tick in range(ticks):
        context.tick = tick
        ticked = {node.name for node in loaded.root.tick()}
        statuses = {node.name: node.status for node in loaded.root.iterate()}
        history.append((ticked, statuses))
    return history


def test_three_actions_stand_for_any_number(toys):
    """Blocks before and after an action answer as the last action ticked in them did."""
    chance = random.Random(3)
    compared = 0
    for _ in range(300):
        spec = random_spec(toys.registry, chance, leaves=("Watch", "Think", "plan_slot"), deepest=3)
        if sum(s.kind == "plan_slot" for _, s in spec.walk()) != 1:
            continue
        tree = TreeSpec("n", "", spec)
        length, ticks = 8, 6
        leaves = [*(s.name for _, s in spec.walk()), *(f"a{step}" for step in range(length))]
        likely = [Status.SUCCESS] * 4 + [Status.FAILURE, Status.RUNNING]
        answers = [{name: chance.choice(likely) for name in leaves} for _ in range(ticks)]
        long = shown_by_slot(toys, tree, length, answers, ticks)
        middle = 4
        blocks = {"a0": range(middle), "a1": [middle], "a2": range(middle + 1, length)}
        short_answers = []
        for told, (ticked, _) in zip(answers, long, strict=True):
            last = {
                name: max((f"a{s}" for s in block if f"a{s}" in ticked), default=None)
                for name, block in blocks.items()
            }
            shown = {name: told[action] for name, action in last.items() if action is not None}
            short_answers.append({**told, **dict.fromkeys(blocks, Status.RUNNING), **shown})
        short = shown_by_slot(toys, tree, 3, short_answers, ticks)
        outside = [s.name for _, s in spec.walk()]
        for (long_ticked, long_status), (short_ticked, short_status) in zip(
            long, short, strict=True
        ):
            assert {n: long_status[n] for n in outside} == {n: short_status[n] for n in outside}
            assert (f"a{middle}" in long_ticked) == ("a1" in short_ticked)
            assert long_status[f"a{middle}"] == short_status["a1"]
            compared += f"a{middle}" in long_ticked
    assert compared > 20


def test_longer_plans_refute_nothing_more(defras):
    """On mutants, where there is something to refute."""
    for name in ("the sensors are looked at once", "no look at the force"):
        tree = mutant(defras, name)
        short = {refutation.claim.name for refutation in prove(tree).refuted}
        long = {refutation.claim.name for refutation in prove(tree, [5]).refuted}
        assert long == short


def test_changes_are_made_where_they_are_said_to_be(defras):
    assert set(DEFRAS_MUTANTS) == set(EXPECTED)
    with pytest.raises(LookupError, match="nothing at defras/nowhere"):
        changed(defras.root, "defras/nowhere", lambda spec: spec)
