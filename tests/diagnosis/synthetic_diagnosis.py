"""A diagnosis that nobody made: tissue and coupon, with everything a report can show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defras_bt.diagnosis.diagnosis import (
    Confounding,
    Diagnosis,
    ExcessOf,
    Ranked,
    Round,
    Statistic,
    Trial,
)
from defras_bt.diagnosis.exhibits import Comparison, Exhibits, ReplayFrame
from defras_bt.diagnosis.problem import Channel, Samples
from defras_bt.diagnosis.verdict import Cause, Estimate, Excluded, Gain, Verdict
from defras_bt.diagnosis.verdict_file import Origin
from defras_sim.geometry import Floats
from defras_sim.resources import resource
from defras_sim.scene import Scene, load_scene
from defras_sim.surface import Surface

SCENE_FILE = resource("sim/scenes/demo.yaml")
ORIGIN = Origin(
    twin="tissue",
    data=["recording.mcap", "second.mcap"],
    scene="demo.yaml",
    versions={"defras": "0.1.0"},
)
KEYS = (
    "stiffness",
    "extra_attachment",
    "missing_attachment",
    "stress_relaxation",
    "camera_registration",
    "depth_bias",
    "grasp_slip",
    "tool_offset",
)
PHASES = ("rest", "pull", "hold", "fold")
_CELLS = 6
_FRAMES = 60
_PERIOD_S = 0.2
_NOISE_M, _NOISE_N = 0.0003, 0.01


def synthetic_scene() -> Scene:
    return load_scene(SCENE_FILE)


def named_verdict() -> Verdict:
    """Relaxation, with everything that a verdict can say beside it."""
    return Verdict(
        verdict="named",
        causes=(
            Cause(
                "stress_relaxation",
                "",
                {
                    "fraction": Estimate(0.35, "", (0.31, 0.38)),
                    "time_s": Estimate(2.0, "s", (1.6, 2.5)),
                },
                0.81,
            ),
        ),
        ambiguous=(),
        excluded={
            "grasp_slip": Excluded(0.0011, "m", "distance_m"),
            "depth_bias": Excluded(0.0007, "m", "offset_m"),
        },
        gain=Gain(in_range=0.81, beyond_range=0.66),
        unexplained_share=0.19,
        warnings=("The fit was never held against a slower motion: do not trust it there.",),
        data_quality={
            "rows": {"/tissue/points": 120},
            "left_out": {"/tissue/points": 3},
            "faults": [
                {
                    "source": "/tissue/points",
                    "kind": "drop_out",
                    "spans_s": [[2.0, 2.4]],
                    "rows": 3,
                    "sentence": "/tissue/points: zeros at 2.00 to 2.40 s; 3 rows left out",
                }
            ],
        },
    )


def samples() -> Samples:
    """Two recordings of a grid of cells on the tissue and of three components of a force."""
    places = (np.arange(_CELLS) - (_CELLS - 1) / 2) * 0.02
    channels = tuple(
        Channel(f"cell {i},{j}", "cloud", "m", _NOISE_M, 0.0003, (float(x), float(y)))
        for j, y in enumerate(places)
        for i, x in enumerate(places)
    ) + tuple(Channel(f"force {a}", "force", "N", _NOISE_N, 0.005) for a in "xyz")
    time_s = np.arange(_FRAMES) * _PERIOD_S
    phase = np.minimum(np.arange(_FRAMES) * len(PHASES) // _FRAMES, len(PHASES) - 1)
    count = len(channels)
    tiled = {
        "time_s": np.tile(time_s, 2 * count),
        "channel": np.tile(np.repeat(np.arange(count), _FRAMES), 2),
        "trajectory": np.repeat(np.arange(2), count * _FRAMES),
        "phase": np.tile(phase, 2 * count),
        "fold": np.tile(np.arange(_FRAMES) // 10, 2 * count),
    }
    return Samples(
        channels=channels, trajectories=("first pull", "second pull"), phases=PHASES, **tiled
    )


def bump(labels: Samples) -> Floats:
    """What a patch that holds where the model is free does: it grows with the pull."""
    places = np.array([c.place_m or (9.0, 9.0) for c in labels.channels])[labels.channel]
    gap_m = np.hypot(places[:, 0] - 0.03, places[:, 1] + 0.02)
    rise = np.clip((labels.time_s - 3.0) / 4.0, 0, 1)
    force = np.array([c.unit == "N" for c in labels.channels])[labels.channel]
    return np.where(force, 0.08 * rise, -0.008 * rise * np.exp(-((gap_m / 0.02) ** 2)))


def synthetic_diagnosis(verdict: Verdict | None = None, seed: int = 3) -> Diagnosis:
    """``named_verdict``, or another one on the same data."""
    rng, labels = np.random.default_rng(seed), samples()
    sd = np.array([c.noise_sd for c in labels.channels])[labels.channel]
    noise = sd * rng.standard_normal(len(sd))
    before = noise + bump(labels)
    before[(labels.channel == 0) & (labels.time_s > 8)] = np.nan
    after = before - 0.85 * bump(labels)
    likeness = np.corrcoef(rng.standard_normal((len(KEYS), 5)))
    likeness[0, 3] = likeness[3, 0] = 0.998
    gains = dict(zip(KEYS, (0.4, 0.55, 0.3, 0.8, 0.1, 0.12, 0.05, 0.02), strict=True))
    extension = {"stress_relaxation": {"fraction": 0.35, "time_s": 2.0}}
    said = verdict or named_verdict()
    return Diagnosis(
        verdict=said,
        samples=labels,
        candidates=(),
        base={},
        model=extension if said.causes else {},
        residual_before=before,
        residual_after=after,
        held_out_before=before,
        held_out_after=after,
        fold_gain=np.full(6, 0.8),
        excess=(
            ExcessOf("cloud", "m", 9.0, 0.4, 0.0021, 0.0005, 0.0003),
            ExcessOf("force", "N", 30.0, 1.0, 0.055, 0.013, 0.01),
        ),
        portrait=(
            Statistic("drift", "force", 0.03, "N", "The force falls during holds.", 0.01),
            Statistic("lag", "tips", 0.0, "s", "Nothing lags.", 0.01),
        ),
        portrait_after=(),
        ranking=tuple(Ranked(key, gain, gain - 0.05, True, {}) for key, gain in gains.items()),
        pairs=(),
        rounds=(
            Round(
                trials=tuple(
                    Trial(key, extension, gains[key] - 0.05, True, 5)
                    for key in ("stress_relaxation", "extra_attachment", "stiffness")
                ),
                threshold=0.07,
                accepted="stress_relaxation",
            ),
        ),
        confounding=Confounding(KEYS, likeness, np.ones(len(KEYS)), np.ones(len(KEYS))),
        partial=(),
        unseen=("gravity",),
        residual_calls=40,
        complete=True,
    )


def synthetic_replay(frames: int = 6) -> Exhibits:
    """A sheet that is lifted in the middle; what is seen hangs back on one side."""
    side = np.linspace(-0.06, 0.06, 25)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    index = np.arange(25 * 25).reshape(25, 25)
    a, b, c, d = (
        part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])
    )
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    replay = []
    for frame in range(frames):
        lift = 0.03 * frame / (frames - 1)
        plain = lift * np.exp(-((x**2 + y**2) / 0.03**2))
        actual = plain - 0.4 * lift * np.exp(-(((x - 0.03) ** 2 + (y + 0.02) ** 2) / 0.02**2))
        extended = 0.15 * plain + 0.85 * actual
        replay.append(
            ReplayFrame(
                time_s=float(frame),
                trajectory="first pull",
                phase="pull",
                plain_cloud_m=np.stack([x, y, actual], axis=1),
                extended_cloud_m=np.stack([x, y, actual], axis=1),
                before_m=actual - plain,
                after_m=actual - extended,
                plain=_sheet(x, y, plain, triangles),
                extended=_sheet(x, y, extended, triangles),
                tips_m={"psm1": np.array([0.0, 0.0, lift])},
                held=("psm1",),
            )
        )
    return Exhibits(replay=tuple(replay))


def synthetic_curves() -> Exhibits:
    stretch = np.linspace(1.0, 2.0, 40)
    measured = 2.0 * (stretch - 1) ** 1.4
    plain = 2.0 * (stretch - 1)
    curve = Comparison("pull 1", "stretch", "", "force", "N", stretch, measured, plain, measured)
    return Exhibits(comparisons=(curve, replace(curve, name="pull 2")))


def _sheet(x: Floats, y: Floats, z: Floats, triangles: np.ndarray) -> Surface:
    return Surface(
        vertices_m=np.stack([x, y, z], axis=1),
        triangles=triangles,
        upper=np.ones(len(x), bool),
        rest_xy_m=np.stack([x, y], axis=1),
    )
