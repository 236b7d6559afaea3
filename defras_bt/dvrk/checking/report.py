"""The check's file: what was found, when, for which set-up and scene."""

from __future__ import annotations

import hashlib
import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

from pydantic import AwareDatetime, ValidationError

from defras_bt.dvrk.checking.finding import Finding
from defras_bt.dvrk.settings import Setup
from defras_bt.planning.scene_hash import scene_hash
from defras_bt.recording.whole_file import write_whole
from defras_sim.scene import Scene
from defras_sim.scene_parts import Part


class NotChecked(RuntimeError):
    """No check allows this run; the message says what is missing."""


class CheckReport(Part):
    """``moved``: whether the motion check was done. ``setup``, ``registration`` and ``scene`` are
    fingerprints of what was checked."""

    schema_name: Literal["defras/dvrk_check/1"] = "defras/dvrk_check/1"
    checked: AwareDatetime
    setup: str
    registration: str
    scene: str
    scene_name: str
    moved: bool
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong, and the arms were seen to go where they are told."""
        return self.moved and not any(one.grade == "wrong" for one in self.findings)


def fingerprint(file: Path) -> str:
    """SHA-256 (hex) of a file's content."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def write_check(report: CheckReport, file: Path) -> None:
    """Write at once or not at all.

    Raises:
        OSError: it cannot be written.
    """
    content = {"passed": report.passed, **report.model_dump(mode="json")}
    write_whole(file, json.dumps(content, indent=2) + "\n")


def read_check(file: Path) -> CheckReport:
    """
    Raises:
        NotChecked: there is no such file, or it is something else.
    """
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        if isinstance(content, dict):
            content.pop("passed", None)  # for people and scripts; it follows from the rest
        return CheckReport.model_validate(content)
    except FileNotFoundError as error:
        raise NotChecked(f"{file} does not exist: run defras dvrk check first") from error
    except ValidationError as error:
        first = error.errors()[0]
        why = f"{'.'.join(map(str, first['loc'])) or 'content'}: {first['msg']}"
        raise NotChecked(f"{file} is no check's file ({why}): run defras dvrk check") from error
    except (OSError, ValueError) as error:
        raise NotChecked(f"{file} is no check's file ({error}): run defras dvrk check") from error


def require_checked(setup: Setup, scene: Scene, now: datetime) -> CheckReport:
    """The check that allows to operate on ``scene`` with ``setup`` at ``now``.

    Raises:
        NotChecked: it is missing, failed, too old, or of something else.
    """
    report, again = read_check(setup.checked), "run defras dvrk check again"
    age = now - report.checked
    limit = timedelta(hours=setup.limits.check_age_h)
    if not report.moved:
        raise NotChecked(
            f"{setup.checked}: the check moved nothing; {again}, and approve the motion"
        )
    if not report.passed:
        first = next(one for one in report.findings if one.grade == "wrong")
        raise NotChecked(
            f"{setup.checked}: the check failed ({first.about}: {first.what}); mend it, and {again}"
        )
    if not timedelta(0) <= age <= limit:
        hours = age.total_seconds() / 3600
        raise NotChecked(
            f"{setup.checked}: the check is {hours:.1f} h old, {limit.total_seconds() / 3600:g} h "
            f"are allowed; {again}"
        )
    if report.setup != setup.fingerprint:
        raise NotChecked(f"{setup.checked}: the set-up was changed since the check; {again}")
    if not setup.registration.is_file() or report.registration != fingerprint(setup.registration):
        raise NotChecked(f"{setup.checked}: arms or cameras were registered since; {again}")
    if report.scene != scene_hash(scene):
        raise NotChecked(
            f"{setup.checked}: the check was for the scene {report.scene_name!r} as it was then; "
            f"{again} with this scene"
        )
    return report
