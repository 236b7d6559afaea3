"""Selection rule and force threshold."""

from __future__ import annotations

import pytest

from defras_bt.planning.choice import choose, median_force_n
from defras_bt.planning.execution import Execution


def execution(point, manoeuvres, visibility, force_max_n):
    return Execution(point, tuple(manoeuvres.split()), visibility, force_max_n, True)


SHORT = execution((1, 1), "pull", 0.9, 0.25)
GENTLE = execution((2, 1), "pull move fold", 1.0, 0.10)
MEDIUM = execution((3, 1), "pull fold", 0.8, 0.20)
FOURTH = execution((4, 1), "pull", 1.0, 0.26)
BLIND = execution((5, 1), "pull", 0.79, 0.01)
ROUGH = execution((1, 2), "pull", 1.0, 0.31)


@pytest.mark.parametrize(
    ("executions", "best"),
    [
        ([GENTLE, MEDIUM, SHORT, FOURTH, BLIND, ROUGH], SHORT),  # shortest of the three gentlest
        ([GENTLE, MEDIUM, FOURTH], FOURTH),
        ([GENTLE, MEDIUM, BLIND], MEDIUM),
        ([SHORT, FOURTH], SHORT),  # as short, gentler
        ([BLIND, ROUGH], None),
        ([], None),
    ],
)
def test_choice(executions, best):
    assert choose(executions, visibility=0.8, limit_n=0.3) == best
    assert choose(executions[::-1], visibility=0.8, limit_n=0.3) == best


def test_median_of_the_largest_forces():
    assert median_force_n([SHORT, GENTLE, ROUGH]) == 0.25
    with pytest.raises(ValueError, match="no retraction was rehearsed"):
        median_force_n([])
