"""MismatchIs says who was found to blame, and fails where nobody looked."""

from __future__ import annotations

import pytest
from py_trees.common import Status
from pydantic import ValidationError

from defras_bt.diagnosis.mismatch.finding import CAUSES, MismatchFinding
from defras_bt.diagnosis.mismatch.nodes import MismatchIs


@pytest.mark.parametrize("asked", CAUSES)
@pytest.mark.parametrize("found", CAUSES)
def test_it_knows_whom_it_is_asked_about(bench, asked, found):
    bench.board.mismatch = MismatchFinding(found, f"the {found} did it")
    node = bench.node(MismatchIs, cause=asked)
    assert bench.tick(node) == (Status.SUCCESS if asked == found else Status.FAILURE)
    assert node.code == ("blamed" if asked == found else "not_blamed")
    assert found in node.feedback_message


def test_without_a_diagnosis_nobody_is_to_blame(bench):
    node = bench.node(MismatchIs, cause="camera")
    assert bench.tick(node) == Status.FAILURE
    assert "nobody has looked" in node.feedback_message


def test_a_cause_that_is_none_is_refused(bench):
    with pytest.raises(ValidationError, match="attachments"):
        bench.node(MismatchIs, cause="weather")
