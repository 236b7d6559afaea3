"""Warning states from clouds and the twin's surfaces, tick by tick."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import replace

import numpy as np

from defras_bt.monitoring.local import LocalMetric
from defras_bt.monitoring.median import MedianMetric
from defras_bt.monitoring.metric import Measurement, Metric
from defras_bt.monitoring.metric_track import MetricTrack
from defras_bt.monitoring.reading import MonitorReading, nowhere
from defras_bt.monitoring.rest import RestCalibration
from defras_bt.monitoring.seen import SeenSurface, seen_surface
from defras_sim.geometry import Floats
from defras_sim.scene import Scene
from defras_sim.surface import Surface
from defras_sim.worlds.protocol import PointCloud

# Released tissue swings back while the quasi-static twin is at rest at once.
SETTLING_S = 5.0
# Where every tick brings a new cloud, metrics that can wait are measured this often.
WAITING_S = 1.0
_HISTORY_S = 1.0


class WarningMonitor:
    """Compares each new cloud with the twin's surface at the moment of the cloud.

    Call :meth:`observe_rest` while the tissue is at rest, then :meth:`reading` every tick.
    """

    def __init__(self, scene: Scene, metrics: Sequence[Metric] | None = None) -> None:
        self._scene = scene
        self._metrics: tuple[Metric, ...] = tuple(metrics or (LocalMetric(), MedianMetric()))
        self._tracks = {
            metric.name: MetricTrack(scene.thresholds.delta_m) for metric in self._metrics
        }
        self._can_wait: Set[str] = set()
        self._waiting: tuple[PointCloud, SeenSurface] | None = None
        self._caught_up_s = -np.inf
        self._rest_stamp_s = -np.inf
        self._resting: tuple[PointCloud, SeenSurface, Set[str]] | None = None
        self._surfaces: deque[tuple[float, Surface]] = deque()
        self._last: MonitorReading | None = None
        self._seen: tuple[Surface, SeenSurface] | None = None

    @property
    def calibration(self) -> Mapping[str, RestCalibration]:
        """Rest calibration per metric; empty until enough rest frames were seen."""
        return {
            name: track.calibration for name, track in self._tracks.items() if track.calibration
        }

    def listen_to(self, metric: str | None) -> None:
        """A tree decides by ``metric``: other metrics can wait for a tick that has less to do.

        The local metric never waits, since its distances belong to the picture of the cloud. Until
        this is called, none does.
        """
        self._can_wait = {m.name for m in self._metrics} - {metric, LocalMetric.name}

    def observe_rest(self, cloud: PointCloud | None, surface: Surface) -> bool:
        """Learn what the metrics say at rest; True once there is enough to calibrate.

        A missing cloud and a cloud seen before teach nothing, but leave time for metrics that had
        to wait.
        """
        if cloud is not None and cloud.stamp_s > self._rest_stamp_s:
            self._rest_stamp_s = cloud.stamp_s
            self._rest(self._resting)
            frame = cloud, self._seen_of(surface)
            self._resting = (*frame, self._can_wait) if self._can_wait else None
            self._rest((*frame, set(self._tracks) - self._can_wait))
        elif self._resting is not None:
            self._rest(self._resting)
            self._resting = None
        return bool(self.calibration)

    def _rest(self, frame: tuple[PointCloud, SeenSurface, Set[str]] | None) -> None:
        """Let metrics of these names learn what they say of a frame at rest."""
        if frame is None:
            return
        cloud, seen, names = frame
        for metric in self._metrics:
            if metric.name in names:
                value_m = metric.measure(cloud.points_m, seen).value_m
                self._tracks[metric.name].rest(value_m)
        if all(track.rested for track in self._tracks.values()):
            for track in self._tracks.values():
                track.calibrate()

    def reading(self, cloud: PointCloud | None, surface: Surface, time_s: float) -> MonitorReading:
        """What monitoring says now; ``surface`` is the twin's at ``time_s``.

        Without a cloud, or before calibration, mu is NaN and the states stay as they were: a NaN
        has to trip every guard. The reading's stamp is the cloud's. A cloud seen before gives the
        reading from before, completed by the metrics that had to wait.
        """
        self._remember(surface, time_s)
        if cloud is None or not self.calibration:
            return self._unknown(time_s)
        if self._last is None or cloud.stamp_s != self._last.stamp_s:
            seen = self._seen_of(self._surface_at(cloud.stamp_s))
            late = cloud.stamp_s - self._caught_up_s >= WAITING_S
            wait = not late and bool(self._can_wait)
            # What waits already is finished first.
            self._waiting = (self._waiting or (cloud, seen)) if wait else None
            now = [m for m in self._metrics if not (wait and m.name in self._can_wait)]
            self._last = self._measured(now, cloud, seen)
        elif self._waiting is not None:
            self._last = self._caught_up(*self._waiting, self._last)
        return self._last

    def _caught_up(
        self, cloud: PointCloud, seen: SeenSurface, last: MonitorReading
    ) -> MonitorReading:
        """``last``, completed if the simulated cloud was made already: this tick does one of both.

        No tick has more to do than one that brings a cloud.
        """
        if not seen.prepared():
            return last
        for metric in self._metrics:
            if metric.name in self._can_wait:
                self._take(metric, cloud, seen)
        self._waiting = None
        return replace(last, mu_m=self._mu_m(), warning_state=self._states())

    def twin_changed(self) -> None:
        """Forget surfaces and states of the twin before it learned; the rest values stay."""
        self._surfaces.clear()
        for track in self._tracks.values():
            track.forget()
        self._last = self._waiting = None

    def camera_registered(self) -> None:
        """As :meth:`twin_changed`. Where the camera stood elsewhere at rest, the rest values hold
        its error: they are lowered to what frames say from now on."""
        self.twin_changed()
        for track in self._tracks.values():
            if track.calibration is not None:
                track.distrust_rest()

    def tissue_released(self, time_s: float) -> None:
        """All tissue was let go at ``time_s``: raise no state until it agrees with the twin again.

        After 5 s it should; what is still off then counts as ever. Mu is told all the while.
        """
        for track in self._tracks.values():
            track.settle_until(time_s + SETTLING_S)

    def tissue_grasped(self) -> None:
        """Tissue is held again: whatever is off now counts."""
        for track in self._tracks.values():
            track.settle_until(-np.inf)

    def _measured(
        self, metrics: Sequence[Metric], cloud: PointCloud, seen: SeenSurface
    ) -> MonitorReading:
        """The reading after ``metrics`` compared a cloud; the other metrics say what they said."""
        distances: Callable[[], Floats] = nowhere
        for metric in metrics:
            measured = self._take(metric, cloud, seen)
            if metric.name == LocalMetric.name:
                distances = measured.distances
        return MonitorReading(cloud.stamp_s, self._mu_m(), self._states(), distances)

    def _take(self, metric: Metric, cloud: PointCloud, seen: SeenSurface) -> Measurement:
        measured = metric.measure(cloud.points_m, seen)
        self._tracks[metric.name].take(measured.value_m, cloud.stamp_s)
        if metric.name in self._can_wait:
            self._caught_up_s = cloud.stamp_s
        return measured

    def _unknown(self, time_s: float) -> MonitorReading:
        return MonitorReading(time_s, dict.fromkeys(self._tracks, float("nan")), self._states())

    def _mu_m(self) -> dict[str, float]:
        return {name: track.mu_m for name, track in self._tracks.items()}

    def _states(self) -> dict[str, int]:
        return {name: track.state for name, track in self._tracks.items()}

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
        times = [time for time, _ in self._surfaces]
        after = bisect_left(times, stamp_s)
        if after == 0 or after == len(times):
            return self._surfaces[min(after, len(times) - 1)][1]
        (start, before), (end, then) = self._surfaces[after - 1], self._surfaces[after]
        if before is then or stamp_s == end:
            return then
        share = (stamp_s - start) / (end - start)
        vertices: Floats = (1 - share) * before.vertices_m + share * then.vertices_m
        return Surface(vertices, then.triangles, then.upper, then.rest_xy_m)
