"""Every status of a leaf comes with a reason, and the reason outlives pre-emption."""

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.executive.node import Node, NodeParameters, NoParameters, UnreportedStatus


class Told(Node):
    """Calls the given function as its update()."""

    role = "task"

    def __init__(self, update):
        super().__init__("told", None, NoParameters())
        self.body = update

    def update(self):
        return self.body(self)


@pytest.mark.parametrize(
    ("report", "status"),
    [("succeed", Status.SUCCESS), ("fail", Status.FAILURE), ("run", Status.RUNNING)],
)
def test_a_report_sets_status_code_and_message(report, status):
    node = Told(lambda node: getattr(node, report)("too_far", "7 mm away"))
    node.tick_once()
    assert node.status == node.reported_status == status
    assert (node.code, node.feedback_message) == ("too_far", "7 mm away")


def test_what_was_said_outlives_preemption():
    node = Told(lambda node: node.run("moving", "3 mm to go"))
    node.tick_once()
    node.stop(Status.INVALID)
    assert node.status == Status.INVALID
    assert node.reported_status == Status.RUNNING
    assert (node.code, node.feedback_message) == ("moving", "3 mm to go")


def test_an_answer_that_the_proofs_do_not_reckon_with_is_refused():
    class Certain(Told):
        answers = frozenset({Status.SUCCESS})

    assert Certain(lambda node: node.succeed("done", "done")).update() == Status.SUCCESS
    with pytest.raises(ValueError, match="comes with FAILURE, but its `answers` are SUCCESS"):
        Certain(lambda node: node.fail("stuck", "stuck")).tick_once()


def test_a_status_without_a_reason_is_refused():
    with pytest.raises(UnreportedStatus, match=r"Told 'told' .*self\.succeed"):
        Told(lambda node: Status.SUCCESS).tick_once()


def test_a_reason_of_an_earlier_tick_does_not_count():
    reports = iter([lambda node: node.run("moving", "on its way"), lambda node: Status.RUNNING])
    node = Told(lambda node: next(reports)(node))
    node.tick_once()
    with pytest.raises(UnreportedStatus):
        node.tick_once()


def test_a_status_other_than_the_reported_one_is_refused():
    def update(node):
        node.fail("no_cloud", "no cloud")
        return Status.SUCCESS

    with pytest.raises(UnreportedStatus):
        Told(update).tick_once()


@pytest.mark.parametrize("code", ["", "No_Cloud", "no cloud", "2_far", "no-cloud"])
def test_codes_are_snake_case(code):
    with pytest.raises(ValueError, match="snake_case"):
        Told(lambda node: node.fail(code, "why")).tick_once()


def test_a_message_for_people_is_needed():
    with pytest.raises(ValueError, match="message"):
        Told(lambda node: node.fail("no_cloud", "")).tick_once()


class Speed(NodeParameters):
    speed_m_s: float = 0.01


@pytest.mark.parametrize(
    "values", [{"speed": 1.0}, {"speed_m_s": float("nan")}, {"speed_m_s": float("inf")}]
)
def test_parameters_refuse_unknown_keys_and_numbers_that_are_none(values):
    with pytest.raises(ValidationError):
        Speed(**values)


def test_parameters_cannot_be_changed():
    with pytest.raises(ValidationError):
        Speed().speed_m_s = 1.0
