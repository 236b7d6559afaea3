"""Look-up by name, proposals for misspelt names, nodes of other packages, unfit classes."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest
from pydantic import BaseModel

from defras_bt.executive import registry as registry_module
from defras_bt.executive.node import Node, NodeParameters
from defras_bt.executive.registry import (
    BUILTIN_NODE_MODULES,
    Registry,
    UnknownNode,
    builtin_nodes,
    did_you_mean,
    registered_nodes,
    snake_case,
)


def node_class(name="Nod", bases=(Node,), **body):
    usual = {
        "role": "task",
        "__doc__": "Nods.",
        "update": lambda self: self.succeed("nodded", "nodded"),
    }
    return type(Node)(name, bases, {**usual, **body})


def test_a_registered_class_is_found_by_its_name():
    registry = Registry()
    nod = registry.register(node_class())
    assert registry.look_up("Nod") is nod
    assert dict(registry.nodes()) == {"Nod": nod}


@pytest.mark.parametrize("misspelt", ["ForceAcepted", "forceaccepted", "ForcesAccepted"])
def test_a_misspelt_name_is_answered_by_the_similar_one(misspelt):
    registry = Registry()
    registry.register(node_class("ForceAccepted"))
    registry.register(node_class("Wait"))
    with pytest.raises(UnknownNode, match=r"did you mean ForceAccepted\?"):
        registry.look_up(misspelt)


def test_a_name_like_no_other_is_answered_by_all():
    registry = Registry()
    registry.register(node_class("Wait"))
    registry.register(node_class("Finish"))
    with pytest.raises(UnknownNode, match="there are: Finish, Wait"):
        registry.look_up("Zzz")
    assert did_you_mean("x", ()) == "; there are: none"


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ({"name": "lower_case"}, "CamelCase"),
        ({"role": "leaf"}, "role: one of guard, motion, recovery, task"),
        ({"__doc__": None}, "docstring"),
        ({"update": Node.update}, "update"),
        ({"Parameters": type("P", (BaseModel,), {})}, "extra='forbid'"),
        (
            {"Parameters": type("P", (NodeParameters,), {"__annotations__": {"name": str}})},
            "parameter 'name'",
        ),
    ],
)
def test_a_class_that_cannot_serve_is_refused(body, complaint):
    with pytest.raises(TypeError, match=complaint):
        Registry().register(node_class(**body))


def test_two_classes_of_one_name_are_refused():
    registry = Registry()
    registry.register(node_class(__module__="ours"))
    with pytest.raises(TypeError, match="defined in ours and in theirs; rename"):
        registry.register(node_class(__module__="theirs"))


def test_modules_and_entry_points_are_imported_on_the_first_look_up(tmp_path, monkeypatch):
    for name in ("lab_builtin_nodes", "lab_plugin_nodes"):
        (tmp_path / f"{name}.py").write_text("loaded = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    entry = EntryPoint("lab", "lab_plugin_nodes", "lab.nodes")
    monkeypatch.setattr(registry_module, "entry_points", lambda group: [entry] * (group == "lab"))
    registry = Registry(("lab_builtin_nodes",), "lab")
    assert not {"lab_builtin_nodes", "lab_plugin_nodes"} & set(sys.modules)
    registry.nodes()
    assert {"lab_builtin_nodes", "lab_plugin_nodes"} <= set(sys.modules)


def test_a_package_that_cannot_be_imported_is_not_passed_over(monkeypatch):
    entry = EntryPoint("lab", "lab_package_that_is_not_there", "lab.nodes")
    monkeypatch.setattr(registry_module, "entry_points", lambda group: [entry])
    with pytest.raises(ModuleNotFoundError, match="lab_package_that_is_not_there"):
        Registry((), "lab").nodes()


def test_every_built_in_module_brings_nodes():
    modules = {node.__module__ for node in builtin_nodes().values()}
    assert modules == set(BUILTIN_NODE_MODULES)
    assert set(builtin_nodes()) <= set(registered_nodes())


def test_looking_up_works_before_anything_else_is_imported():
    """No import cycle between the registry and the modules that it imports."""
    code = "from defras_bt.executive.registry import registered_nodes as r; assert r()"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("class_name", "expected"),
    [("Wait", "wait"), ("ForceAccepted", "force_accepted"), ("ROIVisible", "roi_visible")],
)
def test_snake_case(class_name, expected):
    assert snake_case(class_name) == expected
