"""The schema of ``run.json``. ``run.schema.json`` beside this file is printed from it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

SCHEMA_FILE = Path(__file__).with_name("run.schema.json")

STREAM_FILE = "stream.csv"
"""Beside ``run.json`` of a run on a robot: every set-point, when it was sent, when applied."""

Outcome = Literal["goal", "not_reached", "human", "error"]
Count = Annotated[int, Field(ge=0)]
Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Newton = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]


class AttachmentUpdates(BaseModel):
    """Updates of the believed attachments."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    tried: Count = Field(description="proposals that were judged")
    adopted: Count = Field(description="proposals that replaced the belief")


class Warnings(BaseModel):
    """How often the warning state rose to 1, 2 and 3 (with the metric that the tree acts on)."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)
    state_1: Count = Field(alias="1")
    state_2: Count = Field(alias="2")
    state_3: Count = Field(alias="3")


class Reason(BaseModel):
    """Why the run ended."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    code: str = Field(description="stable word; defras explain says what it means")
    sentence: str


class OperatorAct(BaseModel):
    """Something the operator did while the run went on."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    time_s: Seconds = Field(description="world time")
    act: str = Field(description="pause, resume, stop, take_over, hand_back, approve or refuse")
    source: str = Field(description="front end: keyboard, socket, Ctrl-C, ...")
    words: str = Field(description="what the operator added")


class OperatorLog(BaseModel):
    """The operator's part in the run."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    acts: list[OperatorAct]
    held_s: Seconds = Field(description="world time paused or taken over")


class Durations(BaseModel):
    """How long something took, over a whole run."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    median_s: Seconds
    p99_s: Seconds


class Period(BaseModel):
    """Times between set-points, while any were sent."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    nominal_s: Seconds
    count: Count
    median_s: Seconds | None
    p99_s: Seconds | None
    longest_s: Seconds | None


class StreamLog(BaseModel):
    """The stream of set-points to real arms."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    period: Period
    latency: dict[str, Durations] = Field(
        description="by sensor: from the stamp of a reading to the first set-point decided on it"
    )
    taken_up: Durations | None = Field(
        description="from sending a set-point to the arm's echo of it; null if none came back"
    )
    realtime: bool = Field(description="whether the system let the stream run before others")


class RunFile(BaseModel):
    """What one run came to."""

    model_config = ConfigDict(extra="forbid", frozen=True, title="run.json")
    outcome: Outcome = Field(description="goal, not_reached, human (asked for) or error")
    reason: Reason | None = Field(description="why the run ended; null if it broke off at once")
    roi_visibility: Share | None = Field(description="share of the region seen at the end")
    actions: Count = Field(description="actions finished")
    replans: Count = Field(description="new plans asked for after the first")
    warnings: Warnings
    attachment_updates: AttachmentUpdates
    operator: OperatorLog
    force_threshold_n: Newton = Field(description="epsilon")
    force_max_n: Newton | None = Field(description="largest grasp force that the twin estimated")
    force_mean_n: Newton | None = Field(description="mean of the estimate over ticks above 0")
    force_max_true_n: Newton | None = Field(description="largest true grasp force; null if unknown")
    time_over_threshold_s: Seconds = Field(description="world time with the estimate over epsilon")
    ticks_over_threshold: Count
    time_over_threshold_true_s: Seconds | None = Field(
        default=None,
        description="world time with the true grasp force over epsilon; null if unknown",
    )
    duration_s: Seconds = Field(description="world time from the first tick to the last")
    wall_s: Seconds = Field(description="time that passed on the wall meanwhile")
    seed: int
    scene: str = Field(description="scene file, what was believed")
    actual: str | None = Field(description="scene file of what was really there; null if unknown")
    world: str
    tree: str
    versions: dict[str, str]
    substituted: list[str] = Field(
        description="paths of nodes replaced by scripts; the run was a trial"
    )
    stream: StreamLog | None = Field(
        description="how set-points were streamed; null for simulated worlds"
    )


def run_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of ``run.json``."""
    schema = RunFile.model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def schema_text() -> str:
    return json.dumps(run_schema(), indent=2) + "\n"
