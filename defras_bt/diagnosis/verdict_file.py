"""The schema of ``verdict.json``. ``verdict.schema.json`` beside this file is printed from it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from defras_bt.diagnosis.verdict import Cause, Estimate, Verdict, VerdictName
from defras_bt.recording.whole_file import write_whole

SCHEMA_FILE = Path(__file__).with_name("verdict.schema.json")

Number = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(le=1, allow_inf_nan=False)]


class FilePart(BaseModel):
    """Base of all parts: unknown keys, infinities and NaN are faults."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class ParameterPart(FilePart):
    """A number of a cause."""

    value: Number
    unit: str
    interval90: tuple[Number | None, Number | None] = Field(
        description="90 % interval; null where the data set no limit"
    )


class CausePart(FilePart):
    """A named effect."""

    effect: str = Field(description="name of the effect in the library")
    site: str = Field(description="joint, direction or place, where an effect has several; else ''")
    parameters: dict[str, ParameterPart]
    gain: Share | None = Field(
        description="share of the excess error that this cause alone removes, held out"
    )
    alternatives: list[str] = Field(description="causes that explain the same as well")


class ExcludedPart(FilePart):
    """An effect of more than ``strength`` would have shown, with 95 % confidence."""

    strength: Number
    unit: str
    parameter: str


class GainPart(FilePart):
    """Share of the excess error, above the noise of the sensors, that was removed.

    Negative: the extended model is worse. Null: the data cannot say.
    """

    in_range: Share | None = Field(description="held-out parts of the motions that were fitted")
    beyond_range: Share | None = Field(description="motions that go further")
    new_grasp: Share | None = Field(description="motions of another grasp point")


class Origin(FilePart):
    """What was diagnosed, and with what."""

    twin: str = Field(description="tissue, arm or coupon")
    data: list[str] = Field(description="measured data, as given")
    scene: str | None = Field(description="scene file that was believed; null without one")
    versions: dict[str, str] = Field(default_factory=dict)


class VerdictFile(FilePart):
    """What a diagnosis says."""

    model_config = ConfigDict(title="verdict.json")
    verdict: VerdictName = Field(
        description="named; set (some causes cannot be told apart); outside (no known cause "
        "explains what is there); nothing (the model agrees as well as the sensors can tell)"
    )
    sentence: str = Field(description="the verdict for a person")
    causes: list[CausePart]
    ambiguous: list[str] = Field(alias="set", description="effects that cannot be told apart")
    excluded: dict[str, ExcludedPart] = Field(
        description="by effect (effect@site where it has several): strengths that would have shown"
    )
    gain: GainPart
    unexplained_share: Number | None = Field(
        description="share of the excess error that is left; null if there was none"
    )
    proposed_motion: str | None = Field(description="what would settle open questions")
    warnings: list[str] = Field(description="sentences that a reader should know")
    data_quality: dict[str, Any] = Field(description="what was left out of the data, and why")
    complete: bool = Field(description="false if the diagnosis was interrupted")
    origin: Origin


def verdict_file(
    verdict: Verdict, sentence: str, origin: Origin, *, complete: bool = True
) -> VerdictFile:
    """``verdict`` as it is written."""
    gain = verdict.gain
    return VerdictFile.model_validate(
        {
            "verdict": verdict.verdict,
            "sentence": sentence,
            "causes": [_cause(cause) for cause in verdict.causes],
            "set": verdict.ambiguous,
            "excluded": {
                name: ExcludedPart(strength=e.strength, unit=e.unit, parameter=e.parameter)
                for name, e in verdict.excluded.items()
                # A strength that no data of this kind could show is no exclusion.
                if math.isfinite(e.strength)
            },
            "gain": GainPart(
                in_range=_finite(gain.in_range),
                beyond_range=_finite(gain.beyond_range),
                new_grasp=_finite(gain.new_grasp),
            ),
            "unexplained_share": _finite(verdict.unexplained_share),
            "proposed_motion": verdict.proposed_motion,
            "warnings": verdict.warnings,
            "data_quality": plain(verdict.data_quality),
            "complete": complete,
            "origin": origin,
        }
    )


def write_verdict(file: VerdictFile, path: Path) -> None:
    """Write ``path`` whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    write_whole(path, json.dumps(file.model_dump(by_alias=True), indent=2) + "\n")


def read_verdict(path: Path) -> VerdictFile:
    """What :func:`write_verdict` wrote.

    Raises:
        OSError: it cannot be read.
        pydantic.ValidationError: it is no verdict.
    """
    return VerdictFile.model_validate_json(path.read_text(encoding="utf-8"))


def verdict_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of ``verdict.json``."""
    schema = VerdictFile.model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def schema_text() -> str:
    return json.dumps(verdict_schema(), indent=2) + "\n"


def plain(value: Any) -> Any:
    """``value`` as JSON has it: numpy's numbers and arrays as Python's, infinities as None.

    Raises:
        TypeError: it holds something that JSON has no word for.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return _finite(value)
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"JSON has no word for a {type(value).__name__}: {value!r}")


def _cause(cause: Cause) -> CausePart:
    return CausePart(
        effect=cause.effect,
        site=cause.site,
        parameters={name: _parameter(p) for name, p in cause.parameters.items()},
        gain=_finite(cause.gain),
        alternatives=list(cause.cannot_tell),
    )


def _parameter(estimate: Estimate) -> ParameterPart:
    low, high = estimate.interval90
    return ParameterPart(
        value=estimate.value, unit=estimate.unit, interval90=(_finite(low), _finite(high))
    )


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
