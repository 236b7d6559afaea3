"""What the library of effects asks of those that packages add."""

from __future__ import annotations

from typing import Any

import pytest

from defras_sim.effects import library
from defras_sim.effects.attachment_tear import AttachmentTear


@pytest.mark.parametrize(
    ("names", "error", "says"),
    [
        ("missing_attachment", TypeError, "should be a tuple of names"),
        (("missing_atachment",), ValueError, "special case 'missing_atachment' should be another"),
        (("attachment_tear",), ValueError, "there are anisotropy, .*missing_attachment"),
    ],
)
def test_special_cases_are_other_effects(names: Any, error: type[Exception], says: str) -> None:
    class Tear(AttachmentTear):
        special_cases = names

    known = {effect.name: effect for effect in library.effects()}
    with pytest.raises(error, match=says):
        library.check_special_cases(Tear(), known)


def test_all_that_is_shipped_is_as_asked() -> None:
    known = {effect.name: effect for effect in library.effects()}
    for effect in known.values():
        library.check_special_cases(effect, known)
    assert known["attachment_tear"].special_cases == ("missing_attachment",)
