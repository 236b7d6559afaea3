"""One jaw's set-points: from where it is to where it should be, at limited speed."""

from __future__ import annotations


class JawStream:
    """The jaw keeps its last set-point through every hold: what was gripped stays gripped."""

    def __init__(self, speed_rad_s: float, start_rad: float) -> None:
        self._speed_rad_s = speed_rad_s
        self.angle_rad = start_rad
        self.goal_rad = start_rad

    def pursue(self, goal_rad: float) -> None:
        self.goal_rad = goal_rad

    def stop(self) -> None:
        """Stay at the latest set-point."""
        self.goal_rad = self.angle_rad

    def step(self, elapsed_s: float) -> float:
        """The next set-point in rad, ``elapsed_s`` after the one before."""
        most = self._speed_rad_s * elapsed_s
        self.angle_rad += min(max(self.goal_rad - self.angle_rad, -most), most)
        return self.angle_rad
