"""Which candidates have to stand against each other."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from defras_bt.diagnosis.diagnosis import Ranked
from defras_bt.diagnosis.search import Search
from defras_bt.diagnosis.short_list import with_best_fitting


def row(key: str, gain: float) -> Ranked:
    return Ranked(key, gain, 0.0, True, {})


def search(*nuisances: str) -> Search:
    """Knows which candidates are nuisances, and nothing else."""
    sketch = SimpleNamespace(candidate=lambda key: SimpleNamespace(nuisance=key in nuisances))
    return cast(Search, SimpleNamespace(sketch=sketch))


ROWS = (row("camera", 0.5), row("slip", 0.3), row("play", 0.1))


def test_what_fits_best_stands_against_the_first() -> None:
    groups = [("play", "lag"), ("gravity",)]
    found = with_best_fitting(search("camera"), groups, ROWS, 0.05)
    assert found == [("play", "lag", "slip"), ("gravity",)]
    assert with_best_fitting(search(), groups, ROWS, 0.05)[0] == ("play", "lag", "camera")


def test_where_nothing_else_is_promising_it_is_tried_alone() -> None:
    assert with_best_fitting(search("camera"), [], ROWS, 0.05) == [("slip",)]


def test_nobody_is_added_twice_nor_below_what_chance_reaches() -> None:
    groups = [("play",), ("slip",)]
    assert with_best_fitting(search("camera"), groups, ROWS, 0.05) == groups
    assert with_best_fitting(search("camera"), [("play",)], ROWS, 0.4) == [("play",)]
    assert with_best_fitting(search(), [], (), 0.4) == []
