"""What is written can be read back, by programs that know only the schema."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from defras_bt.diagnosis.verdict import Cause, Estimate, Excluded, Gain, Verdict
from defras_bt.diagnosis.verdict_file import (
    SCHEMA_FILE,
    Origin,
    plain,
    read_verdict,
    schema_text,
    verdict_file,
    write_verdict,
)

ORIGIN = Origin(twin="tissue", data=["a.mcap"], scene="demo.yaml")
NAMED = Verdict(
    verdict="named",
    causes=(
        Cause(
            effect="depth_bias",
            site="",
            parameters={"offset_m": Estimate(0.002, "m", (0.0018, math.inf))},
            gain=0.8,
        ),
    ),
    ambiguous=(),
    excluded={
        "joint_play@q5": Excluded(0.01, "rad", "width_rad"),
        "stiffness": Excluded(math.inf, "", "scale"),
    },
    gain=Gain(in_range=0.8),
    unexplained_share=0.2,
    data_quality={"rows": np.int64(3), "times_s": np.array([1.0, math.nan])},
)


def test_the_shipped_schema_is_that_of_the_code() -> None:
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(), "print it anew: schema_text()"


def test_a_verdict_survives_writing_and_reading(tmp_path: Path) -> None:
    file = verdict_file(NAMED, "It is the camera.", ORIGIN)
    write_verdict(file, tmp_path / "verdict.json")
    assert read_verdict(tmp_path / "verdict.json") == file


def test_the_keys_are_those_that_were_promised(tmp_path: Path) -> None:
    write_verdict(verdict_file(NAMED, "It is the camera.", ORIGIN), tmp_path / "verdict.json")
    # No constant that is not JSON, as Infinity is: other languages refuse it.
    values = json.loads((tmp_path / "verdict.json").read_text(), parse_constant=pytest.fail)
    promised = {"verdict", "causes", "set", "excluded", "gain", "unexplained_share"}
    assert promised | {"proposed_motion", "data_quality"} <= set(values)
    assert values["causes"][0]["parameters"]["offset_m"] == {
        "value": 0.002,
        "unit": "m",
        "interval90": [0.0018, None],
    }
    assert values["gain"] == {"in_range": 0.8, "beyond_range": None, "new_grasp": None}
    assert values["data_quality"] == {"rows": 3, "times_s": [1.0, None]}
    assert set(values) == set(json.loads(schema_text())["required"])


def test_what_no_data_could_show_is_not_called_excluded() -> None:
    assert set(verdict_file(NAMED, "", ORIGIN).excluded) == {"joint_play@q5"}


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "verdict.json").write_text('{"verdict": "maybe"}')
    with pytest.raises(ValidationError, match="named"):
        read_verdict(tmp_path / "verdict.json")


def test_quality_that_json_cannot_hold_is_an_error() -> None:
    with pytest.raises(TypeError, match="a set"):
        verdict_file(replace(NAMED, data_quality={"rows": {1}}), "", ORIGIN)
    assert plain((1, math.inf, Path("a"))) == [1, None, "a"]
