"""The tissue at rest: its upper and its lower face over the plane z = 0 of the tissue frame.

Holes, grasp points and the region of interest are places in x and y; a face says where on the
tissue each lies. A slab has flat faces; those of a patient's anatomy are curved, see
:mod:`defras_sim.anatomy.curved_face`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from defras_sim.geometry import Floats

Mask = NDArray[np.bool_]


class NotASlab(ValueError):
    """Asked of a patient's anatomy what only a slab can do."""


class Face(Protocol):
    """One side of the resting tissue, a height over x and y."""

    def at(self, xy_m: Floats) -> Floats:
        """Points (..., 3) of the face at ``xy_m`` (..., 2).

        Where there is no tissue, that of the nearest place with tissue.
        """

    def tangents(self, xy_m: Floats) -> Floats:
        """Two perpendicular unit tangents (..., 2, 3); the first has no part along y."""

    def inset(self, xy_m: Floats, margin_m: float) -> Floats:
        """The place (2,) nearest to ``xy_m`` (2,) that is ``margin_m`` away from the rim, or as
        far as there is room."""


class RestShape(Protocol):
    """The resting tissue."""

    @property
    def upper(self) -> Face: ...

    @property
    def lower(self) -> Face: ...

    @property
    def low_m(self) -> Floats:
        """Smallest coordinates (3,)."""

    @property
    def high_m(self) -> Floats:
        """Largest coordinates (3,)."""

    @property
    def outline_m(self) -> Floats:
        """The tissue's outline (k, 2) seen from above, once around."""

    def covers(self, xy_m: Floats) -> Mask:
        """At which of ``xy_m`` (n, 2) there is tissue."""


@dataclass(frozen=True)
class FlatFace:
    """A level rectangle around the z axis, ``half_m`` (2,) in half."""

    half_m: Floats
    height_m: float

    def at(self, xy_m: Floats) -> Floats:
        points_m = np.empty((*np.shape(xy_m)[:-1], 3))
        points_m[..., :2] = np.minimum(np.maximum(xy_m, -self.half_m), self.half_m)
        points_m[..., 2] = self.height_m
        return points_m

    def tangents(self, xy_m: Floats) -> Floats:
        return np.broadcast_to(np.eye(3)[:2], (*np.shape(xy_m)[:-1], 2, 3))

    def inset(self, xy_m: Floats, margin_m: float) -> Floats:
        return np.clip(xy_m, margin_m - self.half_m, self.half_m - margin_m)


@dataclass(frozen=True)
class Slab:
    """A box with its upper face at z = 0."""

    length_x_m: float
    width_y_m: float
    thickness_m: float

    @property
    def upper(self) -> FlatFace:
        return FlatFace(self._half_m, 0.0)

    @property
    def lower(self) -> FlatFace:
        return FlatFace(self._half_m, -self.thickness_m)

    @property
    def low_m(self) -> Floats:
        return np.array([*-self._half_m, -self.thickness_m])

    @property
    def high_m(self) -> Floats:
        return np.array([*self._half_m, 0.0])

    @property
    def outline_m(self) -> Floats:
        return self._half_m * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])

    def covers(self, xy_m: Floats) -> Mask:
        inside: Mask = np.all(np.abs(xy_m) <= self._half_m + 1e-9, axis=-1)
        return inside

    @property
    def _half_m(self) -> Floats:
        return np.array([self.length_x_m, self.width_y_m]) / 2
