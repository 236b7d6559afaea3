"""Plans against an independent search, and the planner's promises."""

from __future__ import annotations

import numpy as np
import pytest

from defras_bt.planning.english import plan_text
from defras_bt.planning.plan import ArmSituation, Situation
from defras_bt.planning.planner import NoPlan, Planner
from defras_bt.planning.program import PlanningTimeout
from tests.planning.conftest import make_scene
from tests.planning.oracle import Oracle

SEQUENCES = (("pull",), ("pull", "fold"), ("pull", "move"), ("pull", "move", "fold"))
IDLE = {"psm1": ArmSituation(), "psm2": ArmSituation()}


@pytest.fixture(scope="module")
def planner(scene):
    return Planner(scene)


def random_situation(rng, scene):
    columns, rows = scene.grasp.columns, scene.grasp.rows
    points = [(c, r) for c in range(1, columns + 1) for r in range(1, rows + 1)]
    rng.shuffle(points)
    points = [tuple(int(i) for i in point) for point in points]
    arms = {}
    for name, sign in (("psm1", 1), ("psm2", -1)):
        own = [p for p in points if scene.grasp_xy_m(*p)[1] * sign >= -1e-9]
        point = own[0]
        points.remove(point)
        kind = rng.integers(4)
        if kind == 0:
            arms[name] = ArmSituation(jaw_open=bool(rng.integers(2)))
        elif kind == 1:
            arms[name] = ArmSituation(at=point, jaw_open=bool(rng.integers(2)))
        else:
            done = ((), *SEQUENCES)[rng.integers(5)]
            arms[name] = ArmSituation(at=point, holding=point, done=done)
    everywhere = [(c, r) for c in range(1, columns + 1) for r in range(1, rows + 1)]
    share = rng.choice([0.0, 0.3, 0.8, 0.97])
    blocked = frozenset(p for p in everywhere if rng.random() < share)
    required = everywhere[rng.integers(len(everywhere))] if rng.random() < 0.3 else None
    return Situation(arms, blocked, SEQUENCES[rng.integers(4)]), required


def preferred(scene, ends, attached):
    """attachments_first, computed here from the positions alone."""
    held = scene.holes_xy_m[attached]

    def key(point):
        place = scene.grasp_xy_m(*point)
        away_mm = round(1000 * float(min(np.hypot(*(hole - place)) for hole in held)))
        to_roi_mm = round(1000 * float(np.hypot(*(scene.roi_center_m[:2] - place))))
        return (-(away_mm // 10), to_roi_mm, point[1], point[0])

    return min(ends, key=key)


@pytest.mark.parametrize("grid", [(3, 4, 0.045), (3, 3, 0.01)])
def test_plans_agree_with_breadth_first_search(grid):
    """Length, chosen grasp point, absence of a plan; each plan replays; warm equals cold."""
    scene = make_scene(*grid)
    planner = Planner(scene)
    rng = np.random.default_rng(20)
    unplannable = 0
    for number in range(260):
        situation, required = random_situation(rng, scene)
        attached = rng.random(len(scene.holes_xy_m)) < 0.1
        attached[rng.integers(len(attached))] = True
        oracle = Oracle(scene, situation.blocked)
        expected = oracle.shortest(situation, required)
        if expected is None:
            unplannable += 1
            with pytest.raises(NoPlan):
                planner.plan(situation, attached, required_grasp=required)
            continue
        plan = planner.plan(situation, attached, required_grasp=required)
        length, ends = expected
        assert len(plan.actions) == length
        assert plan.proved_shortest
        assert len(plan.reasons) == length
        end = oracle.exposed_at(oracle.replay(situation, plan.actions), situation.exposing)
        assert end == preferred(scene, ends, attached)
        if number % 10 == 0:
            assert Planner(scene).plan(situation, attached, required_grasp=required) == plan
    assert unplannable > 5


def test_first_plan_reads_as_english(scene, planner):
    plan = planner.plan(Situation(IDLE), scene.attached)
    lines = plan_text(plan).splitlines()
    assert lines[0] == "1. PSM2 reaches grasp point (5,1)."
    assert lines[-1] == ("5. PSM2 folds the tissue away from the endoscope, held at (5,1).")
    assert [action.name for action in plan.actions] == ["reach", "open", "grasp", "pull", "fold"]
    assert str(plan.actions[0]) == "reach(psm2,point,(5,1),1)"
    assert "121 mm from the nearest believed attachment" in plan.reasons[0]
    assert "because a closed jaw cannot grasp" in plan_text(plan, reasons=True)


def test_blocked_held_point_is_released_first(scene, planner):
    arms = {**IDLE, "psm2": ArmSituation(holding=(5, 1), done=("pull", "fold"))}
    plan = planner.plan(Situation(arms, frozenset({(5, 1)})), scene.attached)
    assert [action.name for action in plan.actions] == [
        "release",
        "reach",
        "grasp",
        "pull",
        "fold",
    ]
    assert plan.actions[1].point != (5, 1)
    assert plan.reasons[0] == "(5,1) is blocked and cannot expose the region"


DONE = ArmSituation(holding=(2, 5), done=("pull", "fold"))


@pytest.mark.parametrize(
    ("arms", "blocked", "required", "length"),
    [
        ({**IDLE, "psm1": DONE}, set(), None, 0),
        ({**IDLE, "psm1": DONE}, set(), (2, 5), 0),
        ({**IDLE, "psm1": DONE}, set(), (3, 5), 5),  # held elsewhere
        ({**IDLE, "psm1": DONE}, {(2, 5)}, None, 5),  # blocked
        ({"psm1": DONE, "psm2": ArmSituation(holding=(2, 1))}, set(), None, 1),  # other arm holds
        ({"psm1": DONE, "psm2": ArmSituation(at=(2, 1))}, set(), None, 0),
        ({**IDLE, "psm1": ArmSituation(holding=(2, 5), done=("pull",))}, set(), None, 1),
    ],
)
def test_goal(scene, planner, arms, blocked, required, length):
    plan = planner.plan(
        Situation(arms, frozenset(blocked)), scene.attached, required_grasp=required
    )
    assert len(plan.actions) == length


def test_nothing_to_do_reads_as_english(scene, planner):
    plan = planner.plan(Situation({**IDLE, "psm1": DONE}), scene.attached)
    assert plan_text(plan) == "Nothing to do: the region counts as exposed already."


def test_move_comes_before_fold(scene, planner):
    plan = planner.plan(
        Situation(IDLE), scene.attached, required_grasp=(3, 3), exposing=("pull", "move", "fold")
    )
    assert [action.name for action in plan.actions][3:] == ["pull", "move", "fold"]
    assert plan.actions[0].arm == "psm1", "the preferred arm where both reach the point"
    assert plan.reasons[0] == "the plan was asked to use (3,3)"


def test_arms_let_go_in_a_fixed_order(scene, planner):
    arms = {"psm1": ArmSituation(holding=(2, 5)), "psm2": ArmSituation(holding=(2, 1))}
    situation = Situation(arms, frozenset({(2, 5), (2, 1)}))
    plan = planner.plan(situation, scene.attached)
    assert [(a.name, a.arm) for a in plan.actions[:2]] == [("release", "psm1"), ("release", "psm2")]


def test_belief_changes_the_choice(scene, planner):
    mirrored = scene.attached.reshape(12, 12)[::-1, ::-1].ravel()
    first = planner.plan(Situation(IDLE), scene.attached).actions[0]
    second = planner.plan(Situation(IDLE), mirrored).actions[0]
    again = planner.plan(Situation(IDLE), scene.attached).actions[0]
    assert first.point == (5, 1)
    assert second.point == (1, 5)
    assert again == first


def test_without_believed_attachments_the_region_decides(scene, planner):
    plan = planner.plan(Situation(IDLE), np.zeros(144, dtype=bool))
    assert plan.actions[0].point == (4, 3)
    assert "believed attachment" not in plan.reasons[0]


@pytest.mark.parametrize(
    ("arms", "blocked", "required", "obstacles"),
    [
        (IDLE, "all", None, ["all 25 grasp points are blocked"]),
        (
            IDLE,
            {(1, 1), (2, 2)},
            (1, 1),
            ["grasp point (1,1) is blocked", "the plan must use grasp point (1,1)"],
        ),
    ],
)
def test_no_plan_says_what_is_in_the_way(scene, planner, arms, blocked, required, obstacles):
    if blocked == "all":
        blocked = {(c, r) for c in range(1, 6) for r in range(1, 6)}
    with pytest.raises(NoPlan) as caught:
        planner.plan(Situation(arms, frozenset(blocked)), scene.attached, required_grasp=required)
    assert caught.value.obstacles == tuple(obstacles)
    assert planner.plan(Situation(IDLE), scene.attached).proved_shortest, "still usable"


def test_no_plan_without_an_arm_on_that_side(scene):
    one_arm = scene.model_copy(update={"arms": {"psm2": scene.arms["psm2"]}})
    with pytest.raises(NoPlan, match=r"\(2,5\) lies on the side .* no arm reaches"):
        Planner(one_arm).plan(
            Situation({"psm2": ArmSituation()}), scene.attached, required_grasp=(2, 5)
        )


def test_no_plan_within_too_few_actions(scene):
    with pytest.raises(NoPlan, match="at most 3 actions") as caught:
        Planner(scene, max_horizon=3).plan(Situation(IDLE, exposing=("pull",)), scene.attached)
    assert caught.value.obstacles == ("the region counts as exposed only after pull",)


@pytest.mark.parametrize(
    ("situation", "options", "message"),
    [
        (Situation({"psm1": ArmSituation()}), {}, r"\['psm1'\]; the scene has \['psm1', 'psm2'\]"),
        (Situation(IDLE, frozenset({(6, 1)})), {}, r"\(6,1\) is no grasp point"),
        (Situation(IDLE), {"required_grasp": (0, 1)}, r"valid are \(1,1\) to \(5,5\)"),
        (Situation(IDLE), {"exposing": ("tug",)}, "valid: pull, move, fold"),
        (Situation(IDLE), {"exposing": ()}, "name some of"),
    ],
)
def test_a_situation_that_does_not_fit_is_refused(scene, planner, situation, options, message):
    with pytest.raises(ValueError, match=message):
        planner.plan(situation, scene.attached, **options)


def test_wrong_number_of_holes_is_refused(planner):
    with pytest.raises(ValueError, match="this scene has 144 holes"):
        planner.plan(Situation(IDLE), np.ones(3, dtype=bool))


def test_time_budget_cancels_and_leaves_the_planner_usable():
    scene = make_scene(30, 30)  # large enough that no solve is done at once
    planner = Planner(scene, budget_s=0.0)
    with pytest.raises(PlanningTimeout, match="within 0 s"):
        planner.plan(Situation(IDLE), scene.attached)
    planner.budget_s = 60.0
    assert len(planner.plan(Situation(IDLE), scene.attached).actions) == 5


def test_a_grid_of_40_by_40_works():
    scene = make_scene(40, 40)
    planner = Planner(scene, budget_s=120.0)
    plan = planner.plan(Situation(IDLE), scene.attached)
    assert len(plan.actions) == 5
    assert plan.actions[0].point == (40, 1)
