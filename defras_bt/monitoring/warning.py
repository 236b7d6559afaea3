"""Warning states from clouds and the twin's surfaces, tick by tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.metric import Metric
from defras_bt.monitoring.reading import MonitorReading
from defras_bt.monitoring.rest import MIN_REST_FRAMES, RestCalibration, calibrate_rest
from defras_bt.monitoring.seen import SeenSurface, seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import PointCloud

# A state is believed when this many camera frames in a row reach it: noise of one frame neither
# stops a motion nor teaches the twin. Costs one camera period, 1.5 mm at the speed with tissue.
CONFIRMING_FRAMES = 2
_MAX_REST_FRAMES = 100
# Released tissue swings back while the quasi-static twin is at rest at once.
SETTLING_S = 5.0
_HISTORY_S = 1.0


class WarningMonitor:
    """Compares each new cloud with the twin's surface at the moment of the cloud.

    Call :meth:`observe_rest` while the tissue is at rest, then :meth:`reading` every tick.
    """

    def __init__(self, scene: Scene, metrics: Sequence[Metric] | None = None) -> None:
        self._scene = scene
        self._metrics: tuple[Metric, ...] = tuple(metrics or (LocalMetric(), MedianMetric()))
        self._rest: dict[str, list[float]] = {metric.name: [] for metric in self._metrics}
        self._rest_stamp_s = -np.inf
        self._calibration: dict[str, RestCalibration] = {}
        self._surfaces: deque[tuple[float, Surface]] = deque()
        self._raw_states: deque[Mapping[str, int]] = deque(maxlen=CONFIRMING_FRAMES)
        self._last: MonitorReading | None = None
        self._settling_until_s = -np.inf
        self._seen: tuple[Surface, SeenSurface] | None = None

    @property
    def calibration(self) -> Mapping[str, RestCalibration]:
        """Rest calibration per metric; empty until enough rest frames were seen."""
        return dict(self._calibration)

    def observe_rest(self, cloud: PointCloud | None, surface: Surface) -> bool:
        """Learn what the metrics say at rest; True once there is enough to calibrate.

        A missing cloud and a cloud seen before teach nothing.
        """
        if cloud is not None and cloud.stamp_s > self._rest_stamp_s:
            self._rest_stamp_s = cloud.stamp_s
            seen = self._seen_of(surface)
            for metric in self._metrics:
                values = self._rest[metric.name]
                value = metric.measure(cloud.points_m, seen).value_m
                if np.isfinite(value) and len(values) < _MAX_REST_FRAMES:
                    values.append(value)
            if all(len(values) >= MIN_REST_FRAMES for values in self._rest.values()):
                delta_m = self._scene.thresholds.delta_m
                self._calibration = {
                    name: calibrate_rest(values, delta_m) for name, values in self._rest.items()
                }
        return bool(self._calibration)

    def reading(self, cloud: PointCloud | None, surface: Surface, time_s: float) -> MonitorReading:
        """What monitoring says now; ``surface`` is the twin's at ``time_s``.

        Without a cloud, or before calibration, mu is NaN and the states stay as they were: a NaN
        has to trip every guard. The reading's stamp is the cloud's. A cloud seen before gives the
        reading from before.
        """
        self._remember(surface, time_s)
        if cloud is None or not self._calibration:
            return self._unknown(time_s)
        if self._last is not None and cloud.stamp_s == self._last.stamp_s:
            return self._last
        seen = self._seen_of(self._surface_at(cloud.stamp_s))
        mu: dict[str, float] = {}
        raw: dict[str, int] = {}
        per_point = np.zeros(0)
        for metric in self._metrics:
            measured = metric.measure(cloud.points_m, seen)
            calibration = self._calibration[metric.name]
            mu[metric.name] = calibration.mu_m(measured.value_m)
            raw[metric.name] = (
                self._last_state(metric.name)
                if np.isnan(measured.value_m)
                else calibration.state(mu[metric.name])
            )
            if metric.name == "local":
                per_point = measured.per_point_m
        self._raw_states.append(self._settled(raw, cloud.stamp_s))
        confirmed = {
            name: min(states[name] for states in self._raw_states)
            if len(self._raw_states) == CONFIRMING_FRAMES
            else 0
            for name in raw
        }
        self._last = MonitorReading(cloud.stamp_s, mu, confirmed, per_point)
        return self._last

    def twin_changed(self) -> None:
        """Forget surfaces and states of the twin before it learned; the rest values stay."""
        self._surfaces.clear()
        self._raw_states.clear()
        self._last = None

    def tissue_released(self, time_s: float) -> None:
        """All tissue was let go at ``time_s``: raise no state until it agrees with the twin again.

        After 5 s it should; what is still off then counts as ever. Mu is told all the while.
        """
        self._settling_until_s = time_s + SETTLING_S

    def tissue_grasped(self) -> None:
        """Tissue is held again: whatever is off now counts."""
        self._settling_until_s = -np.inf

    def _settled(self, raw: Mapping[str, int], stamp_s: float) -> Mapping[str, int]:
        if stamp_s >= self._settling_until_s:
            return raw
        if not any(raw.values()):
            self._settling_until_s = stamp_s
        return dict.fromkeys(raw, 0)

    def _unknown(self, time_s: float) -> MonitorReading:
        names = [metric.name for metric in self._metrics]
        states = {name: self._last_state(name) for name in names}
        return MonitorReading(time_s, dict.fromkeys(names, float("nan")), states)

    def _last_state(self, name: str) -> int:
        return self._last.warning_state[name] if self._last else 0

    def _remember(self, surface: Surface, time_s: float) -> None:
        while self._surfaces and self._surfaces[-1][0] >= time_s:
            self._surfaces.pop()
        self._surfaces.append((time_s, surface))
        while self._surfaces[0][0] < time_s - _HISTORY_S:
            self._surfaces.popleft()

    def _seen_of(self, surface: Surface) -> SeenSurface:
        """What the camera sees of a surface; of one that did not change it is known already."""
        if self._seen is None or self._seen[0] is not surface:
            self._seen = (surface, seen_surface(surface, self._scene.depth_camera))
        return self._seen[1]

    def _surface_at(self, stamp_s: float) -> Surface:
        """The twin's surface when a cloud was taken, between two remembered ones.

        At the speed with tissue, the current surface would be off by up to 1.5 mm.
        """
        times = np.array([time for time, _ in self._surfaces])
        after = int(np.searchsorted(times, stamp_s))
        if after == 0 or after == len(times):
            return self._surfaces[min(after, len(times) - 1)][1]
        (start, before), (end, then) = self._surfaces[after - 1], self._surfaces[after]
        if before is then or stamp_s == end:
            return then
        share = (stamp_s - start) / (end - start)
        vertices: Floats = (1 - share) * before.vertices_m + share * then.vertices_m
        return Surface(vertices, then.triangles, then.upper, then.rest_xy_m)
