"""What a portrait measures across places: whether channels move together, and how."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from defras_bt.diagnosis.layout import Layout, Series
from defras_bt.diagnosis.portrait_measures import Measure
from defras_bt.diagnosis.problem import Samples
from defras_sim.geometry import Floats

_ENOUGH_CHANNELS = 6


def patterns(samples: Samples, found: Layout) -> Iterator[Measure]:
    """For sensors of several channels that are read together: the share of squares that one
    pattern carries, as a wrong attachment makes it; of those that have places, the share of a
    plane over them, as a shifted or tilted camera makes it."""
    groups: dict[str, list[Sequence[Series]]] = {}
    for group in found.together:
        for sensor in dict.fromkeys(samples.channels[one.channel].sensor for one in group):
            own = [one for one in group if samples.channels[one.channel].sensor == sensor]
            if len(own) >= _ENOUGH_CHANNELS:
                groups.setdefault(sensor, []).append(own)
    for sensor, own_groups in groups.items():
        yield Measure(
            "mode",
            sensor,
            "",
            _one_pattern(own_groups),
            f"{sensor}: {{}} of the squared error is one pattern that grows and shrinks.",
        )
        places = {
            one.channel: samples.channels[one.channel].place_m
            for group in own_groups
            for one in group
        }
        if all(place is not None for place in places.values()):
            yield Measure(
                "rigid",
                sensor,
                "",
                _plane(own_groups, {c: p for c, p in places.items() if p is not None}),
                f"{sensor}: {{}} of the squared error is a shift or tilt of the whole.",
            )


def _one_pattern(groups: list[Sequence[Series]]) -> Callable[[Floats], Floats]:
    def of(residuals: Floats) -> Floats:
        share = np.zeros(residuals.shape[1])
        for group in groups:
            grid = np.stack([residuals[one.rows] for one in group])
            gram = np.einsum("cts,dts->scd", grid, grid, optimize=True)
            values = np.linalg.eigvalsh(gram)
            total = np.maximum(values.sum(axis=1), 1e-300)
            share = np.maximum(share, values[:, -1] / total)
        return share

    return of


def _plane(
    groups: list[Sequence[Series]], places_m: dict[int, tuple[float, float]]
) -> Callable[[Floats], Floats]:
    def of(residuals: Floats) -> Floats:
        explained, total = np.zeros(residuals.shape[1]), np.zeros(residuals.shape[1])
        for group in groups:
            design = np.array([[1.0, *places_m[one.channel]] for one in group])
            basis = np.linalg.qr(design)[0]
            grid = np.stack([residuals[one.rows] for one in group])
            along = np.einsum("ck,cts->kts", basis, grid)
            explained += (along**2).sum(axis=(0, 1))
            total += (grid**2).sum(axis=(0, 1))
        return np.asarray(explained / np.maximum(total, 1e-300))

    return of
