"""What docs/testing.md shows is true."""

import re
from pathlib import Path

from defras_bt.executive.substitution import read_substitutes
from defras_bt.executive.tree_file import read_tree
from defras_bt.interop.groot_kinds import SAME
from defras_sim.resources import resource

TEXT = (Path(__file__).parents[2] / "docs" / "testing.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def test_the_test_passes():
    (code,) = blocks("python")
    names = {"__name__": "document"}
    exec(code, names)
    names["test_the_jaw_opens_but_never_drops_tissue"]()


def test_the_substitutes_suit_the_shipped_tree(tmp_path):
    (text,) = blocks("yaml")
    file = tmp_path / "mocks.yaml"
    file.write_text(text, encoding="utf-8")
    told = read_substitutes(file)
    assert told.paths(read_tree(resource("trees/defras.yaml"))) == (
        "**/act/*_grasp_*",
        "defras/operate/force_accepted",
    )


def test_the_kinds_that_mean_the_same_are_all_listed():
    assert dict(re.findall(r"^\| `(\w+)` \| `(\w+)` \|$", TEXT, re.MULTILINE)) == dict(SAME)
