"""Faults of messages: any reading can freeze, get lost, be late, come twice, or make no sense."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from defras_bt.faults.fault import Fault, Injector
from defras_sim.scene import Scene
from defras_sim.worlds.protocol import ArmObservation, Observation

ReadingName = Literal["cloud", "visibility", "camera", "psm1", "psm2"]
"""``camera``: cloud and visibility together."""
_PARTS: dict[str, tuple[str, ...]] = {"camera": ("cloud", "visibility")}
_HISTORY_S = 5.0


class ReadingFault(Fault):
    """Base of the faults of one reading."""

    reading: ReadingName = Field(default="camera", description="which reading it concerns")

    @property
    def parts(self) -> tuple[str, ...]:
        return _PARTS.get(self.reading, (self.reading,))


def taken(into: Observation, source: Observation, part: str) -> Observation:
    """``into`` with one reading of ``source``."""
    if part == "cloud":
        return replace(into, cloud=source.cloud, depth_image=source.depth_image)
    if part == "visibility":
        return replace(
            into,
            roi_visibility=source.roi_visibility,
            roi_visibility_stamp_s=source.roi_visibility_stamp_s,
            endoscope_image=source.endoscope_image,
        )
    return replace(into, arms={**into.arms, part: source.arms[part]})


def stamp_s(observation: Observation, part: str) -> float:
    """When a reading was taken; minus infinity if there is none."""
    cloud, picture = observation.cloud or observation.depth_image, observation.endoscope_image
    visible_s, arm = observation.roi_visibility_stamp_s, observation.arms.get(part)
    taken_s = {
        "cloud": None if cloud is None else cloud.stamp_s,
        "visibility": picture.stamp_s if visible_s is None and picture is not None else visible_s,
    }.get(part, None if arm is None else arm.stamp_s)
    return -np.inf if taken_s is None else taken_s


class StaleInjector(Injector):
    """Base: delivers whole readings of earlier observations; trips where the newest is too old."""

    _fault: ReadingFault

    def __init__(self, fault: ReadingFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, rng)
        self._max_age_s = scene.thresholds.max_age_s
        self._past: deque[Observation] = deque()
        self._newest_s: dict[str, float] = {}

    def source(self, part: str, true: Observation) -> Observation:
        """The observation whose reading arrives now; ``true`` for the present one."""
        raise NotImplementedError

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self._past.append(true)
        while self._past[0].time_s < true.time_s - _HISTORY_S:
            self._past.popleft()
        old = []
        for part in self._fault.parts:
            source = self.source(part, true)
            if source is not true:
                delivered = taken(delivered, source, part)
            newest_s = max(self._newest_s.get(part, -np.inf), stamp_s(source, part))
            self._newest_s[part] = newest_s
            if true.time_s - newest_s > self._max_age_s + 1e-6:
                old.append(part)
        self.trip = f"{' and '.join(old)} too old" if old else ""
        return delivered

    def before(self, time_s: float) -> Observation:
        """The last observation at or before ``time_s``; the oldest known if there is none."""
        return next((o for o in reversed(self._past) if o.time_s <= time_s + 1e-9), self._past[0])


class Frozen(ReadingFault):
    """A sensor hangs: its last reading stays, with its stamp."""

    kind: ClassVar[str] = "frozen"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Frozen(self, scene, rng)


class _Frozen(StaleInjector):
    def __init__(self, fault: ReadingFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._frozen: Observation | None = None

    def source(self, part: str, true: Observation) -> Observation:
        if not self._fault.active(true.time_s):
            self._frozen = None
            return true
        if self._frozen is None:
            self._frozen = true
        return self._frozen


class Dropped(ReadingFault):
    """Messages get lost: the reading before stays the latest."""

    kind: ClassVar[str] = "dropped"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Dropped(self, scene, rng)


class _Dropped(StaleInjector):
    def __init__(self, fault: ReadingFault, scene: Scene, rng: np.random.Generator) -> None:
        super().__init__(fault, scene, rng)
        self._arrived: dict[str, Observation] = {}
        self._sent_s: dict[str, float] = {}

    def source(self, part: str, true: Observation) -> Observation:
        fresh = stamp_s(true, part) > self._sent_s.get(part, -np.inf)
        self._sent_s[part] = stamp_s(true, part)
        lost = fresh and part in self._arrived and self.happens(true.time_s)
        if fresh and not lost:
            self._arrived[part] = true
        return self._arrived[part]


class Delayed(ReadingFault):
    """Messages are under way for ``delay_s``."""

    kind: ClassVar[str] = "delayed"
    delay_s: Annotated[float, Field(gt=0, le=_HISTORY_S / 2)] = 0.3

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Delayed(self, scene, rng, self.delay_s)


class _Delayed(StaleInjector):
    def __init__(
        self, fault: ReadingFault, scene: Scene, rng: np.random.Generator, delay_s: float
    ) -> None:
        super().__init__(fault, scene, rng)
        self._delay_s = delay_s

    def source(self, part: str, true: Observation) -> Observation:
        return self.before(true.time_s - self._delay_s) if self.happens(true.time_s) else true


class Duplicated(ReadingFault):
    """Messages come twice: the one before arrives again instead of a new one."""

    kind: ClassVar[str] = "duplicated"
    probability: Annotated[float, Field(gt=0, le=1)] = 0.3

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Delayed(self, scene, rng, scene.tick_s)


class OutOfOrder(ReadingFault):
    """Messages overtake each other: one of ``behind_s`` ago arrives after newer ones."""

    kind: ClassVar[str] = "out_of_order"
    probability: Annotated[float, Field(gt=0, le=1)] = 0.3
    behind_s: Annotated[float, Field(gt=0, le=_HISTORY_S / 2)] = 0.2

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Delayed(self, scene, rng, self.behind_s)


class Missing(ReadingFault):
    """A reading is not delivered at all."""

    kind: ClassVar[str] = "missing"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _Missing(self, rng)


class NotANumber(ReadingFault):
    """A reading arrives in time and full of NaN."""

    kind: ClassVar[str] = "not_a_number"

    def injector(self, scene: Scene, rng: np.random.Generator) -> Injector:
        return _NotANumber(self, rng)


class _Missing(Injector):
    _fault: ReadingFault

    def observed(self, true: Observation, delivered: Observation) -> Observation:
        self.trip = ""
        if self.happens(true.time_s):
            self.trip = f"{self._fault.reading} makes no sense"
            for part in self._fault.parts:
                delivered = self.spoiled(delivered, part)
        return delivered

    def spoiled(self, delivered: Observation, part: str) -> Observation:
        if part in ("cloud", "visibility"):
            return taken(delivered, Observation(delivered.time_s, {}), part)
        arms = {name: arm for name, arm in delivered.arms.items() if name != part}
        return replace(delivered, arms=arms)


class _NotANumber(_Missing):
    def spoiled(self, delivered: Observation, part: str) -> Observation:
        if part == "visibility":
            return replace(delivered, roi_visibility=float("nan"))
        if part == "cloud":
            cloud, picture = delivered.cloud, delivered.depth_image
            if cloud is not None:
                cloud = replace(cloud, points_m=np.full_like(cloud.points_m, np.nan))
            if picture is not None and picture.depth_m is not None:
                picture = replace(picture, depth_m=np.full_like(picture.depth_m, np.nan))
            return replace(delivered, cloud=cloud, depth_image=picture)
        return replace(delivered, arms={**delivered.arms, part: _nowhere(delivered.arms[part])})


def _nowhere(arm: ArmObservation) -> ArmObservation:
    gone = replace(arm.tissue_from_tip, position_m=np.full(3, np.nan))
    return replace(arm, tissue_from_tip=gone)
