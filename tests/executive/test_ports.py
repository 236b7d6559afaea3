"""Values of ports are typed, and belong to one executive."""

import math

import pytest

from defras_bt.executive.node import NoParameters
from defras_bt.executive.ports import PortUnset, PortValues, Reads, WrongPortValue, ports_of
from defras_bt.executive.registry import Registry
from tests.executive.port_toys import Hold, Label, Measure, Patient, PortContext


@pytest.fixture
def context():
    return PortContext()


def leaf(node_class, context, **keys):
    made = node_class(node_class.__name__.lower(), context, NoParameters())
    made.keys = {**made.keys, **keys}
    return made


def test_what_one_leaf_writes_another_reads_under_the_same_key(context):
    context.writes = [0.25]
    leaf(Measure, context, tension_n="left").tick_once()
    leaf(Hold, context, wanted_n="left").tick_once()
    assert context.read == [0.25]


def test_without_a_tree_file_keys_are_the_names_of_the_ports(context):
    assert leaf(Measure, context).keys == {"tension_n": "tension_n"}
    assert list(ports_of(Measure)) == ["tension_n"]
    assert ports_of(Measure)["tension_n"].type_name == "number"


def test_reading_before_writing_is_an_error_that_names_the_keys(context):
    context.board.ports.write("right", 1.0)
    with pytest.raises(PortUnset, match=r"nothing was written under 'left'; keys .*: right"):
        leaf(Hold, context, wanted_n="left").tick_once()


def test_a_default_is_read_until_something_is_written(context):
    node = leaf(Patient, context)
    node.tick_once()
    context.board.ports.write("times", 7)
    node.tick_once()
    assert context.read == [3, 7]


@pytest.mark.parametrize("wrong", ["0.3", None, True, math.nan, math.inf, [0.3]])
def test_a_value_of_another_type_is_refused_when_it_is_written(context, wrong):
    context.writes = [wrong]
    with pytest.raises(WrongPortValue, match="port 'tension_n' takes a"):
        leaf(Measure, context).tick_once()
    assert "tension_n" not in context.board.ports


def test_a_value_of_another_type_is_refused_when_it_is_read(context):
    context.board.ports.write("wanted_n", "much")
    with pytest.raises(WrongPortValue, match="port 'wanted_n' takes a number, not 'much'"):
        leaf(Hold, context).tick_once()


def test_an_integer_is_a_number(context):
    context.writes = [1]
    node = leaf(Measure, context)
    node.tick_once()
    assert node.tension_n == 1.0


def test_a_leaf_that_succeeds_has_written_what_it_promised(context):
    with pytest.raises(PortUnset, match="'measure' succeeds without having written its port"):
        leaf(Measure, context).tick_once()


def test_two_executives_share_nothing():
    first, second = PortContext(), PortContext()
    leaf(Label, first).tick_once()
    assert "label" in first.board.ports
    assert "label" not in second.board.ports
    assert PortValues() is not PortValues()


def test_a_port_cannot_be_called_like_something_in_every_node():
    class Odd(Hold):
        """Has an odd port."""

        status = Reads(int, "Taken.")

    with pytest.raises(TypeError, match="has a port called 'status'"):
        Registry().register(Odd)
