"""Patterns of paths, against a matcher that walks both lists of names."""

from fnmatch import fnmatchcase

import hypothesis.strategies as st
import pytest
from hypothesis import given

from defras_bt.executive.wildcard import path_matches


def matches_name_by_name(pattern: list[str], path: list[str]) -> bool:
    if not pattern:
        return not path
    if pattern[0] == "**":
        return any(matches_name_by_name(pattern[1:], path[i:]) for i in range(len(path) + 1))
    return bool(
        path and fnmatchcase(path[0], pattern[0]) and matches_name_by_name(pattern[1:], path[1:])
    )


names = st.text("ab_1", min_size=1, max_size=3)
wild_names = st.one_of(st.just("**"), st.text("ab*?_", min_size=1, max_size=3))


@given(st.lists(wild_names, min_size=1, max_size=4), st.lists(names, min_size=1, max_size=4))
def test_it_agrees_with_walking_the_names(pattern, path):
    expected = matches_name_by_name(pattern, path)
    assert path_matches("/".join(pattern), "/".join(path)) == expected


@pytest.mark.parametrize("pattern", ["a.b", "a[bc]", "a+", "(a", "$a"])
def test_no_other_character_is_wild(pattern):
    assert path_matches(f"x/{pattern}", f"x/{pattern}")
    assert not path_matches(pattern, "ab")
