"""A jaw holds something if it was told to close and comes to rest wider open."""

from __future__ import annotations

import pytest

from defras_bt.dvrk.jaw_grip import JawGrip

TICK_S, SPEED_RAD_S, LAG_RAD = 0.05, 2.0, 0.05


@pytest.fixture
def grip() -> JawGrip:
    return JawGrip(closed_rad=0.0, holds_above_rad=0.08)


def closing(stop_rad: float) -> list[tuple[float, float]]:
    """(measured, set-point) of a jaw that closes from 0.8 rad until something stops it."""
    setpoints = [max(0.8 - tick * SPEED_RAD_S * TICK_S, 0.0) for tick in range(16)]
    return [
        (max(setpoint + (LAG_RAD if setpoint else 0.0), stop_rad), setpoint)
        for setpoint in setpoints
    ]


def test_tissue_is_held_once_the_jaw_rests_on_it(grip: JawGrip) -> None:
    looks = [grip.look(*look) for look in closing(stop_rad=0.15)]
    assert looks[-1]
    assert not any(looks[:8]), "still turning"
    assert looks == sorted(looks), "once it holds, it holds"


def test_a_jaw_that_closes_on_nothing_never_holds(grip: JawGrip) -> None:
    assert not any(grip.look(*look) for look in closing(stop_rad=0.0))


def test_opening_lets_go_as_soon_as_the_set_point_says_so(grip: JawGrip) -> None:
    for look in closing(stop_rad=0.15):
        grip.look(*look)
    assert grip.look(0.15, 0.0)
    assert not grip.look(0.15, 0.1)
    assert not grip.look(0.3, 0.35)


def test_a_jaw_found_closed_on_something_is_told_after_two_looks(grip: JawGrip) -> None:
    assert not grip.look(0.15, 0.0)
    assert grip.look(0.15, 0.0)


def test_a_jaw_that_lags_while_it_opens_holds_nothing(grip: JawGrip) -> None:
    assert not any(grip.look(measured, measured + LAG_RAD) for measured in (0.0, 0.1, 0.2, 0.3))
