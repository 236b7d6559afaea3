"""The drawing of a tree: every node once, none over another."""

import random
import xml.etree.ElementTree as ElementTree
from itertools import combinations

import pytest

from defras_bt.executive.tree_file import read_tree
from defras_bt.executive.tree_picture import show_svg
from defras_bt.executive.tree_show import Outline, outline_of_spec
from defras_sim.resources import resource
from tests.executive.random_trees import random_spec

SVG = "{http://www.w3.org/2000/svg}"


def drawn(svg):
    """Boxes as (left, top, right, bottom), the texts in them, and the size of the picture."""
    root = ElementTree.fromstring(svg)
    size = float(root.attrib["width"]), float(root.attrib["height"])
    boxes = [
        tuple(float(rect.attrib[name]) for name in ("x", "y", "width", "height"))
        for rect in root.iter(f"{SVG}rect")
        if rect.attrib.get("height") == "26.0"
    ]
    texts = ["".join(text.itertext()) for text in root.iter(f"{SVG}text")]
    return [(x, y, x + w, y + h) for x, y, w, h in boxes], texts, size


def assert_readable(spec):
    boxes, texts, (width, height) = drawn(show_svg(outline_of_spec(spec)))
    assert len(boxes) == sum(1 for _ in spec.walk())
    for left, top, right, bottom in boxes:
        assert 0 < left < right < width
        assert 0 < top < bottom < height
    for one, other in combinations(boxes, 2):
        apart = one[2] < other[0] or other[2] < one[0] or one[3] < other[1] or other[3] < one[1]
        assert apart, (one, other)
    return texts


@pytest.mark.parametrize("name", ["defras", "fras"])
def test_shipped_trees_are_drawn(name):
    spec = read_tree(resource("trees") / f"{name}.yaml").root
    texts = assert_readable(spec)
    assert "act" in {text.removesuffix("plan_slot") for text in texts}
    assert texts[-4:] == ["guard", "motion", "recovery", "task"]


def test_random_trees_are_drawn(toys):
    chance = random.Random(2)
    for _ in range(20):
        assert_readable(random_spec(toys.registry, chance))


def test_details_that_look_like_markup_are_text():
    outline = Outline("n", "n", "Kind", "task", " text='<b> & </b>'", ())
    _, texts, _ = drawn(show_svg(outline))
    assert texts[0] == "nKind text='<b> & </b>'"
