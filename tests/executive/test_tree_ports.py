"""Ports in tree files: keys are private to a file, remapped where it is included, and typed."""

import pytest

from defras_bt.executive.loader import load_tree
from defras_bt.executive.tree_file import read_tree
from defras_sim.yaml_source import InvalidFile
from tests.executive.port_toys import PortContext, port_registry

REGISTRY = port_registry()

HOLD = """
name: hold
ports:
  wanted_n: {type: number, direction: in, description: Force to hold in N.}
tree: {reactive: {children: [Hold]}}
"""
MEASURE = """
name: measure
ports:
  tension_n: {type: number, direction: out}
tree: Measure
"""


@pytest.fixture
def faults_of(write_tree):
    """``faults_of(*children)``: faults of a sequence of these nodes, beside hold and measure."""
    write_tree(HOLD, "hold.yaml")
    write_tree(MEASURE, "measure.yaml")

    def read(*children, kind="sequence", ports=""):
        nodes = "".join(f"      - {child}\n" for child in children)
        path = write_tree(f"name: toy\n{ports}tree:\n  {kind}:\n    children:\n{nodes}")
        try:
            read_tree(path, REGISTRY)
        except InvalidFile as error:
            return [str(fault).removeprefix(f"{path.parent}/") for fault in error.faults]
        return []

    return read


def keys(tree):
    return {path: dict(spec.keys) for path, spec in tree.root.walk() if spec.keys}


def test_keys_are_private_to_a_file_unless_they_are_its_ports(write_tree):
    write_tree(HOLD, "hold.yaml")
    write_tree(MEASURE, "measure.yaml")
    write_tree(
        "name: both\ntree: {sequence: {children: [Measure, {Hold: {ports: {wanted_n: "
        "tension_n}}}]}}",
        "both.yaml",
    )
    tree = read_tree(
        write_tree("""
name: toy
tree:
  sequence:
    children:
      - subtree: {file: measure.yaml, ports: {tension_n: left}}
      - subtree: {file: measure.yaml, name: again}
      - subtree: {file: hold.yaml, ports: {wanted_n: left}}
      - subtree: {file: both.yaml}
      - subtree: {file: both.yaml, name: once_more}
"""),
        REGISTRY,
    )
    assert keys(tree) == {
        "toy/measure": {"tension_n": "left"},
        "toy/again": {"tension_n": "toy/again/tension_n"},
        "toy/hold/hold": {"wanted_n": "left"},
        "toy/both/measure": {"tension_n": "toy/both/tension_n"},
        "toy/both/hold": {"wanted_n": "toy/both/tension_n"},
        "toy/once_more/measure": {"tension_n": "toy/once_more/tension_n"},
        "toy/once_more/hold": {"wanted_n": "toy/once_more/tension_n"},
    }


def test_a_port_is_led_through_several_files(write_tree):
    write_tree(HOLD, "hold.yaml")
    write_tree(
        """
name: outer
ports: {force_n: {type: number, direction: in, default: 0.5}}
tree: {subtree: {file: hold.yaml, ports: {wanted_n: force_n}}}
""",
        "outer.yaml",
    )
    file = write_tree("""
name: toy
tree:
  sequence:
    children:
      - subtree: {file: outer.yaml}
      - subtree: {name: strong, file: outer.yaml, ports: {force_n: 2}}
      - Measure: {ports: {tension_n: measured}}
      - subtree: {name: measured, file: outer.yaml, ports: {force_n: measured}}
""")
    tree = read_tree(file, REGISTRY)
    assert tree.values == {"toy/outer/force_n": 0.5, "toy/strong/force_n": 2.0}
    context = PortContext(writes=[1.25])
    load_tree(file, context, REGISTRY).root.tick_once()
    assert context.read == [0.5, 2.0, 1.25]


def test_two_trees_of_one_file_share_nothing(write_tree):
    file = write_tree("""
name: toy
tree: {sequence: {children: [Measure, {Hold: {ports: {wanted_n: tension_n}}}]}}
""")
    contexts = [PortContext(writes=[1.0]), PortContext(writes=[2.0])]
    trees = [load_tree(file, context, REGISTRY) for context in contexts]
    for tree in trees:
        tree.root.tick_once()
    trees[0].root.tick_once()
    assert [context.read for context in contexts] == [[1.0, 1.0], [2.0]]


@pytest.mark.parametrize(
    ("children", "expected"),
    [
        (
            ["Hold: {ports: {wanted: left}}", "Measure: {ports: {tension_n: wanted_n}}"],
            "tree.yaml:5:24: Hold has no port 'wanted'; did you mean wanted_n?",
        ),
        (
            ["Measure: {ports: {tension_n: Left!}}"],
            "tree.yaml:5:27: Measure.ports.tension_n: give a key (small letters, digits and _), "
            "a number, or {value: ...}, not 'Left!'",
        ),
        (["Measure: {ports: left}"], "tree.yaml:5:19: Measure.ports: should be keys and values"),
        (["HasValue: {ports: {port: 3}}"], "HasValue toy/has_value does not read port 'port': giv"),
        (["Measure: {ports: {tension_n: 3}}"], "Measure toy/measure does not read port 'tension_n"),
        (
            ["Hold: {ports: {wanted_n: {value: much}}}"],
            "tree.yaml:5:24: port 'wanted_n' takes a number, not 'much'",
        ),
        (
            ["Label: {ports: {label: tension_n}}", "Measure"],
            "tree.yaml:6:9: Measure toy/measure takes a number under the key 'tension_n', where "
            "Label toy/label has a text (line 5)",
        ),
        (
            ["subtree: {file: hold.yaml}"],
            "tree.yaml:5:9: hold.yaml needs its port 'wanted_n' (number): give it a key or a "
            "value, as in `ports: {wanted_n: some_key}`",
        ),
        (
            ["subtree: {file: hold.yaml, ports: {wanted: 3, wanted_n: 3}}"],
            "tree.yaml:5:44: hold.yaml has no port 'wanted'; did you mean wanted_n?",
        ),
        (
            ["subtree: {file: hold.yaml, ports: {wanted_n: {value: x}}}"],
            "tree.yaml:5:44: port 'wanted_n' takes a number, not 'x'",
        ),
        (
            ["subtree: {file: measure.yaml, ports: {tension_n: 3}}"],
            "tree.yaml:5:47: port 'tension_n' (out, number) takes a key, not a value",
        ),
        (
            [
                "Label: {ports: {label: left}}",
                "subtree: {file: hold.yaml, ports: {wanted_n: left}}",
            ],
            "tree.yaml:6:44: hold.yaml, port 'wanted_n', takes a number under the key 'left', wh",
        ),
    ],
)
def test_each_fault_has_its_place_and_what_would_be_valid(faults_of, children, expected):
    faults = faults_of(*children)
    assert any(expected in fault for fault in faults), faults


def test_a_file_that_only_includes_another_has_keys_of_its_own(write_tree):
    write_tree(
        "name: inner\nports: {out_n: {type: number, direction: out}}\ntree: {sequence: {children: "
        "[{Measure: {ports: {tension_n: out_n}}}, {Label: {ports: {label: k}}}]}}",
        "inner.yaml",
    )
    write_tree("name: outer\ntree: {subtree: {file: inner.yaml, ports: {out_n: k}}}", "outer.yaml")
    tree = read_tree(write_tree("name: toy\ntree: {subtree: {file: outer.yaml}}"), REGISTRY)
    (measured,), (label,) = (spec.keys.values() for _, spec in tree.root.walk() if spec.keys)
    assert measured != label


def test_a_type_that_is_not_there(faults_of):
    (fault,) = faults_of("Patient", ports="ports: {a: {type: numbr, direction: in}}\n")
    assert fault == "tree.yaml:2:9: there is no type 'numbr'; did you mean number?"


def test_a_port_that_is_given_is_not_written(faults_of):
    ports = "ports: {tension_n: {type: number, direction: in}}\n"
    (fault,) = faults_of("Measure", ports=ports)
    assert "writes 'tension_n', a port of this file that is declared `in`" in fault


READ_LEFT = "Hold: {ports: {wanted_n: left}}"
WRITE_LEFT = "Measure: {ports: {tension_n: left}}"
ASK_LEFT = "HasValue: {ports: {port: left}}"


@pytest.mark.parametrize(
    ("kind", "children"),
    [
        ("sequence", [WRITE_LEFT, READ_LEFT]),
        ("reactive", [WRITE_LEFT, "Label", READ_LEFT]),
        ("reactive", [ASK_LEFT, READ_LEFT]),
        ("sequence", [f"retry: {{attempts: 2, child: {{{WRITE_LEFT}}}}}", READ_LEFT]),
        (
            "sequence",
            [f"reactive_selector: {{children: [{{{ASK_LEFT}}}, {{{WRITE_LEFT}}}]}}", READ_LEFT],
        ),
        (
            "sequence",
            [f"parallel: {{succeed_when: all, children: [Label, {{{WRITE_LEFT}}}]}}", READ_LEFT],
        ),
        ("sequence", ["Hold: {ports: {wanted_n: 0.3}}"]),
        ("sequence", ["Patient"]),
    ],
)
def test_a_port_that_is_surely_written_may_be_read(faults_of, kind, children):
    assert faults_of(*children, kind=kind) == []


@pytest.mark.parametrize(
    ("kind", "children"),
    [
        ("sequence", [READ_LEFT]),
        ("sequence", [READ_LEFT, WRITE_LEFT]),
        ("selector", [WRITE_LEFT, READ_LEFT]),
        ("sequence", [f"ignore_failure: {{child: {{{WRITE_LEFT}}}}}", READ_LEFT]),
        ("sequence", [f"invert: {{child: {{{ASK_LEFT}}}}}", READ_LEFT]),
        ("sequence", [f"reactive_selector: {{children: [Label, {{{WRITE_LEFT}}}]}}", READ_LEFT]),
        (
            "sequence",
            [f"parallel: {{succeed_when: one, children: [Label, {{{WRITE_LEFT}}}]}}", READ_LEFT],
        ),
        (
            "sequence",
            [
                f"parallel: {{succeed_when: [label], children: [Label, {{{WRITE_LEFT}}}]}}",
                READ_LEFT,
            ],
        ),
    ],
)
def test_a_port_that_may_be_read_before_it_is_written_is_a_fault(faults_of, kind, children):
    (fault,) = faults_of(*children, kind=kind)
    assert "reads port 'wanted_n' before 'left' is surely written" in fault
    if any(WRITE_LEFT in child for child in children):
        assert "put that before it under the same `reactive` or `sequence`" in fault
    else:
        assert "nothing in the tree writes it; written are no keys at all" in fault


def test_a_tree_that_needs_a_value_can_be_checked_but_not_run(write_tree):
    file = write_tree(HOLD, "hold.yaml")
    assert list(read_tree(file, REGISTRY).needs) == ["wanted_n"]
    with pytest.raises(InvalidFile, match=r"hold\.yaml:4:3: port 'wanted_n' has no value"):
        load_tree(file, PortContext(), REGISTRY)
