"""Pre-operative results as JSON files that know which scene they were made for.

Schema ``defras/preoperative/1``: an object with ``schema`` and ``result``; ``result`` has the
fields of :class:`~defras_bt.planning.preoperative.PreoperativeResult`, nested ones as objects,
grasp points as [column, row]. Forces in N, visibility 0..1.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from defras_bt.planning.preoperative import PreoperativeResult
from defras_bt.planning.scene_hash import scene_hash
from defras_sim.scene import Scene

SCHEMA: Literal["defras/preoperative/1"] = "defras/preoperative/1"
# The largest threshold that a scene may state, too.
HIGHEST_THRESHOLD_N = 50.0


class InvalidPlanFile(ValueError):
    """The file cannot be read as a plan file."""


class UnusableThreshold(ValueError):
    """No force could be told from too much of it."""


class StalePlanFile(ValueError):
    """The scene changed since the plan was made."""


class _PlanFile(BaseModel):
    model_config = ConfigDict(extra="forbid")
    schema_: Literal["defras/preoperative/1"] = Field(alias="schema")
    result: PreoperativeResult


def save_plan(result: PreoperativeResult, file: Path) -> None:
    """Write ``result``; the folder must exist.

    Raises:
        UnusableThreshold: the threshold that was computed is none that force checks could use.
    """
    objection = _objection(result.force_threshold_n)
    if objection is not None:
        raise UnusableThreshold(
            f"the plan was not saved: {objection}. It is twice the median of the largest forces of "
            "all rehearsals: state one in the scene (thresholds.force_n), or look at its material"
        )
    content = _PlanFile(schema=SCHEMA, result=result)
    file.write_text(content.model_dump_json(by_alias=True, indent=1) + "\n", encoding="utf-8")


def read_plan(file: Path) -> PreoperativeResult:
    """Read a plan, whatever scene it was made for.

    Raises:
        InvalidPlanFile: the file is no plan file.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise InvalidPlanFile(
            f"{file}: cannot be read: {error.strerror}; give a file that `defras plan -o` wrote"
        ) from error
    try:
        result = _PlanFile.model_validate_json(content).result
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        raise InvalidPlanFile(
            f"{file}: {place}: {first['msg']}; valid are files with schema {SCHEMA}, as "
            "`defras plan` writes them"
        ) from error
    objection = _objection(result.force_threshold_n)
    if objection is not None:
        raise InvalidPlanFile(f"{file}: result.{objection}")
    return result


def _objection(threshold_n: float) -> str | None:
    """What is wrong with a threshold; None where nothing is.

    Every force check of an operation compares with it: written so that NaN fails.
    """
    if 0.0 < threshold_n <= HIGHEST_THRESHOLD_N:
        return None
    return (
        f"force_threshold_n is {threshold_n} N; valid is a force above 0 N and up to "
        f"{HIGHEST_THRESHOLD_N:g} N"
    )


def load_plan(file: Path, scene: Scene) -> PreoperativeResult:
    """Read a plan made for ``scene``.

    Raises:
        InvalidPlanFile: the file is no plan file.
        StalePlanFile: it was made for other content than ``scene`` has now.
    """
    result = read_plan(file)
    if result.scene_hash != scene_hash(scene):
        raise StalePlanFile(
            f"{file}: made for scene {result.scene!r} before it changed; plan again for the scene "
            f"{scene.name!r} as it is now"
        )
    return result
