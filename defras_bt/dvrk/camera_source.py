"""What the executive's world asks of a laboratory's cameras."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from defras_sim.worlds.protocol import CameraImage, PointCloud


@dataclass(frozen=True)
class CameraReadings:
    """The latest of every camera, in the tissue frame, or None where nothing sound came yet.

    Stamps are those of the messages, in seconds of the clock that stamped them: the world makes
    its own time of them, and judges their age. A message that must not be used (another frame,
    other units, a stamp of 0 or one that runs backwards) leaves the last sound reading in its
    place, which so grows old, and a sentence in ``faults`` by the reading's name: ``cloud``,
    ``endoscope``.

    ``roi_visibility`` is judged with the laboratory's own colours, from the picture whose stamp it
    has. What is given here ready-made, cloud or visibility, the executive does not make again.
    """

    cloud: PointCloud | None = None
    depth_image: CameraImage | None = None
    endoscope_image: CameraImage | None = None
    roi_visibility: float | None = None
    roi_visibility_stamp_s: float | None = None
    faults: Mapping[str, str] = field(default_factory=dict)


class CameraSource(Protocol):
    """Cameras of one set-up. Methods may be called from the executive's thread at any time."""

    def latest(self) -> CameraReadings:
        """The newest readings; never waits."""

    def now_s(self) -> float:
        """The time on the clock that stamps the messages."""

    def when_unusable(self, act: Callable[[], None]) -> None:
        """Have ``act`` called, on any thread, as soon as a reading that was sound is no more."""

    def close(self) -> None:
        """Listen no more."""


class NoCameras:
    """A set-up without cameras, for trials of the arms alone: guards find the cloud missing."""

    def latest(self) -> CameraReadings:
        return CameraReadings()

    def now_s(self) -> float:
        return 0.0

    def when_unusable(self, act: Callable[[], None]) -> None:
        pass

    def close(self) -> None:
        pass
