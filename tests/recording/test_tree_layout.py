from __future__ import annotations

from defras_bt.recording.tree_layout import parent_of, tree_layout, tree_order
from tests.recording.synthetic_run import TREE

PATHS = [path for path, _ in TREE]


def test_children_stand_below_each_other_right_of_their_parent() -> None:
    places = tree_layout(PATHS)
    assert set(places) == set(PATHS)
    assert len(set(places.values())) == len(PATHS)
    for path, (x, _) in places.items():
        parent = parent_of(path)
        if parent is not None:
            assert places[parent][0] < x
    middle = [places[f"defras/operate/{name}"][1] for name in ("plan", "exposed")]
    assert places["defras/operate"][1] == sum(middle) / 2


def test_a_late_child_joins_its_siblings() -> None:
    late = "defras/guards/late"
    ordered = tree_order([*PATHS, late])
    assert ordered.index(late) == ordered.index("defras/operate") - 1
    assert tree_order(PATHS) == PATHS
