"""Whether cameras show the tissue where it is, now."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defras_bt.dvrk.camera_source import CameraReadings
from defras_bt.dvrk.checking.bench import CheckBench
from defras_bt.dvrk.checking.finding import Finding, ok, warning, wrong
from defras_bt.sensing.cloud import Workspace
from defras_bt.sensing.sense import MIN_CLOUD_POINTS

_FLAT_M = 0.01
_OFF_M = 0.006
_SLOW_SHARE = 0.7


class CameraCheck:
    """Age, frame and place of cloud and endoscope."""

    def run(self, bench: CheckBench) -> list[Finding]:
        readings, _ = bench.looks[-1]
        findings = []
        if bench.setup.cameras.depth is None:
            todo = "Without a cloud nothing moves: add cameras.depth to the set-up."
            findings.append(wrong("camera", "depth", "is not in the set-up", todo))
        else:
            findings.append(self._cloud(bench, readings))
        if bench.setup.cameras.endoscope is None:
            todo = "Without it nothing moves: add cameras.endoscope to the set-up."
            findings.append(wrong("camera", "endoscope", "is not in the set-up", todo))
        else:
            findings.append(self._endoscope(bench, readings))
        return findings

    def _cloud(self, bench: CheckBench, readings: CameraReadings) -> Finding:
        fault, cloud = readings.faults.get("cloud", ""), readings.cloud
        if fault or cloud is None:
            what = fault or "no cloud of the tissue has come"
            return wrong(
                "camera", "depth", what, "defras dvrk cameras calibrate shows what it sees."
            )
        ahead = _ahead(bench, "depth", _cloud_stamp_s)
        if ahead is not None:
            return ahead
        age_s, limit_s = _age_s(bench, _cloud_stamp_s), bench.setup.limits.camera_age_s
        if not age_s <= limit_s:
            what = f"its clouds are {age_s:.2f} s old in the median when they are needed"
            todo = f"At most {limit_s:g} s: a faster camera, or fewer points."
            return wrong("camera", "depth", what, todo)
        inside = Workspace.of(bench.scene).holds(cloud.points_m)
        if inside.sum() < MIN_CLOUD_POINTS:
            what = f"{int(inside.sum())} points lie where tissue can be"
            return wrong("camera", "depth", what, "Register the camera anew.")
        return self._place(bench, cloud.points_m[inside], age_s)

    def _place(self, bench: CheckBench, points_m: np.ndarray, age_s: float) -> Finding:
        """Before the operation tissue lies as the scene has it."""
        upper = bench.scene.tissue.shape.upper
        over_m = points_m[:, 2] - upper.at(points_m[:, :2])[:, 2]
        off_m = float(np.median(over_m))
        what = f"{len(points_m)} points of tissue, {age_s * 1e3:.0f} ms old in the median, "
        if abs(off_m) > _OFF_M:
            side = "above" if off_m > 0.0 else "below"
            what += f"in the median {abs(off_m) * 1e3:.1f} mm {side} where the tissue rests"
            return wrong("camera", "depth", what, "Register the camera anew.")
        if float(np.quantile(np.abs(over_m), 0.9)) > _FLAT_M:
            what += "but a tenth of them far from where the tissue rests"
            todo = "Is the tissue at rest, and nothing of its colour beside it?"
            return warning("camera", "depth", what, todo)
        what += f"{abs(off_m) * 1e3:.1f} mm from where the tissue rests"
        slow = _slow(bench, _cloud_stamp_s, bench.setup.rates.depth_hz)
        if slow:
            return warning("camera", "depth", f"{what}; {slow}", "Is the computer busy?")
        return ok("camera", "depth", what)

    def _endoscope(self, bench: CheckBench, readings: CameraReadings) -> Finding:
        fault = readings.faults.get("endoscope", "")
        seen = readings.roi_visibility
        if fault or seen is None:
            what = fault or "no picture of the region has come"
            todo = "defras dvrk cameras calibrate shows what it sees."
            return wrong("camera", "endoscope", what, todo)
        ahead = _ahead(bench, "endoscope", lambda look: look.roi_visibility_stamp_s)
        if ahead is not None:
            return ahead
        age_s = _age_s(bench, lambda look: look.roi_visibility_stamp_s)
        limit_s = bench.setup.limits.camera_age_s
        if not age_s <= limit_s:
            what = f"its pictures are {age_s:.2f} s old in the median when they are needed"
            return wrong("camera", "endoscope", what, f"At most {limit_s:g} s is allowed.")
        if seen >= bench.scene.thresholds.roi_visibility:
            what = f"sees {seen:.0%} of the region already"
            todo = "Nothing is to be done, or it takes something else for the region."
            return warning("camera", "endoscope", what, todo)
        what = f"sees {seen:.0%} of the region, {age_s * 1e3:.0f} ms ago in the median"
        slow = _slow(
            bench, lambda look: look.roi_visibility_stamp_s, bench.setup.rates.endoscope_hz
        )
        if slow:
            return warning("camera", "endoscope", f"{what}; {slow}", "Is the computer busy?")
        return ok("camera", "endoscope", what)


def _cloud_stamp_s(look: CameraReadings) -> float | None:
    return None if look.cloud is None else look.cloud.stamp_s


def _slow(
    bench: CheckBench, stamp_s: Callable[[CameraReadings], float | None], usual_hz: float
) -> str:
    """How often readings come, in words, if that is much less than usual; else ""."""
    stamps = np.unique([at_s for look, _ in bench.looks if (at_s := stamp_s(look)) is not None])
    if len(stamps) < 2:
        return ""
    rate_hz = (len(stamps) - 1) / (stamps[-1] - stamps[0])
    if rate_hz >= _SLOW_SHARE * usual_hz:
        return ""
    return f"it comes at {rate_hz:.1f} Hz, {usual_hz:g} Hz are usual"


def _ahead(
    bench: CheckBench, camera: str, stamp_s: Callable[[CameraReadings], float | None]
) -> Finding | None:
    """What is wrong with a camera whose clock is ahead: a run acts on nothing from the future."""
    limit_s = bench.setup.limits.clock_offset_s
    ahead_s = max(
        (at_s - now_s for look, now_s in bench.looks if (at_s := stamp_s(look)) is not None),
        default=0.0,
    )
    if ahead_s <= limit_s:
        return None
    what = f"it is stamped {ahead_s * 1e3:.0f} ms in the future"
    todo = (
        "Keep the clocks of its computer and this one in step (chrony or ptp); "
        f"{limit_s * 1e3:g} ms are allowed."
    )
    return wrong("camera", camera, what, todo)


def _age_s(bench: CheckBench, stamp_s: Callable[[CameraReadings], float | None]) -> float:
    """Median age over all looks; infinite where there was nothing yet."""
    ages = []
    for look, now_s in bench.looks:
        at_s = stamp_s(look)
        ages.append(np.inf if at_s is None else now_s - at_s)
    return float(np.median(ages))
