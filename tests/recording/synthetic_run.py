"""A run that looks like a real one, made from formulas: it drives every recorder in the tests.

The tissue is a flap that bends up from a hinge. Reality holds a patch of holes more than believed,
so the twin's flap and the real one part; a warning comes, an update is adopted, a new plan reaches
the goal. One second of the story is one second of world time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from defras_bt.monitoring.reading import MonitorReading
from defras_bt.planning.plan import Action, Plan
from defras_bt.recording.record import Event, RunInfo, TickRecord
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ArmName, Attachments, Roi, Scene
from defras_sim.surface import Surface
from defras_sim.tissue.state import TissueState
from defras_sim.worlds.protocol import (
    ArmCommand,
    ArmObservation,
    CameraImage,
    Command,
    Observation,
    PointCloud,
)

TREE = (
    ("defras", "Parallel"),
    ("defras/sense", "Sense"),
    ("defras/guards", "Selector"),
    ("defras/guards/human", "HumanStop"),
    ("defras/guards/stop_learn_replan", "Sequence"),
    ("defras/guards/slow_and_learn", "Sequence"),
    ("defras/operate", "Sequence"),
    ("defras/operate/plan", "MakePlan"),
    ("defras/operate/act", "CarryOut"),
    ("defras/operate/exposed", "RoiExposed"),
)

FIRST_PLAN = (
    Action("reach", "psm1", (1, 4), 1),
    Action("open", "psm1", (1, 4), 2),
    Action("grasp", "psm1", (1, 4), 3),
    Action("pull", "psm1", (1, 4), 4),
    Action("fold", "psm1", (1, 4), 5),
)
SECOND_PLAN = (
    Action("release", "psm1", (1, 4), 1),
    Action("reach", "psm2", (1, 2), 2),
    Action("grasp", "psm2", (1, 2), 3),
    Action("pull", "psm2", (1, 2), 4),
    Action("fold", "psm2", (1, 2), 5),
)
# Begin of each action [s], plan by plan.
FIRST_TIMES = (0.2, 2.0, 2.6, 3.2, 99.0)
SECOND_TIMES = (6.2, 7.0, 9.0, 9.6, 12.0)
LEARNED_S, END_S = 5.6, 16.0

BELIEVED_MAP = (
    "............",
    ".........##.",
    ".........##.",
    ".........##.",
    "..........#.",
    "............",
    "............",
    "..........#.",
    ".........##.",
    ".........##.",
    ".........##.",
    "............",
)
ACTUAL_MAP = (
    "............",
    ".........##.",
    "....##...##.",
    "....###..##.",
    ".....##...#.",
    "............",
    "............",
    "..........#.",
    ".........##.",
    ".........##.",
    "............",
    "............",
)


def synthetic_scene(attachment_map: tuple[str, ...] = BELIEVED_MAP) -> Scene:
    return Scene(
        name="synthetic",
        attachments=Attachments(map=attachment_map),
        roi=Roi(center_x_m=-0.02, center_y_m=0.0, radius_m=0.015),
    )


@dataclass(frozen=True)
class SyntheticRun:
    """``info`` and the ticks of one run; ``with_truth`` False hides what only simulation knows."""

    seed: int = 7
    duration_s: float = END_S
    with_images: bool = True
    with_truth: bool = True
    grid: int = 25

    @property
    def info(self) -> RunInfo:
        scene = synthetic_scene()
        return RunInfo(
            scene=scene,
            scene_file="sim/scenes/synthetic.yaml",
            actual=synthetic_scene(ACTUAL_MAP) if self.with_truth else None,
            actual_file="sim/scenes/synthetic_actual.yaml" if self.with_truth else None,
            world="model",
            tree="trees/defras.yaml",
            seed=self.seed,
            metric="local",
            force_threshold_n=0.3,
            tree_paths=TREE,
            versions={"defras": "0.1.0", "numpy": np.__version__},
            believed=scene.attached,
        )

    def ticks(self) -> tuple[TickRecord, ...]:
        return _ticks(self)

    def _ticks(self) -> Iterator[TickRecord]:
        rng = np.random.default_rng(self.seed)
        count = round(self.duration_s / self.info.scene.tick_s) + 1
        cloud: PointCloud | None = None
        errors_m = np.zeros(0)
        for tick in range(count):
            time_s = tick * self.info.scene.tick_s
            twin, true = self._surfaces(time_s)
            if tick % 2 == 0:
                cloud, errors_m = _observed(time_s, true, twin, rng)
            assert cloud is not None
            yield self._record(tick, time_s, twin, true, cloud, errors_m, rng)

    def _surfaces(self, time_s: float) -> tuple[Surface, Surface]:
        lift, learned = _lift(time_s), time_s >= LEARNED_S
        stuck = 0.7 * np.clip((time_s - 4.0) / 1.4, 0, 1) if time_s < 6.2 else 0.0
        twin = flap_surface(lift, 0.9 * stuck if learned else 0.0, self.grid)
        return twin, flap_surface(lift, stuck, self.grid)

    def _record(
        self,
        tick: int,
        time_s: float,
        twin: Surface,
        true: Surface,
        cloud: PointCloud,
        errors_m: Floats,
        rng: np.random.Generator,
    ) -> TickRecord:
        info = self.info
        learned = time_s >= LEARNED_S
        plan, step = _plan_at(time_s)
        mu_m = max(0.0, float(np.quantile(errors_m, 0.97)) - 0.0011)
        median_m = max(0.0, float(np.median(errors_m)) - 0.0004)
        state = int(np.searchsorted(info.scene.thresholds.delta_m, mu_m, side="right"))
        force_n = 0.0 if _lift(time_s) == 0 else 0.36 * _lift(time_s) * (1.0 if learned else 1.3)
        seen = 0.94 * float(np.clip((_lift(time_s) - 0.25) / 0.7, 0, 1)) if time_s > 6 else 0.0
        believed = info.believed
        if learned:
            believed = synthetic_scene(ACTUAL_MAP).attached | believed
        return TickRecord(
            tick=tick,
            time_s=time_s,
            observation=Observation(
                time_s=time_s,
                arms=_arms(time_s, info.scene),
                cloud=cloud,
                depth_image=_image(cloud.stamp_s, seen, True) if self.with_images else None,
                endoscope_image=_image(cloud.stamp_s, seen, False) if self.with_images else None,
                roi_visibility=seen,
                roi_visibility_stamp_s=cloud.stamp_s,
            ),
            twin=_state(twin, force_n, len(info.believed)),
            reading=MonitorReading(
                stamp_s=time_s,
                mu_m={"local": mu_m, "median": median_m},
                warning_state={"local": state, "median": int(median_m > 0.002)},
                distances=lambda: errors_m,
            ),
            force_n=force_n if tick > 1 else float("nan"),
            true_force_n=0.92 * force_n + 0.002 * float(rng.random()) if self.with_truth else None,
            true_surface=true if self.with_truth else None,
            rate=0.5 if state == 1 else (0.0 if state >= 2 else 1.0),
            proposed=Command({"psm1": ArmCommand(np.array([0.0, 0.0, 0.015]))}),
            sent=Command({"psm1": ArmCommand(np.array([0.0, 0.0, 0.0075]))}),
            believed=believed,
            node_status=_node_status(time_s, plan, step),
            node_message={"defras/operate/act": str(plan.actions[step])} if plan else {},
            plan=plan,
            plan_step=step,
            events=_events(time_s, info.scene.tick_s),
        )


@lru_cache(maxsize=8)
def _ticks(run: SyntheticRun) -> tuple[TickRecord, ...]:
    return tuple(run._ticks())


def flap_surface(lift: float, stuck: float, grid: int = 25) -> Surface:
    """Closed slab surface whose part at x < 0.02 m bends up by ``lift`` (0..1) of 130 degrees.

    ``stuck`` (0..1) holds the flap down around (-0.01, 0.03) m.
    """
    axis = np.linspace(-0.06, 0.06, grid)
    x, y = (part.ravel() for part in np.meshgrid(axis, axis))
    rest = np.stack([x, y], axis=1)
    hold = stuck * np.exp(-((x + 0.01) ** 2 + (y - 0.03) ** 2) / 0.03**2)
    hinge = 0.02 - x
    angle = np.deg2rad(130) * lift * (1 - 0.75 * hold)
    bent = np.clip(hinge, 0, None)
    # A circular arc of the whole angle over the flap's 80 mm.
    curvature = angle / 0.08
    safe = np.where(curvature < 1e-6, 1.0, curvature)
    along = np.where(curvature < 1e-6, bent, np.sin(safe * bent) / safe)
    up = np.where(curvature < 1e-6, 0.0, (1 - np.cos(safe * bent)) / safe)
    upper = np.stack([np.where(hinge > 0, 0.02 - along, x), y, up], axis=1)
    turn = curvature * bent
    normal = np.stack([np.sin(turn), np.zeros_like(turn), np.cos(turn)], axis=1)
    lower = upper - 0.005 * normal
    faces = _grid_faces(grid)
    count = grid * grid
    rim = _rim(grid)
    walls = [
        triangle
        for a, b in zip(rim, np.roll(rim, -1), strict=True)
        for triangle in ((a, a + count, b + count), (a, b + count, b))
    ]
    return Surface(
        vertices_m=np.concatenate([upper, lower]),
        triangles=np.concatenate([faces, faces[:, ::-1] + count, np.array(walls)]),
        upper=np.arange(2 * count) < count,
        rest_xy_m=np.concatenate([rest, rest]),
    )


def _grid_faces(grid: int) -> NDArray[np.int64]:
    corner = (np.arange(grid - 1)[:, None] * grid + np.arange(grid - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + grid + 1], axis=1)
    second = np.stack([corner, corner + grid + 1, corner + grid], axis=1)
    return np.concatenate([first, second])


def _rim(grid: int) -> NDArray[np.int64]:
    """Border vertices, counter-clockwise from above."""
    last = grid * (grid - 1)
    return np.concatenate(
        [
            np.arange(grid - 1),
            np.arange(grid - 1) * grid + grid - 1,
            last + np.arange(grid - 1, 0, -1),
            np.arange(grid - 1, 0, -1) * grid,
        ]
    )


def _lift(time_s: float) -> float:
    if time_s < 6.4:
        lift = np.clip((time_s - 3.2) / 4.0, 0, 0.6) * (1 - np.clip((time_s - 6.2) / 0.2, 0, 1))
    else:
        lift = np.clip((time_s - 9.6) / 5.0, 0, 1)
    return float(lift)


def _observed(
    time_s: float, true: Surface, twin: Surface, rng: np.random.Generator
) -> tuple[PointCloud, Floats]:
    chosen = rng.choice(np.flatnonzero(true.upper), 500)
    gap_m = np.linalg.norm(true.vertices_m[chosen] - twin.vertices_m[chosen], axis=1)
    points_m = true.vertices_m[chosen] + 0.0005 * rng.standard_normal((500, 3))
    return PointCloud(time_s, points_m), gap_m + 0.0005 * np.abs(rng.standard_normal(500))


def _arms(time_s: float, scene: Scene) -> dict[ArmName, ArmObservation]:
    arms: dict[ArmName, ArmObservation] = {}
    motions: tuple[tuple[ArmName, float, float, float, float], ...] = (
        ("psm1", 0.2, 2.6, 6.2, 0.025),
        ("psm2", 7.0, 9.0, 99.0, -0.025),
    )
    for name, start, grasp_s, release_s, y_m in motions:
        home = np.array(scene.arms[name].home_tip_m)
        surface = flap_surface(_lift(time_s), 0.0)
        held = surface.vertices_m[
            int(np.argmin(np.linalg.norm(surface.rest_xy_m[:625] - [-0.05, y_m], axis=1)))
        ]
        share = np.clip((time_s - start) / (grasp_s - start), 0, 1)
        share *= 1 - np.clip((time_s - release_s) / 1.5, 0, 1)
        tip = Pose(home + share * (held - home), np.diag([1.0, -1.0, -1.0]))
        grasped = grasp_s <= time_s < release_s
        joints = np.array([0.1, -0.2, 0.12, 0.0, 0.1, share])
        arms[name] = ArmObservation(
            time_s, tip, tip, 0.0 if grasped else 0.8, grasped, joints, joints + 0.001
        )
    return arms


_BACKDROP = np.stack(
    [
        np.tile(np.linspace(170, 200, 240)[:, None], (1, 320)),
        np.tile(np.linspace(80, 95, 240)[:, None], (1, 320)),
        np.tile(np.linspace(80, 96, 320)[None], (240, 1)),
    ],
    axis=-1,
).astype(np.uint8)


def _image(stamp_s: float, seen: float, with_depth: bool) -> CameraImage:
    """A red field with a green disc, as large as the region that is seen."""
    row, column = np.mgrid[0:240, 0:320]
    rgb = _BACKDROP.copy()
    rgb[np.hypot(row - 120, column - 160) < 80 * seen] = (40, 190, 160)
    return CameraImage(
        stamp_s=stamp_s,
        rgb=rgb,
        depth_m=0.2 + row / 2000.0 if with_depth else None,
        intrinsics=np.array([[320.0, 0.0, 160.0], [0.0, 320.0, 120.0], [0.0, 0.0, 1.0]]),
        tissue_from_camera=Pose(np.array([-0.17, 0.0, 0.12])),
    )


def _state(surface: Surface, force_n: float, holes: int) -> TissueState:
    return TissueState(
        nodes_m=surface.vertices_m,
        surface=surface,
        grasp_forces_n={"psm1": np.array([0.0, 0.0, force_n])},
        grasp_moments_nm={"psm1": np.zeros(3)},
        attachment_forces_n=np.zeros((holes, 3)),
        largest_principal_stress_pa=1000 * force_n,
        stress_at_m=np.zeros(3),
        strain_energy_j=0.001 * force_n,
        converged=True,
        iterations=3,
    )


_FIRST = Plan(FIRST_PLAN, cost=(3,), proved_shortest=True, reasons=("",) * 5, source="preoperative")
_SECOND = Plan(SECOND_PLAN, cost=(2,), proved_shortest=True, reasons=("",) * 5)


def _plan_at(time_s: float) -> tuple[Plan | None, int]:
    if time_s < FIRST_TIMES[0]:
        return None, 0
    plan, times = (_FIRST, FIRST_TIMES) if time_s < SECOND_TIMES[0] else (_SECOND, SECOND_TIMES)
    return plan, int(np.searchsorted(times, time_s + 1e-9, side="right")) - 1


def _node_status(time_s: float, plan: Plan | None, step: int) -> dict[str, str]:
    status = {path: "RUNNING" for path, _ in TREE}
    status["defras/sense"] = "SUCCESS"
    status["defras/guards/human"] = "FAILURE"
    learning = 5.0 <= time_s < SECOND_TIMES[0]
    status["defras/guards/stop_learn_replan"] = "RUNNING" if learning else "FAILURE"
    status["defras/guards/slow_and_learn"] = "" if learning else "FAILURE"
    status["defras/operate/exposed"] = "SUCCESS" if time_s > 15.5 else ""
    status["defras/operate/plan"] = "SUCCESS"
    if plan is not None:
        action = plan.actions[step]
        status[f"defras/operate/act/{action.time}_{action.name}_{action.arm}"] = "RUNNING"
    return status


_STORY = (
    Event(0.0, "start", "info", "The operation starts with a pre-operative plan."),
    Event(0.2, "plan", "info", "The plan has 5 actions and grasps point (1,4)."),
    *(
        Event(at, "action", "info", f"{action.arm.upper()} begins to {action.name}.")
        for at, action in zip(FIRST_TIMES[:4], FIRST_PLAN, strict=False)
    ),
    Event(4.6, "warning", "warning", "The simulation is 2.1 mm off: the motion goes at half rate."),
    Event(5.0, "warning", "warning", "The simulation is 4.2 mm off: the motion stops."),
    Event(5.2, "force", "warning", "The grasp force is above its limit of 0.30 N."),
    Event(
        5.4,
        "learning",
        "info",
        "An update of 3 attachments explains the held-out points no better: rejected.",
        {"adopted": False},
    ),
    Event(
        LEARNED_S,
        "learning",
        "info",
        "An update adds 7 attachments: the held-out error falls from 3.9 mm to 0.8 mm. Adopted.",
        {"adopted": True},
    ),
    Event(6.2, "replan", "info", "A new plan is asked for from what is now believed."),
    Event(6.2, "plan", "info", "The new plan has 5 actions and grasps point (1,2)."),
    *(
        Event(at, "action", "info", f"{action.arm.upper()} begins to {action.name}.")
        for at, action in zip(SECOND_TIMES, SECOND_PLAN, strict=True)
    ),
    Event(15.6, "goal", "info", "94 % of the region is visible: the goal is reached."),
    Event(16.0, "end", "info", "The run ends."),
)


def _events(time_s: float, tick_s: float) -> tuple[Event, ...]:
    half = tick_s / 2
    return tuple(event for event in _STORY if time_s - half < event.time_s <= time_s + half)


def failed(run: SyntheticRun) -> SyntheticRun:
    """The same run, broken off after three seconds of story."""
    return replace(run, duration_s=3.0)
