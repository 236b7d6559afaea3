"""asp/retraction.lp, rule by rule: one case where it allows and one where it forbids."""

from __future__ import annotations

import pytest
from clingo import Control, Function, Number, parse_term

from defras_bt.planning.facts import scene_facts, world_atoms
from defras_bt.planning.plan import ArmSituation, Situation
from defras_sim.resources import resource

FREE = ArmSituation()
AT = ArmSituation(at=(2, 5))
READY = ArmSituation(at=(2, 5), jaw_open=True)
HELD = ArmSituation(holding=(2, 5))
PULLED = ArmSituation(holding=(2, 5), done=("pull",))
MOVED = ArmSituation(holding=(2, 5), done=("pull", "move"))
FOLDED = ArmSituation(holding=(2, 5), done=("pull", "fold"))


def one_step(scene, psm1, psm2, *, target, blocked=(), do=None):
    """Atoms of an answer set over one step in which the tissue is to be held at ``target``."""
    control = Control(["--warn=none"])
    control.load(str(resource("asp/retraction.lp")))
    control.add("base", [], scene_facts(scene))
    control.ground([("base", []), ("step", [Number(1)])])
    situation = Situation({"psm1": psm1, "psm2": psm2}, frozenset(blocked))
    for atom in world_atoms(situation, ("pull", "fold"), target):
        control.assign_external(atom, True)
    used = Function("used", [Number(1)])
    assumed = [(used, do is not None)]
    if do is not None:
        assumed.append((parse_term(f"do({do},1)"), True))
    with control.solve(yield_=True, assumptions=assumed) as handle:
        model = handle.model()
        return None if model is None else {str(atom) for atom in model.symbols(atoms=True)}


POSSIBLE = [
    # action, psm1, psm2, target, blocked
    ("reach(psm1)", FREE, FREE, (2, 5), []),
    ("reach(psm2)", FREE, FREE, (2, 1), []),
    ("reach(psm1)", FREE, FREE, (2, 3), []),  # on the plane: both
    ("reach(psm2)", FREE, FREE, (2, 3), []),
    ("reach(psm1)", FREE, FREE, (2, 5), [(1, 5)]),
    ("reach(psm1)", AT, FREE, (3, 5), []),
    ("reach(psm1)", FREE, ArmSituation(at=(2, 1)), (2, 5), []),
    ("open(psm1)", AT, FREE, (2, 5), []),
    ("grasp(psm1)", READY, FREE, (2, 5), []),
    ("pull(psm1)", HELD, FREE, (2, 5), []),
    ("pull(psm1)", HELD, ArmSituation(at=(2, 1)), (2, 5), []),
    ("move(psm1)", PULLED, FREE, (2, 5), []),
    ("fold(psm1)", PULLED, FREE, (2, 5), []),
    ("fold(psm1)", MOVED, FREE, (2, 5), []),
    ("release(psm1)", HELD, FREE, (2, 5), []),
    ("release(psm1)", HELD, FREE, (2, 5), [(2, 5)]),
]

IMPOSSIBLE = [
    ("reach(psm2)", FREE, FREE, (2, 5), []),  # the other arm's side
    ("reach(psm1)", FREE, FREE, (2, 1), []),
    ("reach(psm1)", FREE, FREE, (2, 5), [(2, 5)]),  # blocked
    ("reach(psm1)", HELD, FREE, (3, 5), []),  # jaw full
    ("reach(psm1)", AT, FREE, (2, 5), []),  # there already
    ("reach(psm1)", FREE, ArmSituation(at=(2, 3)), (2, 3), []),  # the other arm is there
    ("open(psm1)", FREE, FREE, (2, 5), []),  # nowhere
    ("open(psm1)", READY, FREE, (2, 5), []),  # open already
    ("open(psm1)", HELD, FREE, (2, 5), []),  # only release opens a full jaw
    ("open(psm1)", AT, FREE, (2, 5), [(2, 5)]),
    ("grasp(psm1)", AT, FREE, (2, 5), []),  # jaw closed
    ("grasp(psm1)", ArmSituation(jaw_open=True), FREE, (2, 5), []),  # not at the point
    ("grasp(psm1)", READY, FREE, (2, 5), [(2, 5)]),
    ("grasp(psm1)", HELD, FREE, (2, 5), []),
    ("pull(psm1)", READY, FREE, (2, 5), []),  # holds nothing
    ("pull(psm1)", PULLED, FREE, (2, 5), []),  # done since the grasp
    ("pull(psm1)", HELD, FREE, (3, 5), [(2, 5)]),  # blocked
    ("pull(psm1)", HELD, ArmSituation(holding=(2, 1)), (2, 5), []),  # would tear the tissue
    ("move(psm1)", HELD, FREE, (2, 5), []),  # not pulled
    ("move(psm1)", MOVED, FREE, (2, 5), []),
    ("move(psm1)", FOLDED, FREE, (2, 5), []),  # would unfold
    ("move(psm1)", PULLED, FREE, (3, 5), [(2, 5)]),
    ("fold(psm1)", HELD, FREE, (2, 5), []),
    ("fold(psm1)", FOLDED, FREE, (2, 5), []),
    ("fold(psm1)", PULLED, ArmSituation(holding=(2, 1)), (2, 5), []),
    ("release(psm1)", READY, FREE, (2, 5), []),  # holds nothing
]


@pytest.mark.parametrize(("action", "psm1", "psm2", "target", "blocked"), POSSIBLE)
def test_possible(scene, action, psm1, psm2, target, blocked):
    atoms = one_step(scene, psm1, psm2, target=target, blocked=blocked)
    assert f"possible({action},1)" in atoms


@pytest.mark.parametrize(("action", "psm1", "psm2", "target", "blocked"), IMPOSSIBLE)
def test_impossible(scene, action, psm1, psm2, target, blocked):
    atoms = one_step(scene, psm1, psm2, target=target, blocked=blocked)
    assert f"possible({action},1)" not in atoms
    assert one_step(scene, psm1, psm2, target=target, blocked=blocked, do=action) is None


@pytest.mark.parametrize(
    ("psm2", "clear"),
    [
        (ArmSituation(holding=(2, 2)), False),  # 10 mm away
        (ArmSituation(holding=(1, 2)), False),  # 18 mm
        (ArmSituation(holding=(2, 1)), True),  # 20 mm
        (ArmSituation(at=(2, 2)), True),  # not holding
    ],
)
def test_no_reaching_close_to_where_the_other_arm_holds(crowded, psm2, clear):
    atoms = one_step(crowded, FREE, psm2, target=(2, 3))
    assert ("possible(reach(psm1),1)" in atoms) == clear


EFFECTS = [
    # action, psm1, target, true afterwards, false afterwards
    ("reach(psm1)", AT, (3, 5), ["at(psm1,target,1)"], ["at(psm1,elsewhere,1)"]),
    ("reach(psm1)", READY, (3, 5), ["jaw_open(psm1,1)"], ["holding(psm1,target,1)"]),
    ("open(psm1)", AT, (2, 5), ["jaw_open(psm1,1)", "at(psm1,target,1)"], ["holds_tissue(psm1,1)"]),
    ("grasp(psm1)", READY, (2, 5), ["holding(psm1,target,1)"], ["jaw_open(psm1,1)"]),
    ("pull(psm1)", HELD, (2, 5), ["done(psm1,pull,1)"], ["done(psm1,fold,1)"]),
    ("move(psm1)", PULLED, (2, 5), ["done(psm1,move,1)", "done(psm1,pull,1)"], []),
    ("fold(psm1)", PULLED, (2, 5), ["done(psm1,fold,1)", "holding(psm1,target,1)"], []),
    (
        "release(psm1)",
        PULLED,
        (2, 5),
        ["jaw_open(psm1,1)"],
        ["holding(psm1,target,1)", "done(psm1,pull,1)", "at(psm1,target,1)"],
    ),
]


@pytest.mark.parametrize(("action", "psm1", "target", "true", "false"), EFFECTS)
def test_effect(scene, action, psm1, target, true, false):
    atoms = one_step(scene, psm1, ArmSituation(at=(2, 1)), target=target, do=action)
    assert set(true) <= atoms
    assert not set(false) & atoms
    assert "at(psm2,elsewhere,1)" in atoms, "the other arm stays where it is"


def test_exactly_one_action_a_step(scene):
    atoms = one_step(scene, HELD, ArmSituation(holding=(2, 1)), target=(2, 5), do="release(psm2)")
    assert [atom for atom in atoms if atom.startswith("do(")] == ["do(release(psm2),1)"]
