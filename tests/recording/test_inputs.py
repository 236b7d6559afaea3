"""What an executive was told comes back to the last bit, whatever it was."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from defras_bt.recording.bag import BagRecorder
from defras_bt.recording.inputs_reader import NoInputs, read_inputs
from defras_bt.recording.record import RunSummary, TickRecord
from defras_bt.sensing.sense import SensedObservation, sense
from defras_sim.geometry import Pose
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmObservation, PointCloud
from tests.recording.synthetic_run import SyntheticRun


def told(rng: np.random.Generator, time_s: float) -> SensedObservation:
    """Readings of which every number uses all its digits."""
    arm = ArmObservation(
        stamp_s=time_s - 1e-9 / 3,
        tissue_from_tip=Pose(rng.normal(size=3), Rotation.random(rng=rng).as_matrix()),
        setpoint_tissue_from_tip=Pose(rng.normal(size=3), Rotation.random(rng=rng).as_matrix()),
        jaw_rad=float(rng.normal()),
        grasped=(None, True, False)[int(rng.integers(3))],
        joints=None if rng.random() < 0.5 else rng.normal(size=6),
        setpoint_joints=rng.normal(size=6),
        force_n=None if rng.random() < 0.5 else rng.normal(size=3),
        goal_tissue_from_tip=None
        if rng.random() < 0.5
        else Pose(rng.normal(size=3), Rotation.random(rng=rng).as_matrix()),
    )
    points = rng.normal(size=(30, 3)).astype(np.float32).astype(float)
    return SensedObservation(
        time_s=time_s,
        arms={"psm1": arm},
        cloud=None if rng.random() < 0.3 else PointCloud(time_s - 1 / 3, points),
        roi_visibility=float(rng.random()),
        roi_visibility_stamp_s=time_s - 0.1,
        faults=("no cloud: too few points",) if rng.random() < 0.3 else (),
        dropped_points=int(rng.integers(3)),
        stopped={"psm1": "PSM1: is PAUSED"} if rng.random() < 0.3 else {},
    )


def through(path: Path, run: SyntheticRun, records: list[TickRecord]) -> list[SensedObservation]:
    recorder = BagRecorder(path)
    recorder.start(run.info)
    for record in records:
        recorder.tick(record)
    recorder.finish(RunSummary({}))
    return [tick.observation for tick in read_inputs(path).ticks]


def test_readings_come_back_to_the_last_bit(tmp_path: Path, short_run: SyntheticRun) -> None:
    rng, first = np.random.default_rng(5), short_run.ticks()[0]
    given = [told(rng, 1.0 + tick * 0.05) for tick in range(60)]
    # The camera is slower than the tick: the same cloud again.
    given[7] = replace(given[7], cloud=given[6].cloud)
    # A faulty driver: other points under the same stamp.
    given[31] = replace(
        given[31], cloud=PointCloud(given[30].time_s - 1 / 3, np.full((30, 3), 0.5))
    )
    records = [
        replace(first, tick=tick, time_s=seen.time_s, observation=seen)
        for tick, seen in enumerate(given)
    ]
    for before, after in zip(given, through(tmp_path / "r.mcap", short_run, records), strict=True):
        assert repr(_plain(after)) == repr(_plain(before))


def test_numbers_that_are_none_and_infinite_ones(tmp_path: Path, short_run: SyntheticRun) -> None:
    rng, first = np.random.default_rng(6), short_run.ticks()[0]
    seen = told(rng, 1.0)
    arm = replace(seen.arms["psm1"], jaw_rad=math.nan)
    arm.tissue_from_tip.position_m[1] = math.inf
    seen = replace(seen, arms={"psm1": arm}, roi_visibility=None, roi_visibility_stamp_s=None)
    (after,) = through(tmp_path / "r.mcap", short_run, [replace(first, observation=seen)])
    assert repr(_plain(replace(after, time_s=1.0))) == repr(_plain(seen))


def test_sensing_takes_what_comes_back_as_it_is(tmp_path: Path, short_run: SyntheticRun) -> None:
    scene: Scene = short_run.info.scene
    records = short_run.ticks()[:3]
    sensed = [replace(r, observation=sense(r.observation, scene)) for r in records]
    for after in through(tmp_path / "r.mcap", short_run, sensed):
        assert sense(after, scene) is after


def test_other_recordings_are_refused_in_words(tmp_path: Path, short_run: SyntheticRun) -> None:
    with pytest.raises(NoInputs, match=r"recording\.mcap does not exist"):
        read_inputs(tmp_path)
    recorder = BagRecorder(tmp_path / "recording.mcap")
    recorder.start(short_run.info)
    recorder.finish(RunSummary({}))
    with pytest.raises(NoInputs, match="has no /executive/inputs"):
        read_inputs(tmp_path)


def _plain(seen: SensedObservation) -> tuple[object, ...]:
    """Everything in an observation, as lists that show every digit."""
    arms = [
        [
            name,
            arm.stamp_s,
            arm.jaw_rad,
            arm.grasped,
            *(
                [pose.position_m.tolist(), pose.rotation.tolist()]
                for pose in (arm.tissue_from_tip, arm.setpoint_tissue_from_tip)
            ),
            *(
                None if j is None else j.tolist()
                for j in (arm.joints, arm.setpoint_joints, arm.force_n)
            ),
        ]
        for name, arm in seen.arms.items()
    ]
    cloud = None if seen.cloud is None else [seen.cloud.stamp_s, seen.cloud.points_m.tolist()]
    rest = (seen.roi_visibility, seen.roi_visibility_stamp_s, seen.faults, seen.dropped_points)
    return (seen.time_s, arms, cloud, *rest)
