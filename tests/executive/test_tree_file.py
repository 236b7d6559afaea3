"""Tree files: what they may say, and every fault with its place and what would be valid."""

import random

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from defras_bt.executive.loader import build_tree
from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_kinds import KINDS
from defras_sim.yaml_source import InvalidFile


@pytest.fixture
def faults_of(write_tree, toys):
    """``faults_of(text)`` reads a tree file: its faults as "line:column: message"."""

    def read(text, file="tree.yaml"):
        path = write_tree(text, file)
        try:
            read_tree(path, toys.registry)
        except InvalidFile as error:
            return [str(fault).removeprefix(f"{path.parent}/") for fault in error.faults]
        return []

    return read


def in_tree(*lines):
    return "\n".join(["name: toy", "tree:", "  sequence:", "    children:", *lines])


def test_a_node_is_its_kind_or_the_key_over_what_it_needs(write_tree, toys):
    text = """
name: toy
description: Shows every way to write a node.
tree:
  sequence:
    children:
      - Think
      - Limit: {name: force, limit_n: 0.3}
      - retry: {attempts: 2, child: Mend}
      - parallel: {name: both, succeed_when: all, children: [Think, {Mend: {}}]}
"""
    tree = read_tree(write_tree(text), toys.registry)
    assert (tree.name, tree.description) == ("toy", "Shows every way to write a node.")
    assert [(path, spec.kind) for path, spec in tree.root.walk()] == [
        ("toy", "sequence"),
        ("toy/think", "Think"),
        ("toy/force", "Limit"),
        ("toy/retry", "retry"),
        ("toy/retry/mend", "Mend"),
        ("toy/both", "parallel"),
        ("toy/both/think", "Think"),
        ("toy/both/mend", "Mend"),
    ]


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (["    - Thinc"], "5:7: there is no node 'Thinc'; did you mean Think?"),
        (["    - sequense: {}"], "5:7: there is no node 'sequense'; did you mean sequence?"),
        (["    - 7"], "5:7: a node is its kind"),
        (["    - Think:"], "5:7: nothing stands under Think: indent what belongs to it, or drop"),
        (["    - Think: 3"], "5:7: Think should be followed by keys and values, not 3"),
        (
            ["    - sequence:", "      name: x", "      children: [Think]"],
            "5:7: a node is its kind (`SomeNode`), or its kind as the one key over what it needs; "
            "here are 3 keys side by side (sequence, name, children): indent all but the kind",
        ),
        (
            ["    - Limit: {limit: 3, limit_n: 1}"],
            "5:15: Limit has no key 'limit'; did you mean limit_n?",
        ),
        (
            ["    - Limit: {limit_n: high}"],
            "5:15: Limit.limit_n: Input should be a valid number, unable to parse string as a "
            "number (got 'high')",
        ),
        (["    - Limit: {limit_n: -1}"], "5:15: Limit.limit_n: Input should be greater than 0"),
        (["    - Limit: {limit_n: .nan}"], "5:15: Limit.limit_n: Input should be"),
        (["    - Limit"], "5:7: Limit.limit_n: Field required"),
        (["    - Think: {name: To/do}"], "5:15: Think.name: a name has small letters, digits"),
        (["    - Think: {name: 3}"], "5:15: Think.name: a name has small letters, digits and _"),
        (["    - retry: {child: Think}"], "5:7: retry.attempts: Field required"),
        (["    - retry: {attempts: 0, child: Think}"], "5:15: retry.attempts: Input should be gr"),
        (["    - invert"], "5:7: invert has no child: give it one node, as in `child: SomeNode`"),
        (["    - invert: {child: [Think]}"], "5:16: invert has one child, not a list"),
        (["    - invert: {children: [Think]}"], "5:16: invert has no key 'children'; did you mean"),
        (["    - selector: {}"], "5:7: selector has no children: give it a list of at least one"),
        (["    - selector: {children: []}"], "5:18: selector.children is empty or no list"),
        (["    - selector: {children: Think}"], "5:18: selector.children is empty or no list"),
        (["    - parallel: {children: [Think]}"], "5:7: parallel.succeed_when: Field required"),
        (
            ["    - parallel: {succeed_when: [thing], children: [Think]}"],
            "5:7: parallel.succeed_when: no child is called 'thing'; did you mean think?",
        ),
        (
            ["    - parallel: {succeed_when: one, synchronise: true, children: [Think]}"],
            "5:7: parallel.synchronise has no meaning with succeed_when: one",
        ),
        (["    - time_out: {ticks: 0.5, child: Think}"], "5:18: time_out.ticks: Input should be"),
        (
            ["    - Think", "    - Mend", "    - Think"],
            "7:7: a second child called 'think' (see line 5); give one of them another name",
        ),
        (
            ["    - subtree: {file: zzz.yaml}"],
            "5:17: there is no file 'zzz.yaml'; there are: tree.yaml",
        ),
        (["    - subtree: {file: tre.yaml}"], "5:17: there is no file 'tre.yaml'; did you mean "),
        (["    - subtree: {file: notes.txt}"], "5:17: subtree.file: String should match pattern"),
        (
            ["    - subtree: {file: tree.yaml}"],
            "5:17: the file includes itself: tree.yaml -> tree.yaml",
        ),
    ],
)
def test_each_fault_has_its_place_and_what_would_be_valid(faults_of, lines, expected):
    faults = [fault.removeprefix("tree.yaml:") for fault in faults_of(in_tree(*lines))]
    assert any(fault.startswith(expected) for fault in faults), faults


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("tree: Think", "1:1: a tree file.name: Field required"),
        ("name: toy", "1:1: a tree file.tree: Field required"),
        ("name: toy\ntree: Think\nauthor: me", "3:1: a tree file has no key 'author'"),
        ("name: My tree\ntree: Think", "1:1: a tree file.name: String should match pattern"),
        ("name: toy\ntree: [Think]", "2:1: a node is its kind"),
        ("name: toy\ntree: {}", "2:1: a node is its kind"),
        (
            "name: toy\ntree: {Think: {name: x}}",
            "2:16: the topmost node is called by the file's name (toy); remove this one",
        ),
        ("[Think]", "1:1: should hold a mapping"),
        ("name: toy\ntree: [", "3:1: not valid YAML"),
        ("name: toy\nname: toy\ntree: Think", "2:1: not valid YAML: found duplicate key"),
    ],
)
def test_faults_of_the_file_itself(faults_of, text, expected):
    faults = [fault.removeprefix("tree.yaml:") for fault in faults_of(text + "\n")]
    assert any(fault.startswith(expected) for fault in faults), faults


def test_all_faults_are_said_at_once_in_the_order_of_the_file(faults_of, write_tree):
    write_tree("name: other\ntree: {sequence: {children: [Mendd, Think, Think]}}", "other.yaml")
    text = in_tree(
        "    - Thinc",
        "    - subtree: {file: other.yaml}",
        "    - Limit: {limit_n: -1, patience: 2}",
        "    - subtree: {name: again, file: other.yaml}",
        "    - selector: {children: []}",
    )
    places = [fault.split(": ")[0] for fault in faults_of(text)]
    assert places == [
        "tree.yaml:5:7",
        "tree.yaml:7:15",
        "tree.yaml:7:28",
        "tree.yaml:9:18",
        "other.yaml:2:30",  # once, though the file is included twice
        "other.yaml:2:44",
    ]


def test_an_included_tree_is_called_by_its_file_or_by_who_includes_it(write_tree, toys):
    write_tree("name: other\ntree: {selector: {children: [Mend]}}", "other.yaml")
    text = in_tree(
        "    - subtree: {file: other.yaml}", "    - subtree: {file: other.yaml, name: again}"
    )
    tree = read_tree(write_tree(text), toys.registry)
    paths = [path for path, _ in tree.root.walk()]
    assert paths == ["toy", "toy/other", "toy/other/mend", "toy/again", "toy/again/mend"]
    assert tree.root.children[0].place[0].name == "other.yaml"


def test_a_loop_of_includes_is_shown(faults_of, write_tree):
    write_tree("name: a\ntree: {subtree: {file: b.yaml}}", "a.yaml")
    write_tree("name: b\ntree: {invert: {child: {subtree: {file: tree.yaml}}}}", "b.yaml")
    (fault,) = faults_of(in_tree("    - subtree: {file: a.yaml}"))
    assert fault.endswith("the file includes itself: tree.yaml -> a.yaml -> b.yaml -> tree.yaml")


def test_what_stands_below_an_unknown_node_is_looked_at_too(faults_of):
    said = faults_of(
        """\
name: t
tree:
  reactve:
    children:
      - Wach
      - retri: {attempts: 1, child: {Limit: {limitt: 3}}}
"""
    )
    assert [fault.split(":")[1] for fault in said] == ["3", "5", "6", "6", "6"]
    assert "'Wach', did you mean" in said[1].replace("; ", ", ")
    assert any("limitt" in fault for fault in said)


def test_files_that_include_each_other_twice_each_are_refused(write_tree, toys, monkeypatch):
    monkeypatch.setattr("defras_bt.executive.tree_includes.MOST_NODES", 150)
    levels = 40
    for level in range(levels):
        below = f"{{subtree: {{file: f{level + 1}.yaml, name: NAME}}}}"
        twice = ", ".join(below.replace("NAME", name) for name in ("a", "b"))
        write_tree(
            f"name: f{level}\ntree: {{sequence: {{children: [{twice}]}}}}\n", f"f{level}.yaml"
        )
    write_tree("name: end\ntree: Think\n", f"f{levels}.yaml")
    with pytest.raises(InvalidFile) as caught:
        read_tree(write_tree("name: t\ntree: {subtree: {file: f0.yaml}}\n"), toys.registry)
    (fault,) = caught.value.faults
    assert "at most 150 are valid" in fault.message


def test_a_file_that_is_not_there(tmp_path, toys):
    with pytest.raises(InvalidFile, match=r"gone\.yaml:1:1: cannot be read"):
        read_tree(tmp_path / "gone.yaml", toys.registry)


def test_a_tree_deeper_than_python_could_tick_is_refused(faults_of):
    node = "Think"
    for _ in range(70):
        node = f"{{invert: {{child: {node}}}}}"
    (fault,) = faults_of(f"name: toy\ntree: {node}\n")
    assert "nested deeper than 64 levels" in fault or "recursion" in fault


# Random valid trees, each as the data that would stand in a file.

names = st.from_regex(r"[a-z0-9][a-z0-9_]{0,8}", fullmatch=True)
limits = st.floats(0.001, 1e6)
options = {
    "parallel": st.fixed_dictionaries({"succeed_when": st.sampled_from(["all", "one"])}),
    "retry": st.fixed_dictionaries({"attempts": st.integers(1, 9)}),
    "repeat": st.fixed_dictionaries({"times": st.integers(1, 9)}),
    "time_out": st.fixed_dictionaries({"ticks": st.integers(1, 9)}),
    "once": st.fixed_dictionaries({}, optional={"until": st.just("completion")}),
    "wait_for": st.fixed_dictionaries({"status": st.sampled_from(["success", "failure"])}),
}
leaf_data = st.one_of(
    st.sampled_from(["Think", "Watch", "Mend"]).map(lambda leaf: {leaf: {}}),
    st.builds(lambda limit: {"Limit": {"limit_n": limit}}, limits),
)


def inner_data(nodes):
    def named(body, held):
        (kind, inside), names_of_children = body, sorted(set(held[1]))
        children = [
            {key: {**value, "name": name}}
            for item, name in zip(held[0], names_of_children, strict=False)
            for key, value in item.items()
        ]
        holds = KINDS[kind].holds
        return {kind: {**inside, holds: children if holds == "children" else children[0]}}

    kinds = st.sampled_from([kind.name for kind in KINDS.values() if kind.holds])
    body = kinds.flatmap(lambda kind: st.tuples(st.just(kind), options.get(kind, st.just({}))))
    held = st.tuples(
        st.lists(nodes, min_size=1, max_size=4), st.lists(names, min_size=1, max_size=4)
    )
    return st.builds(named, body, held)


tree_data = st.recursive(leaf_data, inner_data, max_leaves=12)


def flat(data, path):
    """(path, kind, options) of every node, straight from the data."""
    ((kind, body),) = data.items()
    children = body.get("children", [body["child"]] if "child" in body else [])
    own = {key: v for key, v in body.items() if key not in ("name", "child", "children")}
    yield path, kind, own
    for child in children:
        ((_, inside),) = child.items()
        yield from flat(child, f"{path}/{inside['name']}")


@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=tree_data)
def test_every_valid_tree_is_read_as_it_was_written(data, tmp_path, toys, toy_context):
    file = tmp_path / "random.yaml"
    with file.open("w") as stream:
        YAML().dump({"name": "random", "tree": data}, stream)
    tree = read_tree(file, toys.registry)
    read = [
        (path, spec.kind, spec.options.model_dump(exclude_defaults=True))
        for path, spec in tree.root.walk()
    ]
    assert read == list(flat(data, "random"))
    loaded = build_tree(tree, toy_context)
    assert list(loaded.kinds()) == [(path, kind) for path, kind, _ in read]
    loaded.root.tick_once()


# Whatever stands in a file, reading it gives a tree or faults that lie inside the file.

WORDS = [
    *["name: toy", "tree:", "children:", "child:", "file:", "limit_n:", "name:", "- ", "\n"],
    *["\n  ", "\n    ", "\n      ", "reactive:", "sequence:", "invert:", "retry:", "attempts:"],
    *["subtree:", "plan_slot", "Think", "Watch", "Push", "Limit:", "tree.yaml", "{", "}", "[", "]"],
    *[",", ":", "1", ".nan", "null", "''", "&a ", "*a", "<<: ", "!!set ", "!!int ", "? ", "|", "é"],
]


def assert_read_or_refused(text, file, toys):
    file.write_text(text, encoding="utf-8")
    try:
        read_tree(file, toys.registry)
    except InvalidFile as error:
        faults = error.faults
    else:
        return
    lines = len(text.splitlines()) + 1
    assert faults
    assert all(1 <= fault.line <= lines and fault.column >= 1 for fault in faults)


@settings(
    max_examples=200, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
@given(text=st.one_of(st.lists(st.sampled_from(WORDS), max_size=30).map("".join), st.text()))
@example(text="name: toy\ntree: &a {invert: {child: *a}}")
@example(text="name: toy\ntree: {? [Think] : {}}")
@example(text="name: toy\ntree: {null: {}}")
@example(text="name: toy\ntree: {sequence: {children: [Think], 3: 4, ~: 5}}")
@example(text="name: toy\ntree: {sequence: {<<: {children: [Think]}}}")
@example(text="name: toy\ntree: {subtree: {file: 'a\\0.yaml'}}")
@example(text="name: toy\ntree: {subtree: {file: " + "a" * 5000 + ".yaml}}")
@example(text="name: toy\ntree: " + "[" * 400)
@example(text="name: 2001-01-01\ntree: 2001-01-01")
@pytest.mark.filterwarnings("ignore::ruamel.yaml.error.YAMLWarning")
def test_no_text_gives_anything_but_a_tree_or_faults(text, tmp_path, toys):
    if "\ud800" <= max(text, default="") <= "\udfff":
        text = "surrogates cannot be written"
    assert_read_or_refused(text, tmp_path / "tree.yaml", toys)


@settings(max_examples=80, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=tree_data, seed=st.integers(0, 2**32 - 1))
def test_no_damage_to_a_valid_file_gives_anything_but_a_tree_or_faults(data, seed, tmp_path, toys):
    file = tmp_path / "tree.yaml"
    with file.open("w") as stream:
        YAML().dump({"name": "toy", "tree": data}, stream)
    text, chance = list(file.read_text()), random.Random(seed)
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(text))
        text[place : place + chance.randint(0, 3)] = chance.choice(WORDS)
    assert_read_or_refused("".join(text), file, toys)
