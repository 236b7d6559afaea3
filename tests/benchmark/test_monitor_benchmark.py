"""The comparison of the discrepancy metrics: what is drawn, what is counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from defras_bt.benchmark.cases import shipped
from defras_bt.benchmark.mismatches import KINDS, CameraShift, Slip, draw_mismatch
from defras_bt.benchmark.monitor import as_quiet, monitor_tables, noticed
from defras_bt.benchmark.monitor_runs import MonitorRun, Retraction, SameTissue, monitor_run
from defras_sim.geometry import Floats, Pose
from defras_sim.surface import Surface
from defras_sim.twin import Twin

FRAMES = 30


def run(mu_mm: Floats, null_mm: Floats, moved_mm: Floats, gap_mm: float = 0.0) -> MonitorRun:
    mu = {"local": 1e-3 * mu_mm, "median": 1e-4 * mu_mm}
    null = {"local": 1e-3 * null_mm, "median": 1e-4 * null_mm}
    gap_m = np.full(FRAMES, 1e-3 * gap_mm)
    return MonitorRun(0, "slip", "A", (1, 1), 0.1, 5, 1e-3 * moved_mm, gap_m, mu, null)


def after(frame: int, value: float) -> Floats:
    return np.where(np.arange(FRAMES) >= frame, value, 0.0)


NOTHING = np.zeros(FRAMES)


def test_an_alarm_takes_two_frames_and_its_delay_counts_from_when_it_matters() -> None:
    found = noticed([run(after(12, 9.0), NOTHING, after(10, 7.0))], "local", 0.002)
    assert found.share == 1.0
    assert found.delay_s == pytest.approx(0.3)
    blip = np.where(np.arange(FRAMES) == 12, 9.0, 0.0)
    assert noticed([run(blip, NOTHING, after(10, 7.0))], "local", 0.002).share == 0.0


def test_mismatches_that_move_nothing_far_are_not_counted() -> None:
    small = run(NOTHING, NOTHING, after(10, 4.0))
    assert np.isnan(noticed([small], "local", 0.002).share)


def test_what_was_raised_before_the_mismatch_began_notices_nothing() -> None:
    early = np.where(np.arange(FRAMES) < 4, 9.0, 0.0)
    assert noticed([run(early, NOTHING, after(10, 7.0))], "local", 0.002).share == 0.0


def test_alarms_without_mismatch_are_counted_once_each_and_told_from_real_differences() -> None:
    twice = after(3, 5.0) - after(8, 5.0) + after(20, 5.0)
    minutes = FRAMES * 0.1 / 60
    true = noticed([run(NOTHING, twice, NOTHING, gap_mm=5.0)], "local", 0.002)
    assert true.alarms_per_min == pytest.approx(2 / minutes)
    assert true.false_alarms_per_min == 0.0
    false = noticed([run(NOTHING, twice, NOTHING, gap_mm=0.1)], "local", 0.002)
    assert false.false_alarms_per_min == pytest.approx(2 / minutes)


def test_equally_quiet_is_the_lowest_threshold_without_more_alarms() -> None:
    runs = [run(after(12, 9.0), after(5, 3.1), after(10, 7.0))]
    assert as_quiet(runs, "local", 0.0) == pytest.approx(0.00325)
    assert as_quiet(runs, "local", 0.0, false_only=True) == pytest.approx(0.00325)
    off = [replace(runs[0], null_gap_m=np.full(FRAMES, 0.004))]
    assert as_quiet(off, "local", 0.0, false_only=True) == pytest.approx(0.00025)
    tables = monitor_tables(runs)
    assert [row["metric"] for row in tables["Both metrics"]] == [
        "median",
        "local",
        "local",
        "local",
    ]
    assert [row["mismatch"] for row in tables["Noticed, by mismatch"]] == ["slip"]


@pytest.mark.parametrize("kind", KINDS)
def test_mismatches_begin_when_they_say(kind: str) -> None:
    scene = shipped("sim1")
    point = (2, 3)
    mismatch = draw_mismatch(kind, scene, point, 40, np.random.default_rng(3))
    assert mismatch is not None
    assert mismatch.kind == kind
    tips = {"psm1": Pose(np.array([0.0, 0.0, 0.01]))}
    before = mismatch.starts - 1
    assert np.array_equal(mismatch.tips(before, tips)["psm1"].position_m, [0, 0, 0.01])
    if isinstance(mismatch, Slip):
        slid = mismatch.tips(mismatch.starts + 9, tips)["psm1"].position_m
        assert slid - [0, 0, 0.01] == pytest.approx(mismatch.slid_m)
    if isinstance(mismatch, CameraShift):
        assert np.array_equal(mismatch.camera(before).position_m, np.zeros(3))
        assert mismatch.camera(mismatch.starts).position_m == pytest.approx(mismatch.moved_m)
    changed = (mismatch.actual(scene).attached != scene.attached).any()
    assert changed == (kind in ("extra", "missing"))


def test_the_gap_of_two_meshes_of_tissue_at_rest_is_none_and_a_shift_is_its_length() -> None:
    scene = shipped("sim1")
    one, other = Twin(scene).state.surface, Twin(scene.simulated).state.surface
    same = SameTissue.of(one, other)
    assert same.largest_gap_m(one, other) == pytest.approx(0.0, abs=1e-6)
    shifted = Surface(one.vertices_m + [0, 0, 0.003], one.triangles, one.upper, one.rest_xy_m)
    assert same.largest_gap_m(shifted, other) == pytest.approx(0.003, abs=1e-6)


def test_one_run_with_extra_attachments_moves_what_the_local_metric_sees() -> None:
    known = [Retraction("sim8", (2, 4), ("pull",))]
    found = monitor_run(known, 0.56, 0, KINDS.index("extra"))
    assert found.kind == "extra"
    assert len(found.mu_m["local"]) == len(found.moved_m) == len(found.null_gap_m)
    if found.moved_m.max() > 0.01:
        assert np.nanmax(found.mu_m["local"]) > 0.003
