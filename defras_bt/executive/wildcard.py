"""Patterns of tree paths: ``defras/operate/*``, ``**/act/*_pull_*``."""

from __future__ import annotations

import re
from functools import lru_cache

ANY_LEVELS = "**"


def path_matches(pattern: str, path: str) -> bool:
    """Whether ``path`` is one that ``pattern`` speaks of.

    ``*`` stands for any part of one name, ``?`` for one character of it, and ``**`` in place of a
    name for any number of levels, none included.

    >>> path_matches("**/act/*_pull_*", "defras/operate/act/4_pull_psm1")
    True
    >>> path_matches("defras/*", "defras/operate/act")
    False
    """
    return _compiled(pattern).fullmatch(path + "/") is not None


@lru_cache(maxsize=256)
def _compiled(pattern: str) -> re.Pattern[str]:
    """A pattern of paths in which every name, the last one too, is followed by "/"."""
    names = (
        "(?:[^/]+/)*" if name == ANY_LEVELS else f"{_name_pattern(name)}/"
        for name in pattern.split("/")
    )
    return re.compile("".join(names))


def _name_pattern(name: str) -> str:
    wild = {"*": "[^/]*", "?": "[^/]"}
    return "".join(wild.get(character, re.escape(character)) for character in name)
