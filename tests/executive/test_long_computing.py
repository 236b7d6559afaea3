"""A tree that learns for half a minute while a real world's time goes on.

The arms stand still meanwhile, and the run says why. Nothing that was not watched counts as waited
for: no patience is over, no jaw is stuck, no run is out of time because of it.
"""

from tests.executive.stage import Stage, still, told

COMPUTES_S = 30.0


def learning_long(**options: object) -> Stage:
    """On the way up, with a learner that takes its time and finds nothing."""
    stage = Stage("defras", **options)
    estimator, world = stage.bench.estimator, stage.bench.world
    at_once = estimator.estimate

    def estimate(*arguments):
        world.ticks += round(COMPUTES_S / stage.bench.scene.tick_s)
        return at_once(*arguments)

    estimator.estimate = estimate
    stage.until_doing("pull")
    return stage


def test_nothing_leaves_while_it_computes_and_the_run_says_why():
    stage = learning_long()
    stage.warn(1)
    (record,) = [r for r in stage.ticks(0.5) if told([r], "learning")]
    assert still(record)
    assert "The arms held still for 30.0 s, until this was worked out." in told([record], "hold")


def test_learning_on_the_way_costs_no_plan():
    stage = learning_long()
    stage.warn(1)
    stage.ticks(0.5)
    assert any(not still(record) for record in stage.ticks(1.0)), stage.where()
    assert stage.notes.told("plan")[1:] == [], "the plan goes on"


def test_learning_at_rest_leaves_its_time_to_what_comes_after():
    """What is held is let go of after the learning: the jaw has not stuck for half a minute."""
    stage = learning_long()
    stage.warn(2)
    stage.ticks(0.2)
    stage.warn(0)
    stage.ticks(3.0)
    assert stage.board.outcome is None, stage.where()


def test_a_warning_that_goes_with_the_learning_needs_no_human():
    stage = learning_long()
    stage.bench.estimator.adopts = True
    stage.bench.estimator.proposal = stage.bench.scene.attached.copy()
    stage.warn(2)
    stage.ticks(0.2)
    assert stage.board.outcome is None, stage.where()
    stage.ticks(1.0)
    assert stage.board.outcome is None, "it is watched for three seconds first"


def test_the_time_of_a_run_is_what_was_watched():
    stage = learning_long(max_time_s=0.9 * COMPUTES_S)
    stage.warn(1)
    stage.ticks(1.0)
    assert stage.board.outcome is None
    assert stage.until_over() == "not_reached"
